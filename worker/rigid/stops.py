r"""Walls that stop rigid bodies by impulses at the surface nodes of the bodies.

::

           \   body   /                row: node i of a body near a wall
            \        /                 arm r from the centre c, normal n out of the wall
             \  c + /                  velocity of the node  u = v + w x r - V   (V: velocity of the wall)
              \  / r                   gap at the end of the step  g + dt u . n >= 0,  least = -g / dt
               i   ^ n
          =====.===|=========          impulse p n, p >= 0, acts on v, w and -V;  friction |f| <= mu p, across n
              wall    V

All ranks have equal data of bodies, walls and nodes. Therefore every rank computes all impulses, one after the other
(Gauss-Seidel), without messages. The impulses of a step are accumulated, within the sweeps of contact and after the
sweeps, so that a body between a wall and another body penetrates neither the wall nor the other body.
"""

from typing import NamedTuple

import numpy as np

from ..boundaries.wall_shapes import SHAPES, Walls, gap
from ..errors import PhysicsError
from ..kernels.jit import njit, record, types
from ..model.state import Flags, Floats, Indices, Ints
from .bodies import Bodies, dot

_NEAR = 2.0
"""Factor for the motion of a body in a step. Walls nearer to the body than the factor times this motion are checked."""
_CLOSE = 1e-3
"""Length, divided by the reach of a body. The length is added to the distance within which walls are checked. If a node
ends deeper than this length behind a wall, the run ends."""
_MOST, _ENOUGH = 200, 1e-12
"""Largest number of passes over the rows; and relative change of an impulse. The passes end when all changes are
smaller."""


class Rows(NamedTuple):
    """Nodes of bodies near walls. The arrays have one row for each pair of a node and a wall."""

    body: Ints
    wall: Ints
    arm: Floats
    """(m, 3) arm: vector from the centre of the body to the node, m."""
    normal: Floats
    """(m, 3) unit normal out of the wall."""
    least: Floats
    """(m,) velocity along the normal with which the node reaches the wall exactly at the end of the step, m/s."""
    push: Floats
    """(m,) normal impulse so far, N s."""
    rub: Floats
    """(m, 3) impulse of friction so far, N s."""

    @classmethod
    def room(cls, n: int) -> "Rows":
        """Allocates arrays for ``n`` rows."""
        return cls(
            np.empty(n, np.int64), np.empty(n, np.int64), np.empty((n, 3)), np.empty((n, 3)), np.empty(n), np.zeros(n),
            np.zeros((n, 3)),
        )  # fmt: skip


_F, _F1, _F2, _F3 = types.float64, types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
_I1, _N1 = types.int64[::1], types.int32[::1]
ROWS = record(Rows, _I1, _I1, _F2, _F2, _F1, _F1, _F2)


