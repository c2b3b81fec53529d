"""Walls and planes of symmetry within the sweeps: nodes at a wall or plane do not move into it."""

import numpy as np
import pytest

from conoid.cases.model import schema
from conoid.worker.contact.solver.stops import Stops
from conoid.worker.mesh.model import TetMesh

from ..worker.meshes import Floats, block
from .bodies import meeting_of, moved, pieces_of
from .kernels import Solver, column
from .ranks import on_ranks

CUBE = block((1, 1, 1), 1.0)


def wall(normal: Floats, side: float = 1.0, at: float = 0.0, friction: float = 0.0) -> Stops:
    """Returns a wall that acts only on the first node."""
    unit = np.array([normal]) / np.linalg.norm(normal)
    return Stops(np.array([[at, 0.0, 0.0]]), unit, np.array([[side, 0.0]]), np.array([friction]), np.zeros(1, bool))


def pressed(stops: Stops, speed: float = 1.0, n: int = 3, mobility: Floats | None = None) -> Solver:
    """Returns a row of touching nodes along x; the last node moves towards the first node, which is at the wall."""
    v = np.zeros((n, 3))
    v[-1, 0] = -speed
    solver = Solver(column(n), v, np.ones((n, 3)) if mobility is None else mobility, stops=stops)
    solver.step(60)
    return solver


@pytest.mark.parametrize("stops", [wall(np.array([2.0, 0.0, 0.0])), wall(np.array([-1.0, 0.0, 0.0]), side=-1.0)])
def test_a_node_between_a_wall_and_a_body_does_not_yield(stops: Stops) -> None:
    """The impulse of the last node passes through all nodes to the wall; the wall returns the impulse to the first node
    afterwards.
    """
    v = pressed(stops).v
    assert v[:, 0] == pytest.approx([-1.0, 0.0, 0.0], abs=5e-3)
    assert (v[:, 1:] == 0.0).all()


def test_without_a_wall_they_share_the_impulse() -> None:
    nothing = wall(np.array([1.0, 0.0, 0.0]), side=0.0)
    assert pressed(nothing).v[:, 0] == pytest.approx([-1 / 3] * 3, abs=1e-4)


def test_a_wall_does_not_pull() -> None:
    """The wall does not change a node that moves away from it, or that is farther from the wall than its motion in the
    step.
    """
    assert pressed(wall(np.array([1.0, 0.0, 0.0])), speed=-1.0).v[:, 0].tolist() == [0.0, 0.0, 1.0]
    away = wall(np.array([1.0, 0.0, 0.0]), at=-0.2)
    assert pressed(away, speed=0.3).v[:, 0] == pytest.approx([-0.1] * 3, abs=1e-4)


def test_a_slanted_wall_stops_along_what_is_free() -> None:
    """A plane of symmetry holds the node along y, so that the wall stops the node by an impulse along x only."""
    mobility = np.ones((3, 3))
    mobility[0, 1] = 0.0
    v = pressed(wall(np.array([1.0, 1.0, 0.0])), mobility=mobility).v
    assert v[:, 0] == pytest.approx([-1.0, 0.0, 0.0], abs=5e-3)


def test_a_stop_reduces_an_impulse_that_was_too_large() -> None:
    """The first node moves to the wall, and a contact moves the node away again, faster than the wall has to stop
    it.
    """
    v = np.array([[-1.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    solver = Solver(column(2), v, np.ones((2, 3)), stops=wall(np.array([1.0, 0.0, 0.0])))
    solver.step(60)
    assert solver.v[:, 0].tolist() == [-1.0, 3.0], "they part: only the wall is concerned"
    met = column(2)
    met.normals[0] = [-1.0, 0.0, 0.0]
    solver = Solver(met, v, np.ones((2, 3)), stops=wall(np.array([1.0, 0.0, 0.0])))
    solver.step(60)
    assert solver.v[:, 0] == pytest.approx([1.0, 1.0], abs=1e-4), "they have their common speed, as without a wall"


@pytest.mark.parametrize(("friction", "left"), [(0.0, 0.5), (0.2, 0.4), (0.6, 0.2), (2.0, 0.0)])
def test_friction_at_a_wall_takes_what_its_push_allows(friction: float, left: float) -> None:
    """A second node presses the first node on the wall; both nodes move at 0.5 m/s along the wall. The second node
    sticks to the first node, so that the velocity of the second node shows the friction.
    """
    v = np.array([[0.0, 0.5, 0.0], [-1.0, 0.5, 0.0]])
    met = column(2)._replace(friction=np.full(1, 10.0))
    solver = Solver(met, v, np.ones((2, 3)), stops=wall(np.array([1.0, 0.0, 0.0]), friction=friction))
    assert solver.step(200)[1] == pytest.approx([0.0, left, 0.0], abs=5e-3)


def test_walls_and_planes_hold_the_parts_that_they_name_on_their_side() -> None:
    """The scene has bodies above and below a plane, and a body of two pieces on both sides of the plane, on which only
    the boundary acts.
    """
    both = TetMesh(
        np.concatenate([CUBE.points, CUBE.points - [0.0, 0.0, 3.0]]),
        np.concatenate([CUBE.tets, CUBE.tets + len(CUBE.points)]),
    )
    boundaries = (
        schema.Wall(kind="wall", point=(0.0, 0.0, -9.0), normal=(0.0, 3.0, 4.0), parts=("body1",), friction=0.3),
        schema.Symmetry(kind="symmetry", axis="z", at=-1.0),
    )
    case = meeting_of([{}, {}, {}]).model_copy(update={"boundaries": boundaries})
    pieces = pieces_of(case, [CUBE, moved(CUBE, (3.0, 0.0, -3.0)), moved(both, (6.0, 0.0, 0.0))], 2)
    for stops in on_ranks(2, lambda comm: Stops.of(case, pieces[comm.rank][1], comm)):
        assert stops.points.tolist() == [[0.0, 0.0, -9.0], [0.0, 0.0, -1.0]]
        assert stops.normals == pytest.approx(np.array([[0.0, 0.6, 0.8], [0.0, 0.0, 1.0]]))
        assert stops.sides.tolist() == [[0.0, 1.0, 0.0], [1.0, -1.0, 0.0]]
        assert stops.friction.tolist() == [0.3, 0.0]
        assert stops.mirrors.tolist() == [False, True]
