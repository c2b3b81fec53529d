"""Rubble that is driven: how stiff is it, and with how many sweeps?

``python -m tests.bench.press [SWEEPS ...]``: a quarter of a glass cylinder in a bore of steel is pressed by a ram at 60
m/s through a hole of half its width. What it breaks into is held by contact alone, in chains from the ram to the walls,
for as long as the ram moves. The table is in docs/numerics.md, "Driven rubble".
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conoid.cases.load import parse_case
from conoid.cases.schema import Case
from conoid.worker import simulation, step
from conoid.worker.contact import common_volume
from conoid.worker.parallel.comm import SerialComm

from .table import table

SWEEPS = (5, 8, 16, 20, 32, 40, 60, 120)
GLASS = {
    "density": 2500, "elastic": {"young": 72e9, "poisson": 0.22},
    "brittle": {"strength": 60e6, "energy": 7, "scatter": {"modulus": 6, "seed": 3}},
}  # fmt: skip


@dataclass(frozen=True)
class Pressed:
    """What came out."""

    work: float
    """Of the ram, J."""
    overlapping: int
    """Tets at surfaces with more than a tenth of their volume in others."""
    overlap: float
    """Of the volume of all of them."""
    cpu: float
    """s."""


def _round(name: str, low: float, length: float, size: float, **radii: float) -> dict[str, Any]:
    """A quarter of a cylinder or, with an inner radius, of a tube; lengths in mm."""
    shape = {"shape": "tube" if "inner_radius" in radii else "cylinder", "axis": "z", "sector": "quarter"}
    sizes = {"length": length, "element_size": size, **radii}
    mesh = {**shape, "base": [0.0, 0.0, 1e-3 * low], **{key: 1e-3 * value for key, value in sizes.items()}}
    return {"name": name, "material": "steel", "mesh": mesh}


def press(sweeps: int | None = None) -> Case:
    """The scene to 16 us; without ``sweeps`` with those that it gets by default."""
    plug = _round("plug", 0.0, 4.0, 0.8, radius=3.0)
    fracture = {"model": "cohesive", "delay": 0, "traction": "nodes", "friction": 0.3}
    held, down = {"x": 0.0, "y": 0.0, "z": 0.0}, {"x": 0.0, "y": 0.0, "z": -60.0, "course": [[0.0, 0.0], [2e-6, 1.0]]}
    return parse_case(
        {
            "name": "press", "materials": {"glass": GLASS}, "run": {"end_time": 16e-6, "frames": 0},
            "parts": [
                {**plug, "material": "glass", "fracture": fracture},
                _round("die", -2.0, 2.0, 0.8, inner_radius=1.5, radius=4.0),
                _round("bore", 0.0, 6.0, 0.9, inner_radius=3.2, radius=4.2),
                _round("ram", 4.0, 1.5, 0.8, radius=2.95),
            ],
            "boundaries": [
                {"kind": "velocity", "parts": ["die", "bore"], **held},
                {"kind": "velocity", "parts": ["ram"], **down},
                *({"kind": "symmetry", "axis": axis, "at": 0.0} for axis in "xy"),
            ],
            "contact": {"friction": 0.15, **({} if sweeps is None else {"sweeps": sweeps})},
        }
    )  # fmt: skip


def measure(case: Case) -> Pressed:
    """Runs it."""
    began, sim = time.process_time(), simulation.build(case, Path(), SerialComm())
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
    sim.record.look()
    common = common_volume.measure(sim.contact, sim.model, sim.record.labels, sim.comm)
    return Pressed(sim.ledger.close(before).external, common.large, common.share, cpu)


def main(arguments: Sequence[str]) -> None:
    """Prints the table."""
    rows = [(sweeps, measure(press(sweeps))) for sweeps in map(int, arguments or map(str, SWEEPS))]
    head = ["sweeps", "work of the ram, J", "tets in others", "overlap", "CPU s"]
    print(table(head, [[n, round(got.work, 1), got.overlapping, got.overlap, round(got.cpu, 1)] for n, got in rows]))


if __name__ == "__main__":
    main(sys.argv[1:])
