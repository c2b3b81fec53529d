r"""Rigid walls that move or are round. The walls stop the nodes of deformable bodies.

::

        node   x(n)                      gap g at n, relative velocity u = v - V
             .  \                        impulse along n: no gap below zero at the end of the step, g + dt u . n >= 0
        n ^   .  \ dt v                  impulse along the wall: against sliding, at most mu times the normal one
          |    .  v
        ==|=====.=======> dt V  wall     mirrored components: held by planes of symmetry, no impulse

As at a fixed plane (walls.py), impulses never pull. A wall with a mass M ends the step with the velocity V that results
from all impulses on it. V is the solution of

    M (V - V(n-1/2)) + sum of the impulses, which increase with V, = 0

The equation is solved by Newton's method. The derivative is M plus the masses of the stopped nodes, along their
normals, or along all axes for nodes that stick. Impulses are rounded to quanta, and the wall gets minus their sum, so
that momentum is conserved exactly and the result is the same for any number of ranks and threads.
"""

import numpy as np

from ..kernels.jit import njit, types
from ..migration.parcel import Parcel
from ..model.growing import extended
from ..model.state import Bits, Flags, Floats, Indices, Ints, Nodes
from ..parallel.arguments import Arguments, reader
from ..parallel.comm import Comm
from ..parallel.fixed_point import scale_for
from ..parallel.team import TASK
from .boundaries import KEPT, Boundary, Stopping, free, mirrored
from .wall_shapes import SHAPES, Walls, gap
from .walls import ACROSS

_NEWTON, _ENOUGH = 20, 1e-9
"""Largest number of Newton iterations, and the relative change of V at which the iteration ends. If no node slides, the
sum of impulses is piecewise linear in the velocity V of the wall, so that two or three iterations are enough."""
_SWEEPS = 4
"""Number of passes over the walls if there are several walls (walls.py)."""
_LINE = 16
"""Number of words of the sums of a thread: impulse (3), and the derivative of the impulse (xx, yy, zz, yz, zx, xy).
Unused words follow, so that two threads do not write to the same cache line."""


