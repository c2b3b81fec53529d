"""A node without tets that passes a plane of symmetry is replaced by its mirror image: the replacement is compared with
plain numpy, and tested in a scene."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from conoid.cases.model import schema
from conoid.worker import step
from conoid.worker.accounts import digest
from conoid.worker.boundaries.mirrors import Mirrors
from conoid.worker.mesh.model import TetMesh
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved
from .kernels import build
from .meshes import Floats, block
from .simulations import kept_again, on, tick

MM = 1e-3
EROSION = schema.Erosion(nodes="particles")
PLANES: tuple[Any, ...] = ({"kind": "symmetry", "axis": "x"}, {"kind": "symmetry", "axis": "y"})


def flight(x: Floats, v: Floats, axes: list[int], at: list[float], sides: Floats, steps: int, dt: float) -> Any:
    """Returns nodes without tets in free flight beside planes: the state after some steps, and the boundary."""
    n = len(x)
    state: Any = SimpleNamespace(x=x.copy(), v=v.copy(), mass=1.0 + np.arange(n))
    mirrors = Mirrors(np.arange(n, dtype=np.int32), np.array(axes), np.array(at), sides)
    mirrors.release(np.ones(n, bool), [mirrors])
    for _ in range(steps):
        mirrors.note(state)
        mirrors.apply(state, dt, 0.0)
        state.x += dt * state.v
        mirrors.after_move(state)
    mirrors.note(state)
    return state, mirrors


def folded(x: Floats, low: float, high: float) -> Floats:
    """Returns the position between two mirrors of a point that would be at ``x`` without mirrors."""
    length = high - low
    within = np.mod(x - low, 2.0 * length)
    return np.asarray(low + np.where(within > length, 2.0 * length - within, within))


def test_at_one_plane_the_image_comes_in() -> None:
    """Positions and speeds are those of free flight and its mirror image. No energy is lost, and the plane takes twice
    the normal momentum of the node."""
    random = np.random.default_rng(1)
    x, v = random.uniform(0.0, 1.0, (40, 3)), random.uniform(-1.0, 1.0, (40, 3))
    x[:, 1] += 2.0
    state, mirrors = flight(x, v, [1], [2.0], np.ones((40, 1)), 9, 0.2)
    far = x + 9 * 0.2 * v
    passed = far[:, 1] < 2.0
    assert 5 < passed.sum() < 35
    far[:, 1] = np.where(passed, 4.0 - far[:, 1], far[:, 1])
    assert state.x == pytest.approx(far, abs=1e-14)
    assert np.array_equal(np.abs(state.v), np.abs(v))
    assert np.array_equal(state.v[:, 1] != v[:, 1], passed)
    assert np.array_equal(state.v[:, [0, 2]], v[:, [0, 2]])
    assert np.abs(mirrors.contact_loss).max() < 1e-14


def test_on_the_axis_both_components_turn_round() -> None:
    """The nodes of the test are a node on the axis, a node that arrives at the axis obliquely, and a node that starts
    on a plane and stays in this plane."""
    x = np.array([[0.0, 0.0, 0.0], [0.3, 0.1, 0.0], [0.0, 0.5, 0.0]])
    v = np.array([[0.0, 0.0, 1.0], [-1.0, -1.0, 1.0], [0.0, -1.0, 1.0]])
    state, _ = flight(x, v, [0, 1], [0.0, 0.0], np.ones((3, 2)), 8, 0.1)
    assert state.x == pytest.approx(np.array([[0.0, 0.0, 0.8], [0.5, 0.7, 0.8], [0.0, 0.3, 0.8]]), abs=1e-14)
    assert state.v.tolist() == [[0.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]


@pytest.mark.parametrize("speed", [0.3, 7.0, 40.0])
def test_between_two_planes_a_body_has_an_image_behind_each(speed: float) -> None:
    """The mirror images are also right for a node that passes several widths of the column in a step."""
    x, v = np.linspace(-0.4, 0.6, 11)[:, None] * [1.0, 0.0, 0.0], np.tile([speed, 0.0, 2.0], (11, 1))
    sides = np.tile([1.0, -1.0], (11, 1))
    state, mirrors = flight(x, v, [0, 0], [-0.5, 0.7], sides, 13, 0.1)
    assert state.x[:, 0] == pytest.approx(folded(x[:, 0] + 1.3 * speed, -0.5, 0.7), abs=1e-12)
    assert np.array_equal(np.abs(state.v), np.abs(v))
    assert np.abs(mirrors.contact_loss).max() < 1e-12


def test_nodes_with_tets_are_stopped_beside_nodes_without() -> None:
    state: Any = SimpleNamespace(x=np.full((2, 3), 0.1), v=np.full((2, 3), -1.0), mass=np.ones(2))
    mirrors = Mirrors(np.arange(2, dtype=np.int32), np.array([2]), np.zeros(1), np.ones((2, 1)))
    mirrors.release(np.array([False, True]), [mirrors])
    mirrors.note(state)
    mirrors.apply(state, 1.0, 0.0)
    assert state.v[:, 2] == pytest.approx([-0.1, 1.0], rel=1e-12)
    assert mirrors.contact_loss[0] > 0.0


# Reflection in a scene


def corner(velocity: tuple[float, float, float], at: float = 0.0) -> tuple[schema.Case, list[TetMesh]]:
    """Returns an eroding cube in the corner of two planes of symmetry at ``at``, above an eroding block."""
    planes = tuple({**plane, "at": at} for plane in PLANES)
    case = meeting_of([{"velocity": velocity, "erosion": EROSION}, {"erosion": EROSION}], boundaries=planes)
    cube, ground = block((3, 3, 3), MM, shake=0.0), block((3, 3, 2), MM, shake=0.0)
    return case, [moved(cube, (at, at, 2.02 * MM)), moved(ground, (at, at, 0.0))]


def flown(sim: Simulation, until: float, limit: float = 1e-10) -> Simulation:
    """Runs a scene in which all tets of the cube are removed in the first step; the residuals must be below
    ``limit``."""
    step.prepare(sim)
    tick(sim, sim.model.blocks[0].id.copy())
    while sim.clock.t < until:
        assert tick(sim) < limit
    return sim


@pytest.mark.parametrize("at", [0.0, 7 * MM])
def test_debris_keeps_its_energy_at_planes(at: float) -> None:
    """Debris that moves upwards and into the corner leaves the corner with the same speed. Nodes that start on a plane
    are free after the removal of their tets."""
    case, meshes = corner((-2000.0, -1500.0, 500.0), at)
    sim = build(case, meshes)
    nodes = sim.model.nodes
    mine = nodes.part == 0
    inner = mine & (nodes.x0[:, :2] > at + 0.5 * MM).all(axis=1)
    flown(sim, 6e-6)
    assert (nodes.x[mine, :2] >= at - 1e-15).all()
    expected = np.abs(nodes.x0[inner] - [at, at, 0.0] + sim.clock.t * np.array([-2000.0, -1500.0, 500.0]))
    assert nodes.x[inner] - [at, at, 0.0] == pytest.approx(expected, abs=2e-5 * MM)
    assert nodes.v[inner] == pytest.approx(np.tile([2000.0, 1500.0, 500.0], (inner.sum(), 1)), rel=1e-5)
    loss = sum(bound.contact_loss.sum() for bound in sim.boundaries if isinstance(bound, Mirrors))
    assert abs(loss) < 1e-9 * sim.ledger.initial
    held = [bound for bound in sim.boundaries if bound.mirrors]
    assert not any(mine[bound.nodes].any() for bound in held), "the planes hold nodes with tets alone"


def test_a_node_that_starts_on_the_axis_may_leave_it() -> None:
    """Debris on the axis that falls on a slope is pushed to the side: the plane does not hold a node without tets."""
    case, meshes = corner((0.0, 0.0, -800.0))
    points = meshes[1].points
    points[:, 2] *= 1.0 - 0.2 * points[:, 0] / MM  # the slope descends from the plane x = 0
    sim = build(case, [meshes[0], TetMesh(points, meshes[1].tets)])
    nodes = sim.model.nodes
    axis = np.flatnonzero((nodes.part == 0) & (np.abs(nodes.x0[:, :2]).max(axis=1) == 0.0))
    assert len(axis) == 4
    flown(sim, 3e-6, 1e-3)
    assert nodes.v[axis, 0].max() > 100.0
    assert nodes.x[axis, 0].max() > 0.1 * MM
    assert (nodes.x[axis, :2] >= -1e-15).all()


@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_reflected_debris_is_the_same_on_any_number_of_ranks_and_after_a_restart(ranks: int, tmp_path: Path) -> None:
    case, meshes = corner((-1200.0, -900.0, -800.0))
    tets = len(meshes[0].tets)

    def work(sim: Simulation, again: bool) -> str | None:
        step.prepare(sim)
        for k in range(40):
            tick(sim, np.arange(k, tets, 4) if k < 4 else None)
            if again and k in (2, 5, 17):
                sim = kept_again(sim, case, tmp_path)
        sim.free()
        return digest.digest(sim.model, sim.comm, [])

    one = on(1, case, meshes, lambda sim: work(sim, False))[0]
    assert on(ranks, case, meshes, lambda sim: work(sim, True))[0] == one
