"""Rigid walls that are fixed planes. Impulses stop nodes at a wall, with Coulomb friction along the wall."""

import numpy as np

from ..clock import DT, T
from ..kernels.jit import njit, types
from ..model.growing import extended
from ..model.state import Bits, Flags, Floats, Indices, Ints, Nodes
from ..parallel.arguments import Arguments, Follow, reader
from ..parallel.team import TASK, Stage
from .boundaries import KEPT, Boundary, Stopping, free, mirrored
from .impulses import book

_SWEEPS = 4
"""Largest number of passes over the walls for each node. Chosen value: two walls at right angles need one pass. At a
sharper corner an error remains, which the next step corrects."""
ACROSS = 1e-12
"""Smallest squared length of the unit normal of a wall after the components held by symmetry planes are set to zero. If
the squared length is smaller, the wall is parallel to a symmetry plane and cannot push the node. Chosen value: it is
far above round-off (1e-32) and below the value of any angle that a user intends."""


class RigidWalls(Stopping):
    """Stops nodes at walls. An impulse along the normal prevents a node from ending the step behind a wall; the impulse
    never pulls. A friction impulse along the wall reduces the sliding velocity of the node; it is at most Coulomb's
    ``friction`` (w,) times the normal impulse.

    ``points`` and ``normals`` (w, 3); ``held`` (n, w): True if wall w stops node n. A node between two walls is stopped
    by the first wall, then by the second wall, several times. ``mirrored`` (n, 3): components held by symmetry planes,
    or None. If a wall is not at right angles to a symmetry plane, it pushes the nodes on the symmetry plane along this
    plane.
    """

    def __init__(
        self, nodes: Indices, points: Floats, normals: Floats, held: Flags, mirrored: Flags | None = None,
        friction: Floats | None = None, reports: bool = False,
    ) -> None:  # fmt: skip
        """``reports``: True if the run will call ``since_last_report``."""
        self._pushed = np.zeros((1, _PADDED))
        """(threads, 8) table. Column 0 is the simulated time of the last impulse that each thread applied, s. The other
        columns are not used."""
        super().__init__(nodes, len(points), reports=reports)
        self._friction = np.zeros(len(points)) if friction is None else friction
        self._none = np.zeros(0)
        self._rubbed = np.zeros((len(nodes) if self._friction.any() else 0, 3))
        """(n, 3) friction impulse of the last step, N s; (0, 3) without friction."""
        self._mirrored = np.zeros((len(nodes), 3), bool) if mirrored is None else mirrored
        self._points = points
        self._normals = normals / np.linalg.norm(normals, axis=1)[:, None]
        self._held = held
        self._forgets, self._pushes = Arguments(*_FORGET), Arguments(*_PUSH)
        if self._friction.any():
            self.friction_loss = np.zeros(len(nodes))
            self._kept = (*self._kept, "friction_loss", "_rubbed")

    @property
    def last_push(self) -> float:
        """Simulated time of the last impulse of the walls, s."""
        return float(self._pushed[:, 0].max())

    @last_push.setter
    def last_push(self, t: float) -> None:
        self._pushed[:, 0] = t

    def held_components(self) -> Bits:
        return free(self.nodes)

    def depths(self, state: Nodes) -> Floats:
        """(w,) largest depth of a node behind each wall at the start, m."""
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

    def note(self, state: Nodes) -> None:
        self.over.run(_forget, self._forgets.set(*self._noted(state)), len(self.nodes))

    def noting(self, state: Nodes) -> list[Stage]:
        return self.over.stages(_forget, self._forgets.set(*self._noted(state)), (), len(self.nodes))

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        self.over.run(_push_out, self._pushes.set(*self._of(state), dt, t), len(self.nodes))

    def acting(self, state: Nodes) -> list[Stage]:
        table, ties = self._pushes.bind(*self._of(state), Follow(DT), Follow(T))
        return self.over.stages(_push_out, table, ties, len(self.nodes))

    def _noted(self, state: Nodes) -> tuple[Floats | Indices, ...]:
        """Returns the arguments of the kernel ``_forget`` as a tuple."""
        friction = self._none if self.friction_loss is None else self.friction_loss
        return state.v, self.nodes, self._before, self._impulse, self.contact_loss, self._rubbed, friction

    def _of(self, state: Nodes) -> tuple[Floats | Indices | Flags, ...]:
        """Returns the arguments of the kernel ``_push_out``, except the numbers at their end."""
        if len(self._pushed) != self.over.threads:
            self._pushed = np.full((self.over.threads, _PADDED), self.last_push)
        friction = self._none if self.friction_loss is None else self.friction_loss
        return (
            state.x, state.v, state.mass, self.nodes, self._before, self._impulse, self._rubbed, self.given,
            self.contact_loss, friction, self._points, self._normals, self._friction, self._held, self._mirrored,
            self._pushed,
        )  # fmt: skip


