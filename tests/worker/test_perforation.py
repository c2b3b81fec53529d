"""A rod perforates a plate at three speeds: the residual velocity and the mass of the probes are compared with the
nodes behind the plate."""

from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import apply_overrides, parse_case
from conoid.worker import simulation
from conoid.worker.parallel.comm import SerialComm

from .kernels import run

CASE = {
    "name": "perforation", "run": {"end_time": 1.2e-5, "frames": 0}, "numerics": {"pressure": "standard"},
    "boundaries": [{"kind": "symmetry", "axis": axis} for axis in "xy"],
    "parts": [
        {"name": "rod", "material": "copper_ofhc", "velocity": [0, 0, 900], "erosion": {"plastic_strain": 1.5},
         "mesh": {"shape": "box", "low": [0, 0, -4.01e-3], "high": [1e-3, 1e-3, -1e-5], "element_size": 5e-4,
                  "generator": "structured"}},
        {"name": "plate", "material": "copper_ofhc", "erosion": {"plastic_strain": 0.5},
         "mesh": {"shape": "box", "low": [0, 0, 0], "high": [4e-3, 4e-3, 1e-3], "element_size": 5e-4,
                  "generator": "structured"}},
    ],
    "probes": [
        {"name": "v", "part": "rod", "field": "residual_velocity", "beyond": {"axis": "z", "at": 1.5e-3}},
        {"name": "m", "part": "rod", "field": "residual_mass", "beyond": {"axis": "z", "at": 1.5e-3}},
    ],
}  # fmt: skip


def residual(speed: float) -> tuple[float, float]:
    sim = simulation.build(parse_case(apply_overrides(CASE, {"parts[0].velocity[2]": speed})), Path(), SerialComm())
    run(sim)
    velocity, mass = sim.probes.measure()
    nodes, erosion = sim.model.nodes, sim.erosion
    assert erosion is not None
    behind = (nodes.part == 0) & ~erosion.removed & (nodes.x[:, 2] > 1.5e-3)
    m = nodes.mass[behind]
    assert mass == pytest.approx(m.sum(), rel=1e-12)
    expected = float((m * nodes.v[behind, 2]).sum() / m.sum()) if len(m) else 0.0
    assert velocity == pytest.approx(expected, rel=1e-12)
    return float(velocity), float(mass)


def test_a_faster_rod_leaves_the_plate_faster() -> None:
    found = np.array([residual(speed) for speed in (50.0, 700.0, 1200.0)])
    assert found[0].tolist() == [0.0, 0.0]
    assert 0.0 < found[1, 0] < found[2, 0] < 1200.0
    assert (found[1:, 1] > 0.0).all()