class MovingWalls(Stopping):
    """Moving or round walls. ``held`` (n, w): True if wall w stops node n; always False for fixed planes."""

    def __init__(
        self, nodes: Indices, owned: Flags, walls: Walls, held: Flags, planes: Flags, comm: Comm, reports: bool = False,
    ) -> None:  # fmt: skip
        """``owned`` (n,): True for each node that this rank owns; ``planes`` (n, 3): components held by symmetry
        planes; ``reports``: True if the run will call ``since_last_report``.
        """
        super().__init__(nodes, walls.n, reports=reports)
        self.walls, self._owned, self._held, self._mirrored, self._comm = walls, owned, held, planes, comm
        self.scale = self._weight = 1.0
        """Number of quanta per N s of impulses, and number of quanta per kg of the derivative."""
        n, w = len(nodes), walls.n
        self._step, self._rubbed = np.zeros((2, n, 3 * w))
        """(n, 3 walls) impulses of the last step, N s, and the part of them that is friction."""
        self.friction_loss = np.zeros(n)
        self._kept = (*self._kept, "friction_loss", "_step", "_rubbed")
        self._pushed = False
        self._arguments, self._books = Arguments(*_PUSH), Arguments(*_BOOK)

    def measure(self, mass: float, speed: float) -> None:
        """Chooses the quanta from the largest nodal ``mass``, kg, and the largest ``speed``, m/s, of the scene."""
        self.scale, self._weight = scale_for(mass * speed), scale_for(mass)

    def held_components(self) -> Bits:
        return free(self.nodes)

    def depths(self, state: Nodes) -> Floats:
        """(w,) largest depth of a node behind each wall at the start, m."""
        found = np.full(self.walls.n, -np.inf)
        deepest(found, self.walls.shapes, state.x, self.nodes, self._held)
        return found

    def release(self, loose: Flags, bounds: list[Boundary]) -> None:
        self._mirrored = mirrored(len(loose), bounds)[self.nodes]

    def _inherit(self, at: Ints) -> None:
        for key in ("_held", "_mirrored", "_owned"):
            values = getattr(self, key)
            setattr(self, key, extended(values, values[at]))
        for key in self._kept[len(KEPT) :]:
            values = getattr(self, key)
            setattr(self, key, extended(values, np.zeros((len(at), *values.shape[1:]))))

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        super().resume(parcel, name, dt)
        self._pushed = True

    def note(self, state: Nodes) -> None:
        self._note(state, self.contact_loss, 0.0)  # this call only stores v(n-1/2)
        if self._pushed:
            self._book(self.walls.speed, self._before)
            self._step[:], self._rubbed[:] = 0.0, 0.0

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        walls, before = self.walls, self.walls.before
        moved = False
        for _ in range(1 if walls.n == 1 else _SWEEPS):
            now = False
            for k in np.flatnonzero(~walls.plain).tolist():
                now |= self._stop(state, k, dt)
            moved |= now
            if not now:
                break
        self._pushed = moved
        if moved:
            self.last_push = t
            self._book(before, self._before)

    def _stop(self, state: Nodes, k: int, dt: float) -> bool:
        """Stops the nodes at wall ``k`` in a step of length ``dt``, s. Returns True if the wall stops a node on any
        rank.
        """
        walls, mass = self.walls, self.walls.mass[k]
        start = walls.speed[k].copy()
        speed = start.copy()
        if walls.lightness[k] > 0.0:
            for _ in range(_NEWTON):
                sums = self._sum(state, k, speed, dt, gives=False)
                if not sums[:3].any():
                    break
                impulse = np.array([float(word) for word in sums[:3]]) / self.scale
                right = np.where(walls.held[k], 0.0, -(mass * (speed - start) + impulse))
                change = solved(np.where(_paired(walls.held[k]), 0.0, sums[3:9] / self._weight), mass, right)
                speed += change
                if np.abs(change).max() <= _ENOUGH * np.abs(speed).max():
                    break
            else:
                sums = self._sum(state, k, speed, dt, gives=False)
            if not sums[:3].any():
                return False
        sums = self._sum(state, k, speed, dt, gives=True)
        walls.speed[k] = start - walls.light[k] * (sums[:3] / self.scale)
        return bool(sums[:3].any())

    def _sum(self, state: Nodes, k: int, speed: Floats, dt: float, *, gives: bool) -> Ints:
        """(_LINE,) sums over the owned nodes: impulses of wall ``k`` if its velocity is ``speed`` (3,), and the
        derivative of the impulses. For a wall with a mass the sums are over all ranks. ``gives``: True if the impulses
        are applied to the nodes.
        """
        sums, walls = np.zeros((self.over.threads, _LINE), np.int64), self.walls
        table = self._arguments.set(
            sums, state.x, state.v, state.mass, self.nodes, self._owned, self._held, self._mirrored, self.given,
            self._step, self._rubbed, walls.shapes, speed, k, float(walls.friction[k]), self.scale, self._weight, dt,
            gives,
        )  # fmt: skip
        self.over.run(_push_out, table, len(self.nodes))
        own = sums.sum(axis=0)
        return self._comm.sum(own) if walls.lightness[k] > 0.0 and self._comm.size > 1 else own

    def _book(self, of_walls: Floats, of_nodes: Floats) -> None:
        """Adds half of the work of the impulses of the step, computed with the velocities of the walls (w, 3) and of
        the nodes (n, 3), m/s.
        """
        table = self._books.set(
            self.contact_loss, self.friction_loss, self.external_work, self._step, self._rubbed, of_walls, of_nodes,
            self.walls.lightness,
        )  # fmt: skip
        self.over.run(_book, table, len(self.nodes))


def solved(derivative: Floats, mass: float, right: Floats) -> Floats:
    """(3,) solution x of (mass + derivative) x = right. ``derivative`` has the components xx, yy, zz, yz, zx, xy,
    kg.
    """
    xx, yy, zz = (mass + float(value) for value in derivative[:3])
    yz, zx, xy = (float(value) for value in derivative[3:])
    a, b, c = yy * zz - yz * yz, zx * yz - xy * zz, xy * yz - yy * zx
    d, e, f = zz * xx - zx * zx, xy * zx - xx * yz, xx * yy - xy * xy
    whole = xx * a + xy * b + zx * c
    p, q, r = (float(value) for value in right)
    return np.array([a * p + b * q + c * r, b * p + d * q + e * r, c * p + e * q + f * r]) / whole


def _paired(held: Flags) -> Flags:
    """(6,) True for the components xx, yy, zz, yz, zx, xy of a tensor with a ``held`` (3,) axis."""
    x, y, z = held.tolist()
    return np.array([x, y, z, y or z, z or x, x or y])