class BodyStops:
    """Walls of a case and the bodies that they stop."""

    def __init__(
        self, walls: Walls, bodies: Bodies, held: Flags, arms: Floats, body: Indices, restitution: Floats,
        names: list[str],
    ) -> None:  # fmt: skip
        """``held`` (walls, b): True if the wall stops the body. ``arms`` (k, 3): arms of all surface nodes at the
        start, m; ``body`` (k,): bodies of these nodes. ``restitution`` (walls,): coefficients of restitution; ``names``
        (b,): names of the parts.
        """
        self._restitution, self._names = restitution, names
        self.walls, self._bodies, self._held, self._arms, self._body = walls, bodies, held, arms, body
        self._all = Rows.room(len(arms) * walls.n)
        self._many = 0
        self.given = np.zeros((walls.n, bodies.n, 3))
        """(walls, b, 3) sum of the impulses of each wall on each body so far, N s."""
        self.impulse, self.rubbed = np.zeros((2, bodies.n, 6))
        """(b, 6) impulse, N s, and moment, N m s, of the walls on each body in the step; and the part of these that is
        due to friction."""
        self.of_walls, self.rubbed_by = np.zeros((2, walls.n, bodies.n, 3))
        """(walls, b, 3) impulse of each wall on each body in the step, N s; and the part of it that is due to
        friction."""

    def begin(self, dt: float) -> None:
        """Finds the pairs of a node and a wall for a step of length ``dt``, s; positions are those of n, velocities
        those before the impulses.
        """
        bodies = self._bodies
        rate = bodies.rates(bodies.momentum)
        size = np.sqrt((bodies.speed * bodies.speed).sum(axis=1)) + bodies.reach * np.sqrt((rate * rate).sum(axis=1))
        fastest = float(np.sqrt((self.walls.speed * self.walls.speed).sum(axis=1)).max(initial=0.0))
        near = _NEAR * dt * (size + fastest) + _CLOSE * bodies.reach
        self._many = find(
            self._all, self.walls.shapes, self._held, self._arms, self._body, bodies.rotation, bodies.centre, near, dt
        )  # fmt: skip
        if self._restitution.any():
            self._rebound(bodies.speed, rate)
        self._all.push[:] = 0.0
        self._all.rub[:] = 0.0
        self.impulse[:], self.rubbed[:], self.of_walls[:], self.rubbed_by[:] = 0.0, 0.0, 0.0, 0.0

    def stop(self, speed: Floats, rate: Floats) -> None:
        """Corrects the velocities ``speed`` and rotation vectors ``rate`` (b, 3) of the bodies, and the velocities of
        walls with a mass.
        """
        if self._many:
            walls = self.walls
            press(
                self._all, self._many, speed, rate, self._bodies.lightness, self._bodies.yielding, walls.speed,
                walls.lightness, walls.light, walls.friction, self.impulse, self.rubbed, self.of_walls, self.rubbed_by,
            )  # fmt: skip

    def _rebound(self, speed: Floats, rate: Floats) -> None:
        """Raises ``least`` to the velocity of restitution, m/s, in rows whose node would end behind its wall."""
        wall, least, along = self._all.wall[: self._many], self._all.least[: self._many], self._along(speed, rate)
        back = -self._restitution[wall] * along
        least[:] = np.where((along < least) & (self._restitution[wall] > 0.0), np.maximum(least, back), least)

    def _along(self, speed: Floats, rate: Floats) -> Floats:
        """(rows,) velocity of each node relative to its wall, along the normal of the wall, m/s."""
        rows, n = self._all, self._many
        b, r, w = rows.body[:n], rows.arm[:n], rate[rows.body[:n]]
        turning = [w[:, i] * r[:, j] - w[:, j] * r[:, i] for i, j in ((1, 2), (2, 0), (0, 1))]
        v = speed[b] + np.stack(turning, axis=1) - self.walls.speed[rows.wall[:n]]
        return dot(v, rows.normal[:n])

    def end(self, speed: Floats, rate: Floats, dt: float, t: float) -> None:
        """Adds the work of the impulses of the step ``dt``, s, at the time ``t``, s. Raises PhysicsError on all ranks
        if a node would still end behind its wall.
        """
        self.given += self.of_walls
        if self._many:
            body = self._all.body[: self._many]
            depth = dt * (self._all.least[: self._many] - self._along(speed, rate)) / self._bodies.reach[body]
            worst = int(depth.argmax())
            if depth[worst] > _CLOSE:
                raise PhysicsError(
                    f"at t = {t:.6g} s rigid part {self._names[body[worst]]!r} cannot be kept out of a wall: it is "
                    "between walls that close, or held by a plane of symmetry or a velocity; let the walls stop "
                    "before, or give one of them a mass"
                )

    def deepest(self) -> Floats:
        """(walls,) largest depth of a node behind each wall, m."""
        rows = Rows.room(len(self._arms) * self.walls.n)
        bodies = self._bodies
        many = find(
            rows, self.walls.shapes, self._held, self._arms, self._body, bodies.rotation, bodies.centre,
            np.full(bodies.n, 0.0), 1.0,
        )  # fmt: skip
        found = np.zeros(self.walls.n)
        np.maximum.at(found, rows.wall[:many], rows.least[:many])
        return found


@njit(types.int64(ROWS, SHAPES, types.boolean[:, ::1], _F2, _N1, _F3, _F2, _F1, _F), cache=True, error_model="numpy")
def find(rows, shapes, held, arms, body, rotation, centre, near, dt):  # type: ignore[no-untyped-def]
    """Finds the nodes that are less than ``near`` (b,), m, in front of a wall that stops their body. Returns the number
    of rows.
    """
    n, arm, normal = 0, np.empty(3), np.empty(3)
    for k in range(len(body)):
        b = body[k]
        for i in range(3):
            arm[i] = rotation[b, i, 0] * arms[k, 0] + rotation[b, i, 1] * arms[k, 1] + rotation[b, i, 2] * arms[k, 2]
        for w in range(len(shapes.kind)):
            if not held[w, b]:
                continue
            far = gap(normal, shapes, w, centre[b, 0] + arm[0], centre[b, 1] + arm[1], centre[b, 2] + arm[2])
            if far >= near[b]:
                continue
            rows.body[n], rows.wall[n], rows.least[n] = b, w, -far / dt
            for i in range(3):
                rows.arm[n, i], rows.normal[n, i] = arm[i], normal[i]
            n += 1
    return n


