"""Walls push and never pull, symmetry planes hold, prescribed motion is exact; what they do is booked."""

import math
from typing import Any

import numpy as np
import pytest

from conoid.worker import step
from conoid.worker.simulation import Simulation
from conoid.worker.state import WORK

from .kernels import COPPER, STEEL, around, build, run, scene
from .meshes import Floats, block

MESH = block((3, 3, 3), 1e-3, seed=2)
TILTED = (1.0, -2.0, 3.0)


def with_boundary(spec: dict[str, Any], end: float = 1e-6, **keys: Any) -> Simulation:
    return build(scene(keys.pop("material", STEEL), end=end, boundaries=(spec,), **keys), [MESH])


def wall(gap: float, normal: tuple[float, float, float] = TILTED) -> dict[str, Any]:
    """A wall across ``normal`` at a distance of ``gap`` before the body's first node."""
    n = np.array(normal) / np.linalg.norm(normal)
    first = (MESH.points @ n).min()
    return {"kind": "wall", "point": tuple((n * (first - gap)).tolist()), "normal": normal}


def heights(sim: Simulation, gap: float) -> Floats:
    """(nodes,) distances from the tilted wall, m."""
    n = np.array(TILTED) / np.linalg.norm(TILTED)
    return np.asarray(sim.model.nodes.x @ n - (MESH.points @ n).min() + gap)


@pytest.mark.parametrize("gap", [0.0, 3e-5])
def test_no_node_ends_behind_the_wall(gap: float) -> None:
    n = np.array(TILTED) / np.linalg.norm(TILTED)
    sim = with_boundary(wall(gap), end=2e-6, velocity=tuple((-150.0 * n).tolist()), material=COPPER)
    lowest: list[float] = []
    run(sim, lambda sim, _: lowest.append(float(heights(sim, gap).min())))
    assert min(lowest) > -1e-15
    assert min(lowest) < 1e-9


def test_the_wall_pushes_only() -> None:
    """Each impulse is along the normal and outward; where no node would pass, velocities keep every bit."""
    n = np.array(TILTED) / np.linalg.norm(TILTED)
    sim = with_boundary(wall(1e-5), velocity=tuple((-100.0 * n).tolist()))
    pushes = []

    def look(before: Floats, after: Floats) -> None:
        along = (after - before) @ n
        assert np.abs(after - before - along[:, None] * n).max() < 1e-12
        assert (along >= 0.0).all()
        assert not along[heights(sim, 1e-5) + sim.clock.dt * (before @ n) >= 0.0].any()
        pushes.append((along > 0.0).sum())

    around(sim.boundaries[0], look)
    run(sim)
    assert sum(pushes) > 20


def test_impulses_of_the_wall_are_booked() -> None:
    """A cube flies into a wall: the books show impulse times mean velocity, summed over steps and nodes."""
    sim = with_boundary(wall(2e-6, (0.0, 0.0, 1.0)), end=3e-7, velocity=(0.0, 0.0, -100.0))
    impulses: list[Floats] = []
    lost: list[float] = []
    mass = sim.model.nodes.mass[:, None]
    around(sim.boundaries[0], lambda before, after: impulses.append(mass * (after - before)))
    run(sim, lambda sim, before: lost.append(-float((0.5 * impulses[-1] * (before + sim.model.nodes.v)).sum())))
    assert sum(lost) > 0.0
    assert math.isclose(float(sim.boundaries[0].contact_loss.sum()), sum(lost), rel_tol=1e-12)
    assert 1e-8 < sim.boundaries[0].last_push < 3e-7


def test_a_body_at_rest_on_a_wall_stays_there() -> None:
    sim = with_boundary(wall(0.0, (0.0, 0.0, 1.0)))
    run(sim)
    assert not sim.model.nodes.v.any()
    assert (sim.model.nodes.x == MESH.points).all()
    assert sim.boundaries[0].contact_loss.sum() == 0.0


@pytest.mark.parametrize(("axis", "at"), [("x", 0.0), ("y", 3e-3), ("z", 0.0)])
def test_nodes_on_a_symmetry_plane_stay_on_it(axis: str, at: float) -> None:
    k = "xyz".index(axis)
    sim = with_boundary({"kind": "symmetry", "axis": axis, "at": at}, velocity=(30.0, -20.0, 10.0))
    sim.model.nodes.v += np.random.default_rng(3).normal(size=sim.model.nodes.v.shape)
    sim.boundaries[0].start(sim.model.nodes)
    on = np.abs(MESH.points[:, k] - at) < 1e-12
    assert sim.boundaries[0].nodes.tolist() == np.flatnonzero(on).tolist()
    run(sim)
    assert (sim.model.nodes.x[on, k] == MESH.points[on, k]).all()
    assert np.abs(sim.model.nodes.x[on] - MESH.points[on]).max() > 1e-6
    assert sim.boundaries[0].contact_loss.sum() == sim.boundaries[0].external_work.sum() == 0.0


def test_prescribed_velocity_and_its_work() -> None:
    """One end of a block is pulled: given components are met to the bit, others are free, the work becomes energy."""
    spec = {"kind": "velocity", "low": (0.0, 0.0, 2.9e-3), "high": (1.0, 1.0, 1.0), "z": 20.0}
    sim = with_boundary(spec, end=1e-5)
    top = MESH.points[:, 2] > 2.9e-3
    assert sim.boundaries[0].nodes.tolist() == np.flatnonzero(top).tolist()
    run(sim)
    nodes = sim.model.nodes
    assert (nodes.v[top, 2] == 20.0).all()
    assert nodes.v[top, 0].any()
    assert np.abs(nodes.x[top, 2] - MESH.points[top, 2] - 20.0 * 1e-5).max() < 1e-16
    kinetic = 0.5 * float((nodes.mass[:, None] * nodes.v**2).sum())
    moved = kinetic + float(sim.model.blocks[0].row(WORK).sum()) - sim.ledger.initial
    assert float(sim.boundaries[0].external_work.sum()) == pytest.approx(moved, rel=0.06)


def test_prescribed_rotation_is_exact() -> None:
    """After any number of steps of any size every node is where the rotation puts it."""
    rate, centre = np.array([2e5, -1e5, 3e5]), np.array([1e-3, 0.0, 2e-3])
    spec = {"kind": "rotation", "spin": {"centre": tuple(centre.tolist()), "rate": tuple(rate.tolist())}}
    sim = with_boundary(spec, end=1e-4)
    run(sim)
    speed = float(np.linalg.norm(rate))
    axis, angle = rate / speed, speed * 1e-4
    r = MESH.points - centre
    turned = r * np.cos(angle) + np.cross(axis, r) * np.sin(angle) + axis * (r @ axis)[:, None] * (1.0 - np.cos(angle))
    assert sim.clock.step > 300
    assert np.abs(sim.model.nodes.x - centre - turned).max() < 1e-12 * 3e-3 * sim.clock.step


def test_the_last_boundary_has_the_last_word() -> None:
    """A node that a wall would push and a motion is prescribed for moves as prescribed."""
    push = wall(0.0, (0.0, 0.0, 1.0))
    pull = {"kind": "velocity", "z": -5.0}
    sim = build(scene(STEEL, end=1e-7, boundaries=(pull, push)), [MESH])
    step.prepare(sim)
    step.first_half(sim)
    assert (sim.model.nodes.v[:, 2] == -5.0).all()
