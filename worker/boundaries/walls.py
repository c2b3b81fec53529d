"""Rigid walls that are fixed planes: impulses stop nodes there, with Coulomb friction along the wall."""

import numpy as np

from ..kernels.jit import njit, types
from ..migration.parcel import Parcel
from ..model.state import Bits, Flags, Floats, Indices, Ints, Nodes, extended
from ..parallel.arguments import Arguments, reader
from ..parallel.team import TASK
from .boundaries import KEPT, Boundary, Stopping, free, mirrored
from .impulses import book

_SWEEPS = 4
"""Largest number of passes over the walls for each node. Chosen value: two walls at right angles need one pass; the
remaining error at a sharper corner is corrected in the next step."""
ACROSS = 1e-12
"""Smallest squared length of the unit normal of a wall after the components held by planes of symmetry are set to
zero. Below this value the wall is parallel to a plane of symmetry and cannot push the node. Chosen value: far above
rounding (1e-32) and below any intended angle."""


class RigidWalls(Stopping):
    """Stops nodes at walls: an impulse along the normal keeps a node from ending the step behind a wall, and never
    pulls. Another one along the wall reduces its sliding velocity, at most by Coulomb's ``friction`` (w,) times the
    normal one.

    ``points`` and ``normals`` (w, 3); ``held`` (n, w): which walls stop which node. A node between two walls is stopped
    by the first wall, then by the second wall, several times. ``mirrored`` (n, 3): components held by planes of
    symmetry, None for none; a wall that is not at right angles to a plane pushes the nodes on the plane of symmetry
    along this plane; the plane takes the other component.
    """

    def __init__(
        self, nodes: Indices, points: Floats, normals: Floats, held: Flags, mirrored: Flags | None = None,
        friction: Floats | None = None, reports: bool = False,
    ) -> None:  # fmt: skip
        """``reports``: True if ``since_last_report`` will be called."""
        super().__init__(nodes, len(points), reports=reports)
        self._friction = np.zeros(len(points)) if friction is None else friction
        self._rubbed = np.zeros((len(nodes) if self._friction.any() else 0, 3))
        """(n, 3) friction impulse of the last step, N s; (0, 3) without friction."""
        self._mirrored = np.zeros((len(nodes), 3), bool) if mirrored is None else mirrored
        self._points = points
        self._normals = normals / np.linalg.norm(normals, axis=1)[:, None]
        self._held = held
        self._pushed = False
        self._pushes = Arguments(*_PUSH)
        if self._friction.any():
            self.friction_loss = np.zeros(len(nodes))
            self._kept = (*self._kept, "friction_loss", "_rubbed")

    def held_components(self) -> Bits:
        return free(self.nodes)

    def depths(self, state: Nodes) -> Floats:
        """(w,) depth of the deepest node behind each wall at the start, m."""
        depths = np.full(len(self._points), -np.inf)
        for k, (point, normal) in enumerate(zip(self._points, self._normals, strict=True)):
            behind = ((point - state.x[self.nodes[self._held[:, k]]]) * normal).sum(axis=1)
            depths[k] = behind.max(initial=-np.inf)
        return depths

    def release(self, loose: Flags, bounds: list[Boundary]) -> None:
        self._mirrored = mirrored(len(loose), bounds)[self.nodes]

    def _inherit(self, at: Ints) -> None:
        self._held = extended(self._held, self._held[at])
        self._mirrored = extended(self._mirrored, self._mirrored[at])
        for key in self._kept[len(KEPT) :]:
            values = getattr(self, key)
            setattr(self, key, extended(values, np.zeros((len(at), *values.shape[1:]))))

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        super().resume(parcel, name, dt)
        self._pushed = True

    def note(self, state: Nodes) -> None:
        self._note(state, self.contact_loss, -0.5)
        if self._pushed:
            if self.friction_loss is not None:
                book_all(self.friction_loss, self._rubbed, self._before)
            self._impulse[:], self._rubbed[:] = 0.0, 0.0

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        pushed = np.zeros((self.over.threads, 8))
        rubs = self.friction_loss is not None
        table = self._pushes.set(
            state.x, state.v, state.mass, self.nodes, self._before, self._impulse, self._rubbed, self.given,
            self.contact_loss, self.friction_loss if rubs else self.contact_loss[:0], self._points, self._normals,
            self._friction, self._held, self._mirrored, pushed, dt,
        )  # fmt: skip
        self.over.run(_push_out, table, len(self.nodes))
        self._pushed = bool(pushed[:, 0].any())
        if self._pushed:
            self.last_push = t