_F, _I, _B = types.float64, types.int64, types.boolean
_F1, _F2, _I2 = types.float64[::1], types.float64[:, ::1], types.int64[:, ::1]
_N1, _B1, _B2 = types.int32[::1], types.boolean[::1], types.boolean[:, ::1]
_PUSH = _I2, _F2, _F2, _F1, _N1, _B1, _B2, _B2, _F2, _F2, _F2, SHAPES, _F1, _I, _F, _F, _F, _F, _B
_BOOK = _F1, _F1, _F1, _F2, _F2, _F2, _F2, _F1
_of_push, _of_book = reader(*_PUSH), reader(*_BOOK)


@njit(types.void(_F1, SHAPES, _F2, _N1, _B2), cache=True)
def deepest(found, shapes, x, nodes, held):  # type: ignore[no-untyped-def]
    """Raises ``found`` (w,) to the largest depth of the ``nodes`` behind each wall that stops them, m."""
    normal = np.empty(3)
    for j in range(len(nodes)):
        a = nodes[j]
        for k in range(len(found)):
            if held[j, k]:
                found[k] = max(found[k], -gap(normal, shapes, k, x[a, 0], x[a, 1], x[a, 2]))


@njit(TASK, cache=True, error_model="numpy")
def _push_out(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task of ``MovingWalls._sum``: computes the impulses of wall ``k`` on a range of nodes. Numbered comments in the
    code explain the steps for one node.
    """
    (
        sums, x, v, mass, nodes, owned, held, mirrored, given, step, rubbed, shapes, wall, k, mu, scale, weight, dt,
        gives,
    ) = _of_push(table)  # fmt: skip
    normal, slide, impulse, words = np.empty(3), np.empty(3), np.empty(3), np.empty(3, np.int64)
    for j in range(begin, end):
        if not held[j, k]:
            continue
        # 1. Skip a node whose gap is not negative at the end of the step.
        a = nodes[j]
        far = gap(normal, shapes, k, x[a, 0], x[a, 1], x[a, 2])
        speed, along = 0.0, 0.0
        for i in range(3):
            speed += (v[a, i] - wall[i]) * normal[i]
            if not mirrored[j, i]:
                along += normal[i] * normal[i]
        if far + dt * speed >= 0.0 or along <= ACROSS:
            continue
        # 2. Compute the normal impulse along the components that are not mirrored.
        push = -(far / dt + speed) / along
        size, share = 0.0, 0.0
        for i in range(3):
            impulse[i] = 0.0 if mirrored[j, i] else push * normal[i]
        # 3. Compute the sliding velocity after the normal impulse, and Coulomb's friction.
        if mu > 0.0:
            speed = speed + push * along
            for i in range(3):
                slide[i] = 0.0 if mirrored[j, i] else v[a, i] + impulse[i] - wall[i] - speed / along * normal[i]
                size += slide[i] * slide[i]
            most = mu * push
            share = most / np.sqrt(size) if size > most * most else 1.0
        # 4. Round the impulse to quanta. Apply it to the node if ``gives``. Add it to the sum on the rank that owns the
        # node.
        for i in range(3):
            rub = -share * slide[i] if mu > 0.0 else 0.0
            words[i] = np.int64(np.rint(mass[a] * (impulse[i] + rub) * scale))
            if gives:
                v[a, i] += words[i] / (scale * mass[a])
                given[j, 3 * k + i] += words[i] / scale
                step[j, 3 * k + i] += words[i] / scale
                rubbed[j, 3 * k + i] += mass[a] * rub
            if owned[j]:
                sums[thread, i] += words[i]
        # 5. If ``gives`` is False, add the derivative of the impulse with respect to the velocity of the wall.
        if owned[j] and not gives:
            sticks = mu > 0.0 and share == 1.0
            for m in range(6):
                p, q = (m, m) if m < 3 else ((m + 1) % 3, (m + 2) % 3)
                if mirrored[j, p] or mirrored[j, q]:
                    continue
                part = normal[p] * normal[q] / along
                if sticks:
                    part = 1.0 if p == q else 0.0
                sums[thread, 3 + m] += np.int64(np.rint(mass[a] * part * weight))


@njit(TASK, cache=True)
def _book(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task of ``MovingWalls._book``: adds half of the work of the impulses. The work of a wall without a mass is
    external work.
    """
    loss, friction, external, step, rubbed, of_walls, of_nodes, lightness = _of_book(table)
    for j in range(begin, end):
        for k in range(len(lightness)):
            for i in range(3):
                given, wall = step[j, 3 * k + i], of_walls[k, i]
                loss[j] -= 0.5 * given * (of_nodes[j, i] - wall)
                friction[j] -= 0.5 * rubbed[j, 3 * k + i] * (of_nodes[j, i] - wall)
                if lightness[k] == 0.0:
                    external[j] += 0.5 * given * wall
