"""Surfaces of rigid walls (planes, cylinders and spheres), and the motion of the walls."""

from typing import NamedTuple

import numpy as np

from conoid.cases.model.boundaries import Wall

from ..kernels.jit import njit, record, types
from ..model.state import Flags, Floats, Ints
from .course import Course

PLANE, CYLINDER, SPHERE = range(3)
KINDS = ("plane", "cylinder", "sphere")


class Shapes(NamedTuple):
    """Shapes of walls. Each wall is one row of the arrays."""

    kind: Ints
    """(w,) shape of each wall: PLANE, CYLINDER or SPHERE."""
    point: Floats
    """(w, 3) point of the plane or the axis, or the centre, m."""
    axis: Floats
    """(w, 3) unit normal of a plane, or unit vector along the axis of a cylinder."""
    radius: Floats
    """(w,) radius of each cylinder or sphere, m."""
    side: Floats
    """(w,) 1 if bodies are outside of a cylinder or sphere, -1 if they are inside."""


_F, _F1, _F2 = types.float64, types.float64[::1], types.float64[:, ::1]
SHAPES = record(Shapes, types.int64[::1], _F2, _F2, _F1, _F1)


class Walls:
    """Walls of a case with their motion. All ranks have equal values."""

    def __init__(self, specs: list[Wall], held: Flags | None = None) -> None:
        """``held`` (w, 3): components of the velocity that planes of symmetry hold, of the first walls; none without
        ``held``.
        """
        n = len(specs)
        self.held = np.zeros((n, 3), bool)
        """(w, 3) True for components of the velocity that planes of symmetry hold."""
        if held is not None:
            self.held[: len(held)] = held
        axis = np.array([each.normal or each.axis or (0.0, 0.0, 1.0) for each in specs]).reshape(n, 3)
        squares = axis * axis
        axis = axis / np.sqrt((squares[:, 0] + squares[:, 1]) + squares[:, 2])[:, None]
        self.shapes = Shapes(
            np.array([KINDS.index(each.shape) for each in specs], np.int64),
            np.array([each.point for each in specs]).reshape(n, 3), axis,
            np.array([each.radius or 0.0 for each in specs]),
            np.array([-1.0 if each.side == "inside" else 1.0 for each in specs]),
        )  # fmt: skip
        self.friction = np.array([each.friction for each in specs])
        self.given = np.array([each.velocity for each in specs]).reshape(n, 3)
        """(w, 3) velocity of each wall in the case, m/s. The given velocity is the velocity at the start, or it is
        multiplied by the factor of the wall's course."""
        self._courses = [Course(each.course) for each in specs]
        self.mass = np.array([each.mass or np.inf for each in specs])
        """(w,) mass of each wall, kg; infinite for a fixed or driven wall."""
        self.lightness = np.array([0.0 if each.mass is None else 1.0 / each.mass for each in specs])
        self.light = np.where(self.held, 0.0, self.lightness[:, None])
        """(w, 3) 1 / mass of each wall, 1/kg; 0 for a component of its velocity that does not change."""
        self.plain = np.array([each.plain for each in specs], bool)
        """(w,) True for walls that are fixed planes."""
        self.speed = np.array([self._driven(k, 0.0, 0.0) for k in range(n)]).reshape(n, 3)
        """(w, 3) velocity of each wall at mid-step, m/s."""
        self.before = self.speed.copy()
        """(w, 3) velocity v(n-1/2) of each wall, m/s."""

    @property
    def n(self) -> int:
        """Number of walls of the case."""
        return len(self.mass)

    def places(self, n: int) -> Floats | None:
        """Returns (n, 3) the positions of the first ``n`` walls, m; None if none of these walls moves."""
        moves = (self.lightness[:n] > 0.0) | self.given[:n].any(axis=1)
        return self.shapes.point[:n].copy() if moves.any() else None

    def keep(self) -> tuple[Floats, Floats]:
        """Returns positions and velocities, for a checkpoint."""
        return self.shapes.point.copy(), self.speed.copy()

    def resume(self, known: tuple[Floats, Floats]) -> None:
        """Restores positions and velocities. A checkpoint of a case without walls has arrays without rows."""
        point, speed = known
        self.shapes.point[:], self.speed[:] = np.reshape(point, (-1, 3)), np.reshape(speed, self.speed.shape)

    def words(self) -> bytes:
        """Returns the values of the moving walls for the digest."""
        moving = ~self.plain
        return bytes(self.shapes.point[moving].tobytes() + self.speed[moving].tobytes())

    def kinetic(self) -> float:
        """Returns the kinetic energy at n of the walls with a mass, J: half of the mass times the product of the
        velocities before and after n.
        """
        free = self.lightness > 0.0
        squares = self.before[free] * self.speed[free]
        return float((0.5 * self.mass[free] * ((squares[:, 0] + squares[:, 1]) + squares[:, 2])).sum())

    def momenta(self) -> Floats:
        """(6,) momentum, kg m/s, and angular momentum about the origin, kg m^2/s, of the walls with a mass, at n."""
        free = self.lightness > 0.0
        p = 0.5 * self.mass[free, None] * (self.before[free] + self.speed[free])
        x = self.shapes.point[free]
        about = [x[:, i] * p[:, j] - x[:, j] * p[:, i] for i, j in ((1, 2), (2, 0), (0, 1))]
        return np.concatenate([p.sum(axis=0), np.stack(about, axis=1).sum(axis=0)])

    def note(self) -> None:
        """Stores v(n-1/2); to be called before the kick."""
        self.before[:] = self.speed

    def kick(self, dt: float, t: float) -> None:
        """Sets the velocity of each driven wall to its mean over the step."""
        for k in range(self.n):
            if self.lightness[k] == 0.0:
                self.speed[k] = self._driven(k, t, t + dt)

    def move(self, dt: float) -> None:
        """Moves the walls to n+1."""
        self.shapes.point[:] += dt * self.speed

    def _driven(self, k: int, begin: float, end: float) -> Floats:
        return np.asarray(self.given[k] * self._courses[k].mean(begin, end))


@njit(types.float64(_F1, SHAPES, types.int64, _F, _F, _F), cache=True, error_model="numpy")
def gap(normal, shapes, k, x, y, z):  # type: ignore[no-untyped-def]
    """Returns the distance of a point from wall ``k``, m; it is negative for a point behind the wall. Sets ``normal``
    (3,) to the unit normal out of the wall; zero on the axis of a cylinder or at the centre of a sphere.
    """
    p, a = shapes.point, shapes.axis
    dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
    along = dx * a[k, 0] + dy * a[k, 1] + dz * a[k, 2]
    if shapes.kind[k] == PLANE:
        for i in range(3):
            normal[i] = a[k, i]
        return along
    if shapes.kind[k] == CYLINDER:
        dx, dy, dz = dx - along * a[k, 0], dy - along * a[k, 1], dz - along * a[k, 2]
    far = np.sqrt(dx * dx + dy * dy + dz * dz)
    over = shapes.side[k] / far if far > 0.0 else 0.0
    normal[0], normal[1], normal[2] = over * dx, over * dy, over * dz
    return shapes.side[k] * (far - shapes.radius[k])
