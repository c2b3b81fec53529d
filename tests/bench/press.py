"""Stiffness of fragmented material under pressure, for several numbers of contact sweeps.

In ``python -m tests.bench.press [SWEEPS ...]`` a ram presses a quarter of a glass cylinder in a steel bore through a
hole of half its width. Contact alone supports the fragments, in chains from the ram to the walls. A driven ram has a
constant speed of 60 m/s. A free ram starts with 200 m/s, and the run ends after the ram has stopped; the free ram also
runs with half the element size. The resulting tables are in docs/theory/contact.md, "Driven rubble" and "Sweeps by
need".
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from conoid.cases.load import parse_case
from conoid.cases.model.schema import Case
from conoid.worker import simulation, step
from conoid.worker.contact.checks import common_volume
from conoid.worker.parallel.comm import SerialComm

from .table import Cell, table

SWEEPS = (5, 10, 20, 40, 80)
GLASS = {
    "density": 2500, "elastic": {"young": 72e9, "poisson": 0.22},
    "brittle": {"strength": 60e6, "energy": 7, "scatter": {"modulus": 6, "seed": 3}},
}  # fmt: skip


@dataclass(frozen=True)
class Ram:
    """Properties of the ram."""

    name: str
    length: float
    """Length of the ram, mm."""
    speed: float
    """Speed of the ram, m/s."""
    end: float
    """End time of the run, s."""
    driven: bool
    """True if the speed of the ram is prescribed."""
    fine: float = 1.0
    """Element size of all parts, relative to the default."""


DRIVEN = Ram("driven", 1.5, 60.0, 16e-6, driven=True)
FLYING = Ram("flying", 5.0, 200.0, 10e-6, driven=False)
FINE = Ram("flying, half the size of tets", 5.0, 200.0, 10e-6, driven=False, fine=0.5)


@dataclass(frozen=True)
class Pressed:
    """Result of a run."""

    work: float
    """Work of the ram, J: the sum of its loss of kinetic energy and the external work on the ram."""
    speed: float
    """Final speed of the ram towards the glass, m/s."""
    overlapping: int
    """Number of surface tets with more than a tenth of their volume inside other bodies."""
    overlap: float
    """Penetrated volume over the volume of all tets."""
    cpu: float
    """CPU time of the run, s."""


def _round(name: str, low: float, length: float, size: float, **radii: float) -> dict[str, Any]:
    """Returns the mesh of a quarter of a cylinder or, with an inner radius, of a tube; lengths in mm."""
    shape = {"shape": "tube" if "inner_radius" in radii else "cylinder", "axis": "z", "sector": "quarter"}
    sizes = {"length": length, "element_size": size, **radii}
    mesh = {**shape, "base": [0.0, 0.0, 1e-3 * low], **{key: 1e-3 * value for key, value in sizes.items()}}
    return {"name": name, "material": "steel", "mesh": mesh}


def press(sweeps: int | None = None, ram: Ram = DRIVEN) -> Case:
    """Returns the case; if ``sweeps`` is missing the case has the default number of sweeps."""
    size = 0.8 * ram.fine
    plug, rod = _round("plug", 0.0, 4.0, size, radius=3.0), _round("ram", 4.0, ram.length, size, radius=2.95)
    fracture = {"model": "cohesive", "delay": 0, "traction": "nodes", "friction": 0.3}
    held, down = {"x": 0.0, "y": 0.0, "z": 0.0}, {"x": 0.0, "y": 0.0, "z": -ram.speed}
    drive = {"kind": "velocity", "parts": ["ram"], **down, "course": [[0.0, 0.0], [2e-6, 1.0]]}
    return parse_case(
        {
            "name": "press", "materials": {"glass": GLASS}, "run": {"end_time": ram.end, "frames": 0},
            "parts": [
                {**plug, "material": "glass", "fracture": fracture},
                _round("die", -2.0, 2.0, size, inner_radius=1.5, radius=4.0),
                _round("bore", 0.0, 6.0, 0.9 * ram.fine, inner_radius=3.2, radius=4.2),
                {**rod, "velocity": [0.0, 0.0, 0.0 if ram.driven else -ram.speed]},
            ],
            "boundaries": [
                {"kind": "velocity", "parts": ["die", "bore"], **held},
                *([drive] if ram.driven else []),
                *({"kind": "symmetry", "axis": axis, "at": 0.0} for axis in "xy"),
            ],
            "contact": {"friction": 0.15, **({} if sweeps is None else {"sweeps": sweeps})},
        }
    )  # fmt: skip


def measure(case: Case) -> Pressed:
    """Runs the case of a ram."""
    began, sim = time.process_time(), simulation.build(case, Path(), SerialComm())
    ram = np.flatnonzero(sim.model.nodes.part == [part.name for part in case.parts].index("ram"))
    mass, start = sim.model.nodes.mass[ram], sim.model.nodes.v[ram]
    step.prepare(sim)
    while True:
        before = sim.model.nodes.v.copy()
        step.first_half(sim)
        if sim.clock.done:
            break
        step.second_half(sim)
    assert sim.record is not None
    assert sim.contact is not None
    cpu = time.process_time() - began
    sim.record.update()
    common = common_volume.measure(sim.contact, sim.model, sim.record.labels, sim.comm)
    lost = 0.5 * float(mass @ (start**2 - before[ram] ** 2).sum(axis=1))
    speed = -float(mass @ before[ram, 2]) / float(mass.sum())
    return Pressed(sim.ledger.close(before).external + lost, speed, common.large, common.share, cpu)


def main(arguments: Sequence[str]) -> None:
    """Prints the tables; the last row has the default number of sweeps."""
    head = ["sweeps", "work of the ram, J", "its speed, m/s", "tets in others", "overlap", "CPU s"]
    for ram in (DRIVEN, FLYING, FINE):
        rows: list[list[Cell]] = []
        for sweeps in (*map(int, arguments or map(str, SWEEPS)), None):
            got = measure(press(sweeps, ram))
            numbers = round(got.work, 2), round(got.speed, 1), got.overlapping, got.overlap, round(got.cpu, 1)
            rows.append(["default" if sweeps is None else sweeps, *numbers])
        print(f"{ram.name}\n\n{table(head, rows)}\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
