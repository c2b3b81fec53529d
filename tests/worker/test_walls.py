"""Friction on rigid walls: Coulomb friction acts in every step; sliding blocks stop, or slide on steep slopes, and the
work is booked."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.cases.estimates.stages import stages
from conoid.cases.messages import Energy
from conoid.cases.model import schema
from conoid.worker import step
from conoid.worker.simulation import Simulation

from .kernels import STEEL, around, build, run, scene
from .meshes import Floats, block
from .simulations import kept_again, on

MESH = block((2, 2, 2), 1e-3, seed=2)
TILTED = np.array([1.0, -2.0, 3.0]) / np.sqrt(14.0)
FLOOR = float(MESH.points[:, 2].min())
WEIGHT = 1e5
"""Acceleration by weight towards the floor, m/s^2."""


def tilted(friction: float) -> dict[str, Any]:
    """Returns a wall 5 um in front of the body."""
    first = float((MESH.points @ TILTED).min())
    return {
        "kind": "wall",
        "point": (TILTED * (first - 5e-6)).tolist(),
        "normal": TILTED.tolist(),
        "friction": friction,
    }


def floor(friction: float) -> dict[str, Any]:
    """Returns a floor that the body touches."""
    return {"kind": "wall", "point": (0.0, 0.0, FLOOR), "normal": (0.0, 0.0, 1.0), "friction": friction}


def resting(friction: float, speed: float, slope: float, end: float) -> schema.Case:
    """Returns a damped block on a floor that slides along x with a ``speed``, accelerated along x by ``slope``; the
    weight of the block rises slowly.
    """
    down = {
        "kind": "gravity", "acceleration": (slope * WEIGHT, 0.0, -WEIGHT), "course": ((0.0, 0.0), (10e-6, 1.0)),
    }  # fmt: skip
    return scene(
        STEEL, end=end, boundaries=(floor(friction), down), viscosity={"linear": 1.0}, velocity=(speed, 0.0, 0.0)
    )


def mean_speed(sim: Simulation) -> float:
    """Returns the mean speed of the block along x, m/s."""
    nodes = sim.model.nodes
    return float((nodes.mass * nodes.v[:, 0]).sum() / nodes.mass.sum())


@pytest.mark.parametrize("friction", [0.0, 0.2, 5.0])
def test_a_push_takes_what_coulomb_allows_of_the_speed_along_the_wall(friction: float) -> None:
    sim = build(
        scene(STEEL, end=1e-6, boundaries=(tilted(friction),), velocity=tuple((-100.0 * TILTED).tolist()), jitter=40.0),
        [MESH],
    )
    stuck = slid = 0

    def look(before: Floats, after: Floats) -> None:
        nonlocal stuck, slid
        push = (after - before) @ TILTED
        old, new = (v - (v @ TILTED)[:, None] * TILTED for v in (before, after))
        size = np.linalg.norm(old, axis=1)
        taken = np.minimum(friction * push, size)
        assert new == pytest.approx((1.0 - taken / size)[:, None] * old, abs=1e-11)
        stuck += int(((taken == size) & (push > 0.0)).sum())
        slid += int(((taken < size) & (push > 0.0)).sum())

    around(sim.boundaries[0], look)
    energy = [sim.ledger.close(sim.model.nodes.v.copy())]
    run(sim, lambda sim, before: energy.append(sim.ledger.close(before)))
    assert (stuck > 10) == (friction > 1.0)
    assert (slid > 10) == (friction < 1.0)
    assert sim.ledger.worst < 1e-3
    assert (energy[-1].friction > 1e-3 * energy[0].initial) == (friction > 0.0)
    assert stages(sim.case)["friction"] == (friction > 0.0)


def test_a_sliding_body_comes_to_rest_and_friction_takes_its_energy() -> None:
    """The deceleration is friction times weight: the block stops after 33 us plus half of the 10 us in which the weight
    rises."""
    lines: list[Energy] = []
    speeds: list[tuple[float, float]] = []
    sim = build(resting(0.3, 1.0, 0.0, 50e-6), [MESH])

    def look(sim: Simulation, before: Floats) -> None:
        lines.append(sim.ledger.close(before))
        speeds.append((sim.clock.t, mean_speed(sim)))

    run(sim, look)
    for t, speed in speeds:
        if 12e-6 < t < 36e-6:
            assert speed == pytest.approx(1.0 - 0.3 * WEIGHT * (t - 5e-6), abs=0.02)
    assert abs(speeds[-1][1]) < 0.01
    assert lines[-1].friction == pytest.approx(lines[-1].initial, rel=0.02)
    assert sim.ledger.worst < 1e-3


@pytest.mark.parametrize(("slope", "slides"), [(0.4, False), (0.6, True)])
def test_a_block_on_a_slope_slides_where_that_is_steeper_than_friction_holds(slope: float, slides: bool) -> None:
    """With a friction coefficient of 0.5 a sliding block is accelerated by the rest of its weight along the slope."""
    sim = run(build(resting(0.5, 0.0, slope, 40e-6), [MESH]))
    gained = (slope - 0.5) * WEIGHT * 35e-6 if slides else 0.0
    assert mean_speed(sim) == pytest.approx(gained, abs=0.01)


@pytest.mark.parametrize("ranks", [1, 2])
def test_friction_on_a_wall_is_the_same_on_any_ranks_and_through_a_restart(ranks: int, tmp_path: Path) -> None:
    case = resting(0.3, 1.0, 0.2, 5e-6)

    def lines(sim: Simulation, again: bool) -> list[Energy]:
        found = []
        step.prepare(sim)
        for number in range(40):
            if again and number in (13, 14, 30):
                sim = kept_again(sim, case, tmp_path)
            before = sim.model.nodes.v.copy()
            step.first_half(sim)
            found.append(sim.ledger.close(before))
            step.second_half(sim)
        return found

    (whole,) = on(1, case, [MESH], lambda sim: lines(sim, False))
    assert whole[-1].friction > 0.0
    assert all(found == whole for found in on(ranks, case, ranks * [MESH], lambda sim: lines(sim, True)))
