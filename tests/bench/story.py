"""Messages and files of a run that no solver computed: journal, history.csv, a snapshot and an outcome, by simple
laws.
"""

import csv
import hashlib
import math
import random
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases import messages, outcome
from conoid.cases.model.schema import Case
from conoid.cases.output import history, layout
from conoid.cases.reading.quantities import FIELD_UNITS
from conoid.cases.run import State

from .page_scene import blob

_POINTS = 60
"""Number of lines of history.csv (chosen value: so many lines make a curve in a chart)."""
_TRIANGLES = 400
"""Size of a snapshot (chosen value: twenty fragments)."""
_ENDS: Sequence[tuple[State, str | None, str]] = (
    [(State.SUCCEEDED, None, "")] * 17
    + [(State.FAILED, "diverged", "the time step fell to 1.2e-14 s: tet 4711 of glass, held by its shape")]
    + [(State.FAILED, "energy", "the energy residual is 7.3 %, above run.residual_limit = 5 %")]
    + [(State.CANCELLED, "cancelled", "")]
)  # fmt: skip
_LIMITER = "stability: tet 12 of part 0"
_BALLISTIC = 160.0
"""Impact speed above which a projectile perforates the target in these laws, m/s (chosen value)."""


class Story:
    """Numbers of one run by the simple laws."""

    def __init__(self, path: Path, run: str, case: Case, began: float, draw: random.Random) -> None:
        """Chooses the end of the run and its measured values; ``began`` is the Unix time of the start, s."""
        self.path, self.run, self.case, self.began = path, run, case, began
        self.state, self.cause, self.message = draw.choice(_ENDS)
        self.friction = case.contact.friction if case.contact is not None else 0.0
        self.share = 1.0 if self.state is State.SUCCEEDED else draw.uniform(0.1, 0.9)
        self.seconds = draw.uniform(30.0, 900.0)
        self.speed = max(abs(v) for v in case.parts[0].velocity)
        self.noise = [draw.gauss(0.0, 0.02) for _ in range(4)]
        fast = max(0.0, self.speed**2 - _BALLISTIC**2) ** 0.5
        self.fragments = 1 + int(fast * (1.0 + self.noise[0]))
        self.values = [self._probe(k) for k in range(len(case.probes))]

    def _probe(self, k: int) -> list[float]:
        """Returns a wave at a probe: the wave arrives later at a greater distance, and its amplitude grows with the
        speed.
        """
        unit = FIELD_UNITS[self.case.probes[k].field]
        size = self.speed * (1e7 if unit == "Pa" else 0.5) * (-1.0 if unit == "Pa" else 1.0) * (1.0 + self.noise[1])
        return [size * _front(n / _POINTS - 0.1 * (k // 2), 9.0) for n in range(1, self.last + 1)]

    @property
    def last(self) -> int:
        """Number of lines of history.csv."""
        return max(2, round(self.share * _POINTS))

    def time(self, n: int) -> float:
        """Returns the simulated time at line ``n`` of history.csv, s."""
        return self.case.run.end_time * n / _POINTS

    def energy(self, n: int) -> messages.Energy:
        """Returns the values of line ``n`` of history.csv."""
        whole, spent = 1e-2 * self.speed**2, 0.4 * (1.0 - math.exp(-3.0 * n / _POINTS))
        return messages.Energy(
            kinetic=whole * (1.0 - spent), elastic=0.1 * whole * spent, plastic=0.6 * whole * spent,
            viscous=0.05 * whole * spent, contact=0.05 * whole * spent, fracture=0.1 * whole * spent,
            friction=whole * spent * self.friction / 3.0, external=0.0, initial=whole,
            residual=1e-4 * (1.0 + abs(self.noise[2])) * n / _POINTS,
        )  # fmt: skip

    def tell(self) -> None:
        """Writes all files of the run."""
        self._write_history()
        snapshot = self._write_snapshot()
        with (self.path / layout.JOURNAL).open("ab") as file:
            for seq, message in enumerate(self._journal(snapshot), 2):
                file.write(messages.to_json(message).replace(b'"seq":0', b'"seq":%d' % seq, 1) + b"\n")
        (self.path / layout.OUTCOME).write_bytes(outcome.to_json(self._outcome()))

    def _write_history(self) -> None:
        units = {probe.name: FIELD_UNITS[probe.field] for probe in self.case.probes}
        with (self.path / layout.HISTORY).open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(history.header({**history.COLUMNS, **units}))
            for n in range(1, self.last + 1):
                energy = msgspec.structs.astuple(self.energy(n))
                clock = (100 * n, self.time(n), 1e-8, _LIMITER)
                probed = (each[n - 1] for each in self.values)
                writer.writerow([*clock, *energy, *([0.0] * len(history.MOMENTA)), *probed])

    def _write_snapshot(self) -> messages.Snapshot:
        place = layout.snapshot(self.path, 0)
        place.parent.mkdir()
        data = blob(0, _TRIANGLES, self.time(self.last))
        place.write_bytes(data)
        return messages.Snapshot(
            run=self.run, step=100 * self.last, t=self.time(self.last), wall=self._wall(self.last), n=0,
            bytes=len(data), path=f"{layout.SNAPSHOTS}/{place.name}", triangles=_TRIANGLES, fragments=self.fragments,
            sha256=hashlib.sha256(data).hexdigest(), cause="end",
        )  # fmt: skip

    def _wall(self, n: int) -> float:
        return self.began + self.seconds * n / _POINTS

    def _journal(self, snapshot: messages.Snapshot) -> Iterator[messages.AnyMessage]:
        for state in (State.QUEUED, State.STARTING, State.RUNNING):
            yield messages.Status(run=self.run, wall=self.began, state=state)
        for n in range(1, self.last + 1):
            yield from self._report(n)
        yield snapshot
        yield messages.Status(
            run=self.run, wall=self._wall(self.last), state=self.state, cause=self.cause, message=self.message,
            step=100 * self.last, t=self.time(self.last),
        )  # fmt: skip

    def _report(self, n: int) -> Iterator[messages.AnyMessage]:
        at: dict[str, Any] = {"run": self.run, "step": 100 * n, "t": self.time(n), "wall": self._wall(n)}
        ranks = self.case.run.ranks
        grown = int(self.fragments * n / self.last)
        yield messages.Counts(
            **at, elements=5000, nodes=1500 + grown, shared=50, fragments=max(1, grown), facets=3 * grown,
            elements_per_rank=[5000 // ranks] * ranks,
        )  # fmt: skip
        yield messages.Progress(
            **at, end_time=self.case.run.end_time, dt=1e-8, limiter=_LIMITER, energy=self.energy(n),
            eta=self._wall(_POINTS) - self._wall(n), updates_per_second=3e6,
        )  # fmt: skip
        phases = {name: [1.0 + 0.1 * rank for rank in range(ranks)] for name in ("elements", "contact", "exchange")}
        yield messages.Load(**at, phases=phases, imbalance=1.0 + 0.05 * (n % 5), steps=100, waiting=[0.2] * ranks)

    def _outcome(self) -> outcome.Outcome:
        took, cores = self.seconds * self.share, self.case.run.ranks * self.case.run.threads
        energy = self.energy(self.last)
        return outcome.Outcome(
            state=self.state, cause=self.cause, message=self.message, steps=100 * self.last, time=self.time(self.last),
            ranks=self.case.run.ranks, threads=self.case.run.threads, elapsed=took, setup=1.0, cpu=0.9 * took * cores,
            digest=hashlib.sha256(self.run.encode()).hexdigest(), elements=5000, eroded=0, eroded_mass=0.0,
            nodes_initial=1500, nodes=1500 + self.fragments, fragments=self.fragments, broken=3 * self.fragments,
            energy=energy, worst_residual=energy.residual, probes=self._probes(),
            reference=self._checks() if self.state is State.SUCCEEDED else [],
        )  # fmt: skip

    def _probes(self) -> list[outcome.Measured]:
        measured = zip(self.case.probes, self.values, strict=True)
        return [
            outcome.Measured(
                name=probe.name, value=values[-1], unit=FIELD_UNITS[probe.field], least=min(values), most=max(values)
            )
            for probe, values in measured
        ]

    def _checks(self) -> list[outcome.Check]:
        miss = 30.0 * self.noise[3]
        return [
            outcome.Check(
                name=f"{each.quantity} {each.probe or each.part or ''}".strip(), expected=each.value,
                value=each.value + miss * each.tolerance, tolerance=each.tolerance, passed=abs(miss) <= 1.0,
            )
            for each in self.case.reference
        ]  # fmt: skip


def _front(x: float, steep: float) -> float:
    """Returns a step function with oscillations: 0 for negative arguments, a front at 0."""
    return 0.0 if x <= 0.0 else 1.0 - math.exp(-steep * x) * math.cos(40.0 * x)
