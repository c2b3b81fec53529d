"""Symmetry planes for nodes that do not start on the plane. A node that reaches the plane hits its own mirror image
there.

A node with tets and its image exert equal forces on each other, so that neither of the two passes the plane: the plane
acts as a wall on each side. Nodes without tets do not interact. A node without tets passes its image and is replaced by
the image, with mirrored position and velocity. Therefore a plane reflects debris without loss of energy.
"""

from typing import Self

import numpy as np

from conoid.cases.model.schema import Case, Symmetry

from ..clock import DT
from ..kernels.jit import njit, types
from ..model.growing import extended
from ..model.state import Bits, Flags, Floats, Indices, Ints, Model, Nodes
from ..parallel.arguments import Arguments, Follow, reader
from ..parallel.comm import Comm
from ..parallel.team import TASK, Stage
from ..rigid.bodies import of_nodes
from ..scene.conditions import AXES, node_sides, part_sides
from .boundaries import Boundary, driven, free

_TOGETHER = 64
"""Number of nodes that are tested together in one loop with vector instructions. Nodes are tested one by one only if at
least one of them would end beyond the plane."""
_TURNS = 1000
"""Largest number of planes that a node without tets may pass in a step. The limit ends the loop over planes if the
velocity is not finite."""


_F, _F1, _F2, _I1 = types.float64, types.float64[::1], types.float64[:, ::1], types.int64[::1]
_TAKE = _F2, _F2, _F1, _F2, types.int32[::1]
_STOP = _F2, _F2, _F2, _F2, _F1, _F1, types.int32[::1], _I1, _F1, _F2, _F, _F
_of_take, _of_stop = reader(*_TAKE), reader(*_STOP)


class Mirrors(Boundary):
    """Prevents nodes that started on one side of a symmetry plane from ending a step on the other side. For a node with
    tets, an impulse stops the node at the plane; the impulse never pulls. A node without tets is reflected.
    """

    after_contact = True

    def __init__(
        self, nodes: Indices, axes: Ints, at: Floats, sides: Floats, restitution: float = 0.0,
        loose_sides: Floats | None = None,
    ) -> None:  # fmt: skip
        """``axes`` (planes,), ``at`` (planes,): axis across each plane, and coordinate of the plane, m. ``sides`` (n,
        planes): 1 for a node above the plane, -1 below, 0 for a node that the plane does not stop. ``restitution``:
        coefficient as in contact; ``loose_sides``: the values of ``sides`` for a node that has lost its tets; None if
        these are equal to ``sides``.
        """
        super().__init__(nodes)
        self._axes, self._at, self._sides, self._restitution = axes, at, sides, restitution
        self._loose_sides = sides.copy() if loose_sides is None else loose_sides
        self._loose: Ints = np.zeros(0, np.int64)
        """Places of the nodes without tets. A place is an index in the arrays of the boundary."""
        self._reflected: Ints = np.zeros(0, np.int64)
        self._aside = np.zeros((0, 3))
        """Places of the nodes that are reflected in this step; and vectors from the new positions of these nodes to the
        positions of their images, m."""
        self._takes, self._stops = Arguments(*_TAKE), Arguments(*_STOP)

    @classmethod
    def of(cls, case: Case, model: Model, bounds: list[Boundary], comm: Comm) -> Self:
        """Returns the symmetry planes of a case with two kinds of nodes: nodes that start beside a plane, and nodes
        that may pass a plane after they have lost their tets. Nodes with a prescribed motion and nodes of rigid parts
        are left out. Collective.
        """
        specs, of = [spec for _, spec in case.boundaries_of(Symmetry)], model.nodes.part
        axes, at = np.array([AXES[spec.axis] for spec in specs]), np.array([spec.at for spec in specs])
        held = np.column_stack([node_sides(case, spec, model, comm) for spec in specs])
        body = np.column_stack([part_sides(case, spec, model, comm)[of] for spec in specs])
        wears = np.array([part.erosion is not None for part in case.parts])[of]
        loose = np.where((held == 0.0) & wears[:, None], body, held)
        some = loose.any(axis=1) & ~driven(model.nodes.n, bounds) & (of_nodes(case, model.nodes) < 0)
        back = case.contact.restitution if case.contact is not None else 0.0
        return cls(np.flatnonzero(some).astype(np.int32), axes, at, held[some], back, loose[some])

    def held_components(self) -> Bits:
        return free(self.nodes)

    def release(self, loose: Flags, bounds: list[Boundary]) -> None:
        self._loose = np.flatnonzero(loose[self.nodes])
        self._sides[self._loose] = 0.0

    def _inherit(self, at: Ints) -> None:
        self._sides = extended(self._sides, self._sides[at])
        self._loose_sides = extended(self._loose_sides, self._loose_sides[at])

    def note(self, state: Nodes) -> None:
        self.over.run(_take, self._takes.set(*self._noted(state)), len(self.nodes))

    def noting(self, state: Nodes) -> list[Stage]:
        return self.over.stages(_take, self._takes.set(*self._noted(state)), (), len(self.nodes))

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        self.over.run(_stop, self._stops.set(*self._of(state), dt), len(self.nodes))
        if len(self._loose):
            self._reflected, self._aside = _reflect(
                state.x, state.v, self._impulse, state.mass, self.nodes, self._loose, self._axes, self._at,
                self._loose_sides, dt,
            )  # fmt: skip
            _book_all(self.contact_loss, self._impulse, self._before, self._reflected)

    def acting(self, state: Nodes) -> list[Stage] | None:
        if len(self._loose):
            return None
        return self.over.stages(_stop, *self._stops.bind(*self._of(state), Follow(DT)), len(self.nodes))

    def _noted(self, state: Nodes) -> tuple[Floats | Indices, ...]:
        """Returns the arguments of the kernel ``_take``."""
        return self._before, self._impulse, self.contact_loss, state.v, self.nodes

    def _of(self, state: Nodes) -> tuple[Floats | Ints | Indices | float, ...]:
        """Returns the arguments of the kernel ``_stop``, without the time step."""
        return (
            state.x, state.v, self._before, self._impulse, self.contact_loss, state.mass, self.nodes, self._axes,
            self._at, self._sides, self._restitution,
        )  # fmt: skip

    def after_move(self, state: Nodes) -> None:
        if len(self._reflected):
            state.x[self.nodes[self._reflected]] += self._aside
            self._reflected, self._aside = self._reflected[:0], self._aside[:0]


