"""Walls and planes of symmetry within the sweeps: contact knows that what they hold gives no way."""

import numpy as np
import pytest

from conoid.worker.contact.stops import Stops

from ..worker.meshes import Floats
from .kernels import Solver, column


def wall(normal: Floats, side: float = 1.0, at: float = 0.0, friction: float = 0.0) -> Stops:
    """Of the first node alone."""
    unit = np.array([normal]) / np.linalg.norm(normal)
    return Stops(np.array([[at, 0.0, 0.0]]), unit, np.array([[side, 0.0]]), np.array([friction]))


def pressed(stops: Stops, speed: float = 1.0, n: int = 3, mobility: Floats | None = None) -> Solver:
    """A row of nodes in touch along x, of which the last one runs towards the first, and that one at the wall."""
    v = np.zeros((n, 3))
    v[-1, 0] = -speed
    solver = Solver(column(n), v, np.ones((n, 3)) if mobility is None else mobility, stops=stops)
    solver.step(60)
    return solver


@pytest.mark.parametrize("stops", [wall(np.array([2.0, 0.0, 0.0])), wall(np.array([-1.0, 0.0, 0.0]), side=-1.0)])
def test_what_is_pressed_on_a_wall_has_no_way_to_give(stops: Stops) -> None:
    """The impulse of the last goes through all of them into the wall, which is yet to give it back to the first."""
    v = pressed(stops).v
    assert v[:, 0] == pytest.approx([-1.0, 0.0, 0.0], abs=5e-3)
    assert (v[:, 1:] == 0.0).all()


def test_without_a_wall_they_share_the_impulse() -> None:
    nothing = wall(np.array([1.0, 0.0, 0.0]), side=0.0)
    assert pressed(nothing).v[:, 0] == pytest.approx([-1 / 3] * 3, abs=1e-4)


def test_a_wall_does_not_pull() -> None:
    """What leaves it, or is as far from it as it goes in the step, is let alone."""
    assert pressed(wall(np.array([1.0, 0.0, 0.0])), speed=-1.0).v[:, 0].tolist() == [0.0, 0.0, 1.0]
    away = wall(np.array([1.0, 0.0, 0.0]), at=-0.2)
    assert pressed(away, speed=0.3).v[:, 0] == pytest.approx([-0.1] * 3, abs=1e-4)


def test_a_slanted_wall_stops_along_what_is_free() -> None:
    """A node that a plane of symmetry holds along y is pushed along x alone: it stops there."""
    mobility = np.ones((3, 3))
    mobility[0, 1] = 0.0
    v = pressed(wall(np.array([1.0, 1.0, 0.0])), mobility=mobility).v
    assert v[:, 0] == pytest.approx([-1.0, 0.0, 0.0], abs=5e-3)


def test_a_stop_that_pushed_too_much_takes_it_back() -> None:
    """The first node flies at the wall, and a contact takes it away again, faster than the wall has to stop it."""
    v = np.array([[-1.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    solver = Solver(column(2), v, np.ones((2, 3)), stops=wall(np.array([1.0, 0.0, 0.0])))
    solver.step(60)
    assert solver.v[:, 0].tolist() == [-1.0, 3.0], "they part: only the wall is concerned"
    met = column(2)
    met.normals[0] = [-1.0, 0.0, 0.0]
    solver = Solver(met, v, np.ones((2, 3)), stops=wall(np.array([1.0, 0.0, 0.0])))
    solver.step(60)
    assert solver.v[:, 0] == pytest.approx([1.0, 1.0], abs=1e-4), "they have their common speed, as without a wall"


@pytest.mark.parametrize(("friction", "left"), [(0.0, 0.5), (0.2, 0.3), (0.6, 0.0)])
def test_friction_at_a_wall_takes_what_its_push_allows(friction: float, left: float) -> None:
    """Of a node that another presses at the wall, both with 0.5 m/s along it; what the wall has given is taken off."""
    v = np.array([[0.0, 0.5, 0.0], [-1.0, 0.5, 0.0]])
    solver = Solver(column(2), v, np.ones((2, 3)), stops=wall(np.array([1.0, 0.0, 0.0]), friction=friction))
    solver.active.sweep(60)
    along = solver.active.velocities[:, 1]
    assert along == pytest.approx([left, 0.5], abs=5e-3)
    assert solver.step(60)[:, 1] == pytest.approx([0.5, 0.5], rel=1e-12)
