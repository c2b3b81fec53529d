"""Contact between fragments under a shock: does contact alone transmit the pressure of broken material, and how many
sweeps are needed?

In ``python -m tests.bench.dust`` a flyer hits a target of the same brittle material between planes of symmetry, so that
the material cannot move sideways. The resulting tables are in docs/theory/contact.md, "Dust under pressure".
"""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from conoid.cases.estimates.impact import wave_speed
from conoid.cases.load import parse_case
from conoid.cases.model.schema import Case
from conoid.cases.reading.library import library
from conoid.worker import simulation, step
from conoid.worker.fracture import connectivity
from conoid.worker.parallel.comm import SerialComm

from .table import Cell, table

SWEEPS = (5, 10, 20, 40)
PLANS = (
    *(("alumina", speed) for speed in (1000.0, 500.0, 200.0, 100.0, 50.0)), ("soda_lime", 1200.0), ("soda_lime", 600.0),
)  # fmt: skip
SIZE = 0.1e-3
"""Element size, m."""
_WIDE, _FLYER, _TARGET = 0.4e-3, 2e-3, 4e-3
_FROM, _TO = 0.1e-6, 0.25e-6
"""Period in which the pressure is measured, s after the impact. In this period the wave of the impact has passed the
bodies, and no other wave has arrived."""


@dataclass(frozen=True)
class Impact:
    """Result of a run."""

    pressure: float
    """Mean of the contact force on the target over the area of the target, Pa."""
    fragments: int
    seconds: float
    """CPU time of contact, s."""


def flyer(name: str, speed: float, sweeps: int | None, *, wide: float, long: Sequence[float], end: float) -> Case:
    """Returns the case of a flyer and a target of one material, with the two lengths ``long``, m; for ``sweeps`` None
    the case has the default number of sweeps."""
    mesh = {"shape": "box", "element_size": SIZE, "generator": "gmsh"}
    return parse_case(
        {
            "name": "dust", "run": {"end_time": end, "frames": 0},
            "contact": {"sweeps": sweeps} if sweeps is not None else {},
            "parts": [
                {
                    "name": part, "material": name, "velocity": [0, 0, v], "fracture": {"model": "cohesive"},
                    "mesh": {**mesh, "low": [0, 0, low], "high": [wide, wide, high]},
                }
                for part, v, low, high in (("flyer", speed, -long[0], 0.0), ("target", 0.0, 0.0, long[1]))
            ],
            "boundaries": [{"kind": "symmetry", "axis": axis, "at": at} for axis in "xy" for at in (0.0, wide)],
        }
    )  # fmt: skip


def expected(name: str, speed: float) -> tuple[float, float]:
    """Returns the pressures of material without strength and of intact material, Pa, for linear waves with half the
    impact speed."""
    made = library()[name]
    return math.sqrt(made.bulk * made.density) * speed / 2.0, made.density * wave_speed(made) * speed / 2.0


def measure(case: Case, begin: float) -> Impact:
    """Computes all steps of a run; the pressure is the mean from ``begin``, s, to the end of the run."""
    sim = simulation.build(case, Path(), SerialComm())
    contact, fracture = sim.contact, sim.fracture
    assert contact is not None
    assert fracture is not None
    assert fracture.cohesion is not None
    first: tuple[float, float] | None = None
    step.prepare(sim)
    while True:
        step.first_half(sim)
        given, t = float(contact.impulses()[1, 2]), sim.clock.t
        if first is None and t > begin:
            first = t, given
        if sim.clock.done:
            break
        step.second_half(sim)
    assert first is not None
    area = float(np.prod(np.ptp(sim.model.nodes.x0[:, :2], axis=0)))
    labels = connectivity.labels(sim.model, fracture.cohesion.facets.tets, sim.comm)
    pieces = len(np.unique(np.concatenate(labels)))
    return Impact((given - first[1]) / (t - first[0]) / area, pieces, sim.timers.seconds["contact"])


def main() -> int:
    """Runs all variants of the study."""
    rows: list[list[Cell]] = []
    for name, speed in PLANS:
        cases = (flyer(name, speed, k, wide=_WIDE, long=(_FLYER, _TARGET), end=_TO) for k in (*SWEEPS, None))
        found = [measure(case, _FROM) for case in cases]
        cells = [f"{each.pressure / 1e9:.2f}, {each.fragments:,}, {each.seconds:.1f} s" for each in found]
        broken, whole = expected(name, speed)
        rows.append([f"{name}, {speed:g} m/s", *cells, f"{broken / 1e9:.2f}, {whole / 1e9:.2f}"])
    print(table(["GPa, fragments, CPU of contact", *(f"{k} sweeps" for k in SWEEPS), "default", "broken, whole"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