@njit("void(float64[::1], float64[:, ::1], float64[:, ::1], int64)", cache=True)
def _book(loss, impulse, before, j):  # type: ignore[no-untyped-def]
    """Adds half of the work of the impulse at place ``j`` to the ``loss``, computed with the velocity ``before``."""
    for i in range(3):
        loss[j] -= 0.5 * impulse[j, i] * before[j, i]


@njit("void(float64[::1], float64[:, ::1], float64[:, ::1], int64[::1])", cache=True)
def _book_all(loss, impulse, before, rows):  # type: ignore[no-untyped-def]
    """Runs ``_book`` for the given ``rows``."""
    for j in rows:
        _book(loss, impulse, before, j)


@njit("boolean(float64[:, ::1], int64)", cache=True)
def _stopped(impulse, j):  # type: ignore[no-untyped-def]
    """Returns True if the node at place ``j`` has an impulse."""
    return impulse[j, 0] != 0.0 or impulse[j, 1] != 0.0 or impulse[j, 2] != 0.0


@njit(TASK, cache=True)
def _take(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: stores v(n-1/2), adds the second half of the work of the last impulses, and sets the impulses to zero."""
    before, impulse, loss, v, nodes = _of_take(table)
    for j in range(begin, end):
        for i in range(3):
            before[j, i] = v[nodes[j], i]
        if _stopped(impulse, j):
            _book(loss, impulse, before, j)
            impulse[j, 0] = impulse[j, 1] = impulse[j, 2] = 0.0


@njit(TASK, cache=True, error_model="numpy")
def _stop(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: stops nodes with tets that would end beyond a plane. The node ends on the plane, or with ``restitution``
    gets the rebound velocity of v(n-1/2) (``before`` (n, 3)). Adds the impulses to ``impulse``, and half of their work
    to ``loss``.
    """
    x, v, before, impulse, loss, mass, nodes, axes, at, sides, restitution, dt = _of_stop(table)
    for first in range(begin, end, _TOGETHER):
        last, met = min(first + _TOGETHER, end), 0
        for k in range(len(axes)):
            i, plane = axes[k], at[k]
            for j in range(first, last):
                a = nodes[j]
                met += sides[j, k] * (x[a, i] - plane + dt * v[a, i]) < 0.0
        if not met:
            continue
        for j in range(first, last):
            a = nodes[j]
            for k in range(len(axes)):
                i, side = axes[k], sides[j, k]
                height, speed = side * (x[a, i] - at[k]), side * v[a, i]
                if height + dt * speed < 0.0:
                    back = -restitution * side * before[j, i]
                    change = side * (max(-height / dt, back if back > 0.0 else -np.inf) - speed)
                    v[a, i] += change
                    impulse[j, i] += mass[a] * change
            if _stopped(impulse, j):
                _book(loss, impulse, before, j)


@njit(
    "Tuple((int64[::1], float64[:, ::1]))(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], "
    "int32[::1], int64[::1], int64[::1], float64[::1], float64[:, ::1], float64)",
    cache=True,
)
def _reflect(x, v, impulse, mass, nodes, rows, axes, at, sides, dt):  # type: ignore[no-untyped-def]
    """Reflects the nodes at the places ``rows``, which would end the step beyond planes. Each node gets the velocity of
    its last image. Adds the impulses to ``impulse``. Returns the places of the reflected nodes, and (n, 3) the vectors
    from their positions at the end of the step to the positions of their images, m.
    """
    turned, aside, n = np.empty(len(rows), np.int64), np.zeros((len(rows), 3)), 0
    for j in rows:
        a, any_turns = nodes[j], False
        for i in range(3):
            end, turns = x[a, i] + dt * v[a, i], 0
            before = -1
            while before < turns < _TURNS:
                before = turns
                for k in range(len(axes)):
                    if axes[k] == i and sides[j, k] * (end - at[k]) < 0.0:
                        end = 2.0 * at[k] - end
                        turns += 1
            if turns % 2 == 1:
                impulse[j, i] -= 2.0 * mass[a] * v[a, i]
                v[a, i] = -v[a, i]
            if turns > 0:
                aside[n, i] = end - (x[a, i] + dt * v[a, i])
                any_turns = True
        if any_turns:
            turned[n] = j
            n += 1
    return turned[:n].copy(), aside[:n].copy()
