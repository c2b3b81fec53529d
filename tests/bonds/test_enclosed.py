"""A core inside a jacket with common nodes has no exposed face until the jacket erodes."""

from pathlib import Path
from typing import Any

import numpy as np

from conoid.cases.load import parse_case
from conoid.worker import simulation
from conoid.worker.parallel.comm import SerialComm

from .scenes import run

SOFT = {"density": 7850.0, "elastic": {"young": 200e9, "poisson": 0.3},
        "strength": {"model": "linear_hardening", "yield_stress": 1e8}}  # fmt: skip


def cube(half: float) -> dict[str, Any]:
    return {"shape": "box", "low": [-half] * 3, "high": [half] * 3}


def test_a_core_gets_into_contact_when_its_jacket_has_eroded() -> None:
    """Contact keeps the core above the plate, although the core has no exposed face at the start."""
    size = 1e-3
    core, jacket = {**cube(1e-3), "element_size": size}, {"of": [cube(1.5e-3), cube(1e-3)], "element_size": size}
    plate = {"shape": "box", "low": [-3e-3, -3e-3, -2.5e-3], "high": [3e-3, 3e-3, -1.5e-3], "element_size": size}
    speed: dict[str, Any] = {"velocity": [0.0, 0.0, -400.0]}
    parts = [
        {"name": "core", "material": "steel_4340", "mesh": core, **speed},
        {
            "name": "jacket",
            "material": "soft",
            "mesh": {"shape": "difference", **jacket},
            "erosion": {"plastic_strain": 0.2},
            **speed,
        },
        {"name": "plate", "material": "steel_4340", "mesh": plate, "rigid": True},
    ]
    held = [{"kind": "velocity", "parts": ["plate"], "x": 0.0, "y": 0.0, "z": 0.0}]
    sim = simulation.build(
        parse_case({"name": "enclosed", "run": {"end_time": 4e-6, "frames": 0}, "materials": {"soft": SOFT},
                    "boundaries": held, "parts": parts, "bond": [{"parts": ["core", "jacket"], "kind": "shared"}]}),
        Path(), SerialComm(),
    )  # fmt: skip
    assert sim.contact is not None
    assert sim.contact.exterior.surface.flags[sim.model.nodes.in_part(0)].sum() == 0
    before = sim.model.elements_global
    energy = run(sim)
    nodes, faces = sim.model.nodes, sim.contact.exterior.surface.faces.nodes[:, 0]
    assert sim.model.elements_global < before, "the jacket has eroded"
    assert (nodes.part[np.searchsorted(nodes.id, faces)] == 0).any(), "the core has exposed faces"
    assert nodes.x[nodes.in_part(0), 2].min() > -1.6e-3
    assert abs(energy.residual) < 1e-3
