"""A rod perforates a plate at three speeds: the residual velocity and the mass of the probes are compared with the
nodes behind the plate."""

from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import apply_overrides, parse_case
from conoid.cases.warnings.unreached import Before, unreached
from conoid.worker import simulation
from conoid.worker.gauges.unreached import found as reported
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


def warned(speed: float, end: float) -> list[str]:
    case = parse_case(apply_overrides(CASE, {"parts[0].velocity[2]": speed, "run.end_time": end}))
    sim = simulation.build(case, Path(), SerialComm())
    run(sim)
    return list(reported(sim))


def test_a_run_that_ends_before_the_plane_is_passed_is_reported() -> None:
    """The value 0 then means neither a stopped rod nor a residual velocity. After the passage no warning is given."""
    (text,) = warned(700.0, 2e-6)
    assert text.startswith("probes[0], 'v': at the end 100 % of the mass of 'rod' has not reached the plane z = 1.5 mm")
    assert "increase run.end_time" in text
    assert warned(1200.0, 1.2e-5) == []


@pytest.mark.parametrize(
    ("share", "speed", "number"), [(1.0, 60.0, 1), (1.0, 40.0, 0), (1.0, -60.0, 0), (0.05, 500.0, 0)]
)
def test_a_stopped_part_and_debris_are_not_reported(share: float, speed: float, number: int) -> None:
    case = parse_case(apply_overrides(CASE, {"parts[0].velocity[2]": 1000.0}))
    assert len(list(unreached(case, {0: Before(share, speed)}))) == number