@njit(
    types.void(ROWS, types.int64, _F2, _F2, _F2, _F3, _F2, _F1, _F2, _F1, _F2, _F2, _F3, _F3),
    cache=True,
    error_model="numpy",
)
def press(  # type: ignore[no-untyped-def]
    rows, many, speed, rate, lightness, yielding, wall_speed, wall_lightness, light, friction, impulse, rubbed, given,
    by,
):  # fmt: skip
    """Passes over the rows until the impulses have converged.

    Adds the impulses to ``impulse`` (b, 6) and ``given`` (walls, b, 3), and the impulses of friction also to ``rubbed``
    and ``by``.

    1. Velocity u of the node relative to the wall.
    2. Compliance along n of body and wall: 1 / m + (r x n) . I^-1 (r x n) + 1 / M; with ``light`` (walls, 3) for 1 / M.
    3. Normal impulse: changed by (least - u . n) / compliance, and not below zero.
    4. Friction: u again, without its normal part, over a bound of the compliance across n; the sum of the step is
       limited to mu p.
    """
    turn, slip, change = np.empty(3), np.empty(3), np.empty(3)
    for _ in range(_MOST):
        largest, moved = 0.0, 0.0
        for r in range(many):
            # 1. Compute the velocity of the node relative to the wall.
            b, w = rows.body[r], rows.wall[r]
            x, y, z = rows.arm[r, 0], rows.arm[r, 1], rows.arm[r, 2]
            slip[0] = speed[b, 0] + (rate[b, 1] * z - rate[b, 2] * y) - wall_speed[w, 0]
            slip[1] = speed[b, 1] + (rate[b, 2] * x - rate[b, 0] * z) - wall_speed[w, 1]
            slip[2] = speed[b, 2] + (rate[b, 0] * y - rate[b, 1] * x) - wall_speed[w, 2]
            # 2. Compute the compliance along n of body and wall.
            p, q, s = rows.normal[r, 0], rows.normal[r, 1], rows.normal[r, 2]
            turn[0], turn[1], turn[2] = y * s - z * q, z * p - x * s, x * q - y * p
            gives, along = wall_lightness[w], 0.0
            for i in range(3):
                gives += lightness[b, i] * rows.normal[r, i] * rows.normal[r, i]
                gives -= (wall_lightness[w] - light[w, i]) * rows.normal[r, i] * rows.normal[r, i]
                along += rows.normal[r, i] * slip[i]
                for j in range(3):
                    gives += turn[i] * yielding[b, i, j] * turn[j]
            if not gives > 0.0:
                continue
            # 3. Compute the normal impulse.
            push = max(0.0, rows.push[r] + (rows.least[r] - along) / gives)
            more = push - rows.push[r]
            rows.push[r] = push
            largest, moved = max(largest, push), max(moved, abs(more))
            for i in range(3):
                change[i] = more * rows.normal[r, i]
            _give(b, w, x, y, z, change, speed, rate, lightness, yielding, wall_speed, light, impulse, given)
            if friction[w] == 0.0 or (push == 0.0 and more == 0.0):
                continue
            # 4. Compute the friction.
            slip[0] = speed[b, 0] + (rate[b, 1] * z - rate[b, 2] * y) - wall_speed[w, 0]
            slip[1] = speed[b, 1] + (rate[b, 2] * x - rate[b, 0] * z) - wall_speed[w, 1]
            slip[2] = speed[b, 2] + (rate[b, 0] * y - rate[b, 1] * x) - wall_speed[w, 2]
            along, size, soft = 0.0, 0.0, wall_lightness[w]
            for i in range(3):
                along += rows.normal[r, i] * slip[i]
                soft = max(soft, wall_lightness[w] + lightness[b, i])
            for i in range(3):
                soft += (x * x + y * y + z * z) * yielding[b, i, i]
            for i in range(3):
                slip[i] = rows.rub[r, i] - (slip[i] - along * rows.normal[r, i]) / soft
                size += slip[i] * slip[i]
            most = friction[w] * push
            share = most / np.sqrt(size) if size > most * most else 1.0
            for i in range(3):
                change[i] = share * slip[i] - rows.rub[r, i]
                rows.rub[r, i] = share * slip[i]
                moved = max(moved, abs(change[i]))
            _give(b, w, x, y, z, change, speed, rate, lightness, yielding, wall_speed, light, impulse, given)
            for i in range(3):
                rubbed[b, i] += change[i]
                by[w, b, i] += change[i]
            rubbed[b, 3] += y * change[2] - z * change[1]
            rubbed[b, 4] += z * change[0] - x * change[2]
            rubbed[b, 5] += x * change[1] - y * change[0]
        if moved <= _ENOUGH * largest:
            break


@njit(types.void(types.int64, types.int64, _F, _F, _F, _F1, _F2, _F2, _F2, _F3, _F2, _F2, _F2, _F3), cache=True)
def _give(b, w, x, y, z, change, speed, rate, lightness, yielding, wall_speed, light, impulse, given):  # type: ignore[no-untyped-def]
    """Applies the impulse ``change`` (3,), N s, of a wall to a body, at the arm x, y, z."""
    p, q, s = change[0], change[1], change[2]
    t, u, v = y * s - z * q, z * p - x * s, x * q - y * p
    impulse[b, 3] += t
    impulse[b, 4] += u
    impulse[b, 5] += v
    for i in range(3):
        impulse[b, i] += change[i]
        given[w, b, i] += change[i]
        speed[b, i] += lightness[b, i] * change[i]
        rate[b, i] += yielding[b, i, 0] * t + yielding[b, i, 1] * u + yielding[b, i, 2] * v
        wall_speed[w, i] -= light[w, i] * change[i]