_F, _F1, _F2, _B2 = types.float64, types.float64[::1], types.float64[:, ::1], types.boolean[:, ::1]
_PUSH = _F2, _F2, _F1, types.int32[::1], _F2, _F2, _F2, _F2, _F1, _F1, _F2, _F2, _F1, _B2, _B2, _F2, _F
_of_push = reader(*_PUSH)


@njit("void(float64[::1], float64[:, ::1], float64[:, ::1])", cache=True)
def book_all(loss, impulse, before):  # type: ignore[no-untyped-def]
    """Books half of the work of the impulses (n, 3) at the velocities ``before`` them, as loss."""
    for j in range(len(loss)):
        book(loss, impulse, before, j, -0.5)


@njit(TASK, cache=True, error_model="numpy")
def _push_out(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: stops the nodes of a range at all walls, and books half of the work.

    Adds the impulses to ``impulse``, the friction impulses also to ``rubbed``, and the impulses of each wall to
    ``given``. Sets column 0 of ``pushed`` (threads, 8; the other columns are padding) if a wall stopped a node.

    1. Gap and velocity along the normal, and the square of the normal without ``mirrored`` components. 2. Impulse such
    that the gap at the end of the step is zero. 3. Friction: sliding velocity across the normal, at most mu times the
    normal one. 4. Next pass, if a node between several walls was stopped by a wall.
    """
    (
        x, v, mass, nodes, before, impulse, rubbed, given, loss, friction_loss, points, normals, friction, held,
        mirrored, pushed, dt,
    ) = _of_push(table)  # fmt: skip
    slide = pushed[thread, 1:4]
    for j in range(begin, end):
        a, any_moved = nodes[j], False
        for _ in range(_SWEEPS):
            moved = False
            for k in range(len(points)):
                # 1. Compute gap, velocity and free part of the normal.
                gap, speed, along = 0.0, 0.0, 1.0
                for i in range(3):
                    gap += (x[a, i] - points[k, i]) * normals[k, i]
                    speed += v[a, i] * normals[k, i]
                    if mirrored[j, i]:
                        along -= normals[k, i] * normals[k, i]
                if held[j, k] and gap + dt * speed < 0.0 and along > ACROSS:
                    # 2. Compute the impulse that makes the gap zero.
                    push = -(gap / dt + speed) / along
                    for i in range(3):
                        if mirrored[j, i]:
                            continue
                        change = push * normals[k, i]
                        v[a, i] += change
                        impulse[j, i] += mass[a] * change
                        given[j, 3 * k + i] += mass[a] * change
                    moved = any_moved = True
                    if friction[k] == 0.0:
                        continue
                    # 3. Compute the friction.
                    speed, size = 0.0, 0.0
                    for i in range(3):
                        speed += v[a, i] * normals[k, i]
                    for i in range(3):
                        slide[i] = 0.0 if mirrored[j, i] else v[a, i] - speed / along * normals[k, i]
                        size += slide[i] * slide[i]
                    most = friction[k] * push
                    share = most / np.sqrt(size) if size > most * most else 1.0
                    for i in range(3):
                        v[a, i] -= share * slide[i]
                        impulse[j, i] -= mass[a] * share * slide[i]
                        rubbed[j, i] -= mass[a] * share * slide[i]
                        given[j, 3 * k + i] -= mass[a] * share * slide[i]
            # 4. Decide whether another pass is needed.
            if not moved or len(points) == 1:
                break
        if any_moved:
            pushed[thread, 0] = 1.0
            book(loss, impulse, before, j, -0.5)
            if len(friction_loss) > 0:
                book(friction_loss, rubbed, before, j, -0.5)