_PADDED = 8
"""Number of float64 in a cache line."""
_F, _F1, _F2, _B2 = types.float64, types.float64[::1], types.float64[:, ::1], types.boolean[:, ::1]
_N1 = types.int32[::1]
_FORGET = _F2, _N1, _F2, _F2, _F1, _F2, _F1
_PUSH = _F2, _F2, _F1, _N1, _F2, _F2, _F2, _F2, _F1, _F1, _F2, _F2, _F1, _B2, _B2, _F2, _F, _F
_of_forget, _of_push = reader(*_FORGET), reader(*_PUSH)


@njit(TASK, cache=True)
def _forget(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: stores v(n-1/2), adds the second half of the work of the last impulses, and sets the impulses to zero."""
    v, nodes, before, impulse, loss, rubbed, friction_loss = _of_forget(table)
    for j in range(begin, end):
        a = nodes[j]
        for i in range(3):
            before[j, i] = v[a, i]
        if impulse[j, 0] != 0.0 or impulse[j, 1] != 0.0 or impulse[j, 2] != 0.0:
            book(loss, impulse, before, j, -0.5)
            impulse[j, 0] = impulse[j, 1] = impulse[j, 2] = 0.0
        if len(friction_loss) > 0:
            book(friction_loss, rubbed, before, j, -0.5)
            rubbed[j, 0] = rubbed[j, 1] = rubbed[j, 2] = 0.0


@njit(TASK, cache=True, error_model="numpy")
def _push_out(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: stops the nodes of a range at all walls, and adds half of the work of the impulses. Numbered comments in
    the code explain the steps for one node.

    The impulses are added to ``impulse``, the friction impulses also to ``rubbed``, and the impulses of each wall to
    ``given``. If a wall stopped a node, column 0 of ``pushed`` (threads, 8) is set to the time ``t``.
    """
    (
        x, v, mass, nodes, before, impulse, rubbed, given, loss, friction_loss, points, normals, friction, held,
        mirrored, pushed, dt, t,
    ) = _of_push(table)  # fmt: skip
    slide = pushed[thread, 1:4]
    for j in range(begin, end):
        a, any_moved = nodes[j], False
        for _ in range(_SWEEPS):
            moved = False
            for k in range(len(points)):
                # 1. Compute gap and velocity along the normal, and the square of the normal without ``mirrored``
                # components.
                gap, speed, along = 0.0, 0.0, 1.0
                for i in range(3):
                    gap += (x[a, i] - points[k, i]) * normals[k, i]
                    speed += v[a, i] * normals[k, i]
                    if mirrored[j, i]:
                        along -= normals[k, i] * normals[k, i]
                if held[j, k] and gap + dt * speed < 0.0 and along > ACROSS:
                    # 2. Compute the impulse that makes the gap at the end of the step zero.
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
                    # 3. Compute the friction impulse, which is at most mu times the normal impulse.
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
            # 4. Make another pass if a wall stopped the node and the node is between several walls.
            if not moved or len(points) == 1:
                break
        if any_moved:
            pushed[thread, 0] = t
            book(loss, impulse, before, j, -0.5)
            if len(friction_loss) > 0:
                book(friction_loss, rubbed, before, j, -0.5)
