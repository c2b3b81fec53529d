"""Element updates per CPU second of whole steps for each material and pressure form, and the limit by gather and
scatter."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from conoid.cases.model.bodies import Box
from conoid.worker.mesh.build import build as build_mesh

from . import akantu_peer
from .gather_scatter import GatherScatter
from .scene import FORMS, SAMPLE_EVERY, Form, Ride, case
from .stopwatch import Times, Work, take_turns
from .table import Cell, table


@dataclass(frozen=True)
class Metal:
    """A material of the library; ``strain`` is the strain of a tet per step."""

    title: str
    name: str
    viscosity: bool
    strain: float


METALS = (
    Metal("elastic", "steel", False, 1e-5),
    Metal("elastic, viscosity", "steel", True, 1e-5),
    Metal("linear hardening, viscosity", "copper_taylor", True, 1e-3),
    Metal("Johnson-Cook, viscosity", "steel_42crmo4", True, 1e-3),
    Metal("Johnson-Cook, Mie-Grueneisen, viscosity", "copper_ofhc", True, 1e-3),
    Metal("Cowper-Symonds, viscosity", "mild_steel_cowper_symonds", True, 1e-3),
)


@dataclass(frozen=True)
class Speed:
    """Speed of one body in millions of element updates per CPU second, best and median; ``limit`` is the speed of
    gather and scatter only.
    """

    material: str
    form: str
    tets: int
    yielding: float
    best: float
    median: float
    spread: float
    limit_best: float
    limit_median: float
    phases: dict[str, float]
    """Fraction of the CPU time that each phase takes."""

    @property
    def share(self) -> float:
        """Best speed over the best speed of gather and scatter."""
        return self.best / self.limit_best


def measure(bodies: Sequence[Box], metals: Sequence[Metal] = METALS, rounds: int = 5) -> Iterator[Speed]:
    """Measures every material in every pressure form on every body."""
    for body in bodies:
        for metal in metals:
            for form in FORMS:
                yield _one(metal, form, body, rounds)


def _one(metal: Metal, form: Form, body: Box, rounds: int) -> Speed:
    ride = _moving(metal, form, body)
    steps = _burst(ride.tets)
    times = take_turns({"step": lambda: ride.steps(steps), "limit": _limit(ride, steps)}, rounds)
    spent = ride.sim.timers.seconds
    return Speed(
        metal.title, form, ride.tets, ride.yielding(),
        **_rates(times["step"], "", ride.tets * steps), spread=times["step"].spread,
        **_rates(times["limit"], "limit_", ride.tets * steps),
        phases={name: seconds / sum(spent.values()) for name, seconds in spent.items()},
    )  # fmt: skip


def _moving(metal: Metal, form: Form, body: Box) -> Ride:
    ride = Ride(case(metal.name, form, body, metal.viscosity))
    ride.stretch(metal.strain)
    return ride


def _limit(ride: Ride, sweeps: int) -> Work:
    kernel = GatherScatter(ride.sim)
    return lambda: kernel.sweeps(sweeps)


def _burst(tets: int) -> int:
    """Returns the number of steps of one measurement: whole periods of the energy balance, about 3 million element
    updates.
    """
    return SAMPLE_EVERY * min(3, max(1, round(3e6 / SAMPLE_EVERY / tets)))


def _rates(times: Times, prefix: str, updates: int) -> dict[str, float]:
    return {f"{prefix}best": updates / times.best * 1e-6, f"{prefix}median": updates / times.median * 1e-6}


def tables(speeds: Sequence[Speed]) -> str:
    """Returns one table for each mesh size: best (median) speed of each pressure form, and its ratio to the limit."""
    head = ["material", "yielding", *FORMS, *(f"{form} / limit" for form in FORMS), "gather-scatter"]
    parts = []
    for tets in dict.fromkeys(speed.tets for speed in speeds):
        rows = [_row([s for s in speeds if s.tets == tets and s.material == m.title]) for m in METALS]
        parts.append(f"{tets:,} tets, millions of element-updates per CPU-second, best (median):\n\n")
        parts.append(table(head, [row for row in rows if row]) + "\n\n")
    return "".join(parts)


def _row(speeds: Sequence[Speed]) -> list[Cell]:
    if not speeds:
        return []
    limit = max(s.limit_best for s in speeds)
    return [
        speeds[0].material, f"{speeds[0].yielding:.0%}", *(f"{s.best:.1f} ({s.median:.1f})" for s in speeds),
        *(f"{s.share:.0%}" for s in speeds), f"{limit:.0f}",
    ]  # fmt: skip


@dataclass(frozen=True)
class Peer:
    """Speed of one program on the mesh of the comparison."""

    code: str
    milliseconds: float
    best: float
    median: float
    spread: float


def beside_akantu(body: Box, rounds: int = 4, steps: int = SAMPLE_EVERY) -> list[Peer]:
    """Measures Conoid and Akantu in alternation on one mesh; Akantu is left out if it is not installed."""
    ride = _moving(METALS[0], "standard", body)
    work: dict[str, Work] = {
        "gather and scatter only": _limit(ride, steps),
        "Conoid, finite strain": lambda: ride.steps(steps),
    }
    with ExitStack() as stack:
        if release := akantu_peer.version():
            file = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "mesh.npz"
            mesh = build_mesh(body, Path())
            np.savez(file, points=mesh.points, tets=mesh.tets)
            for finite in (False, True):
                for tuned in (False, True):
                    name = f"Akantu {release}, {'finite' if finite else 'small'} strain{', malloc tuned' * tuned}"
                    child = stack.enter_context(akantu_peer.Akantu(file, finite, tuned))
                    work[name] = lambda child=child: child.steps(steps)  # type: ignore[misc]
        times = take_turns(work, rounds)
    updates = ride.tets * steps
    return [
        Peer(name, t.best / steps * 1e3, **_rates(t, "", updates), spread=t.spread) for name, t in times.items()
    ]  # fmt: skip


def peer_table(peers: Sequence[Peer]) -> str:
    """Returns a table of the time per step, ms, and of millions of element updates per CPU second."""
    rows: list[list[Cell]] = [
        [p.code, round(p.milliseconds, 1), f"{p.best:.2f} ({p.median:.2f})", f"{p.spread:.0%}"] for p in peers
    ]
    text = table(["elastic", "CPU ms a step", "M updates / CPU-s, best (median)", "spread"], rows)
    return text if len(peers) > 2 else text + "\n\nAkantu: not installed (pip install akantu).\n"


def as_data(results: Sequence[Speed] | Sequence[Peer]) -> list[dict[str, object]]:
    """Returns the results as data for JSON."""
    return [asdict(result) for result in results]
