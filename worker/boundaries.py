"""What acts on velocities between kick and move: symmetry planes and walls here, what drives a body in drivers.py.

Each books the work that it does on the body. An impulse at time n does it in two halves, with the velocity before and
after: at time n only the first has been spent (the kinetic energy of the ledger is 1/2 m v(n-1/2) . v(n+1/2)), and the
second is booked when ``note`` is called before the next kick.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable

import numpy as np

from .growing import Rooms
from .jit import njit
from .migration.parcel import Parcel, length
from .state import Bits, Flags, Floats, Indices, Ints, Nodes, extended
from .topology import Split

FREE, PRESCRIBED, MIRRORED = range(3)
"""What a boundary does to a velocity component: it may change it by forces and impulses only; it sets it; it sets it to
zero because the node lies on a plane of symmetry across that axis."""
_SWEEPS = 4
"""Times a node is taken to each wall. Chosen: two walls at right angles take one; what a sharper corner leaves after
four is taken in the next step."""
_ACROSS = 1e-12
"""Of a wall's unit normal, what is left of its square along the planes of symmetry that hold a node: with less the wall
lies along a plane and cannot push the node. Chosen far above rounding (1e-32) and below any angle that is meant."""
KEPT = ("contact_loss", "external_work", "_impulse")
"""What every boundary remembers of its nodes."""


class Boundary(ABC):
    """What the time step asks of a boundary."""

    after_contact = False
    """Whether it acts after contact: nothing may undo what it corrects."""
    mirrors = False
    """Whether its nodes lie on one plane in which the body is mirrored: exposed faces in that plane are no surface."""
    on_faces = False
    """Whether it acts on faces of tets, not on nodes."""

    def __init__(self, nodes: Indices) -> None:
        self.nodes = nodes
        self.contact_loss = np.zeros(len(nodes))
        """(n,) energy lost by impact on the boundary, J."""
        self.external_work = np.zeros(len(nodes))
        """(n,) work done on the body from outside, J."""
        self.last_push = 0.0
        """Last time at which the boundary pushed, s."""

        self._before = np.zeros((len(nodes), 3))
        """(n, 3) v(n-1/2), m/s."""
        self._impulse = np.zeros((len(nodes), 3))
        """(n, 3) of the last step, N s."""
        self._rooms = Rooms("nodes", *KEPT, "_before")

    @abstractmethod
    def held_components(self) -> Bits:
        """(n, 3) FREE, PRESCRIBED or MIRRORED. What is not FREE has no mobility in contact."""

    def start(self, state: Nodes) -> None:  # noqa: B027 (forces agree with any velocity)
        """Makes the initial velocities agree with the boundary."""

    def note(self, state: Nodes) -> None:  # noqa: B027 (a symmetry plane does no work)
        """Before the kick: keeps v(n-1/2), and books the second half of the last impulses' work."""

    def mirror(self, vectors: Floats) -> None:  # noqa: B027 (most boundaries mirror nothing)
        """Takes what the mirror image cancels out of the means of ``vectors`` (nodes, 3) over the tets of its nodes."""

    @abstractmethod
    def apply(self, state: Nodes, dt: float, t: float) -> None:
        """Corrects v(n+1/2) at time ``t``, s; ``dt`` is the step ahead, s."""

    def grow(self, split: Split, ids: Ints) -> None:
        """Takes up the copies of its nodes; ``ids``: of the local nodes.

        What has been booked, and the impulse of the last step, stay with the parent.
        """
        parents, n = split.copies.parents, len(self.nodes)
        rooms = self._rooms.of(self, len(parents))
        at = _inherit(*rooms, n, parents, split.first)
        if len(at):
            self._rooms.take(self, n + len(at))
            self._inherit(at)

    def drop(self, tets: Ints) -> None:  # noqa: B027 (most boundaries act on nodes)
        """Tets with these global ids have left, on any rank; what is ``on_faces`` of theirs goes with them."""

    def keep(self, parcel: Parcel, name: str) -> None:
        """Adds what the boundary must remember to a parcel, under its ``name``."""
        for key in KEPT:
            values = getattr(self, key)
            column = np.zeros((length(parcel.nodes), *values.shape[1:]))
            column[self.nodes] = values
            parcel.nodes[f"{name}.{key}"] = column

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        """Takes it back; ``dt``: of the last step, s."""
        for key in KEPT:
            setattr(self, key, parcel.nodes[f"{name}.{key}"][self.nodes])
        self._before = np.zeros((len(self.nodes), 3))

    def _inherit(self, at: Ints) -> None:  # noqa: B027 (a boundary of its own may keep more by node)
        """Takes up copies of the nodes at the places ``at``; they stand behind all nodes."""


class SymmetryPlane(Boundary):
    """Nodes that start on a plane across an axis have no velocity along it."""

    mirrors = True

    def __init__(self, nodes: Indices, axis: int) -> None:
        super().__init__(nodes)
        self._axis = axis

    def held_components(self) -> Bits:
        held = free(self.nodes)
        held[:, self._axis] = MIRRORED
        return held

    def start(self, state: Nodes) -> None:
        _hold(state.v, self.nodes, self._axis)

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        _hold(state.v, self.nodes, self._axis)

    def mirror(self, vectors: Floats) -> None:
        _hold(vectors, self.nodes, self._axis)


class RigidWalls(Boundary):
    """No node ends the step behind a wall: an impulse along its normal stops the node there, never pulls.

    ``points`` and ``normals`` (w, 3), ``held`` (n, w): which walls hold which node. A node between two walls is taken
    to each in turn, a few times. ``mirrored`` (n, 3): the components that planes of symmetry hold, none if not given; a
    wall that is not at right angles to a plane pushes the nodes on it along it, and the plane takes the rest.
    """

    after_contact = True

    def __init__(
        self, nodes: Indices, points: Floats, normals: Floats, held: Flags, mirrored: Flags | None = None
    ) -> None:
        super().__init__(nodes)
        self._mirrored = np.zeros((len(nodes), 3), bool) if mirrored is None else mirrored
        self._points = points
        self._normals = normals / np.linalg.norm(normals, axis=1)[:, None]
        self._held = held
        self._pushed = False
        self.given = np.zeros((len(nodes), 3 * len(points)))
        """(n, 3 walls) what each wall has given each node so far, N s."""

    def held_components(self) -> Bits:
        return free(self.nodes)

    def depths(self, state: Nodes) -> Floats:
        """(w,) how deep the deepest node starts behind each wall, m."""
        depths = np.full(len(self._points), -np.inf)
        for k, (point, normal) in enumerate(zip(self._points, self._normals, strict=True)):
            behind = ((point - state.x[self.nodes[self._held[:, k]]]) * normal).sum(axis=1)
            depths[k] = behind.max(initial=-np.inf)
        return depths

    def _inherit(self, at: Ints) -> None:
        self._held = extended(self._held, self._held[at])
        self._mirrored = extended(self._mirrored, self._mirrored[at])
        self.given = extended(self.given, np.zeros((len(at), self.given.shape[1])))

    def keep(self, parcel: Parcel, name: str) -> None:
        super().keep(parcel, name)
        column = np.zeros((length(parcel.nodes), self.given.shape[1]))
        column[self.nodes] = self.given
        parcel.nodes[f"{name}.given"] = column

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        super().resume(parcel, name, dt)
        self.given = parcel.nodes[f"{name}.given"][self.nodes]
        self._pushed = True

    def note(self, state: Nodes) -> None:
        self._before = state.v[self.nodes]
        if self._pushed:
            self._book()
            self._impulse[:] = 0.0

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        self._pushed = _push_out(
            state.x,
            state.v,
            self._impulse,
            self.given,
            state.mass,
            self.nodes,
            self._points,
            self._normals,
            self._held,
            self._mirrored,
            dt,
        )
        if self._pushed:
            self.last_push = t
            self._book()

    def _book(self) -> None:
        book_half(self.contact_loss, self._impulse, self._before, -0.5)


def mirrored(n: int, bounds: Iterable[Boundary]) -> Flags:
    """(n, 3) which components of the velocities of ``n`` nodes planes of symmetry hold."""
    found = np.zeros((n, 3), bool)
    for bound in bounds:
        found[bound.nodes] |= bound.held_components() == MIRRORED
    return found


def driven(n: int, bounds: Iterable[Boundary]) -> Flags:
    """(n,) which of ``n`` nodes have a component of their velocity prescribed."""
    found = np.zeros(n, bool)
    for bound in bounds:
        found[bound.nodes] |= (bound.held_components() == PRESCRIBED).any(axis=1)
    return found


def free(nodes: Indices) -> Bits:
    """(n, 3) what a boundary holds that holds nothing."""
    return np.full((len(nodes), 3), FREE, np.uint8)


@njit(
    "int64[::1](int32[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], int64, int64[::1], int64)",
    cache=True,
)
def _inherit(nodes, loss, work, impulse, before, n, parents, first):  # type: ignore[no-untyped-def]
    """Rows from ``n`` on of the rooms of a boundary's columns, for the copies of its nodes: ``first`` is the local
    index of the first copy, ``parents`` (copies,) are ascending. Returns the places of their parents among the ``n``.
    """
    at, k = np.empty(len(parents), np.int64), 0
    for c in range(len(parents)):
        p = np.searchsorted(nodes[:n], parents[c])
        if p == n or nodes[p] != parents[c]:
            continue
        nodes[n + k], loss[n + k], work[n + k] = first + c, 0.0, 0.0
        for i in range(3):
            impulse[n + k, i], before[n + k, i] = 0.0, before[p, i]
        at[k] = p
        k += 1
    return at[:k].copy()


@njit("void(float64[::1], float64[:, ::1], float64[:, ::1], float64)", cache=True)
def book_half(account, impulse, v, factor):  # type: ignore[no-untyped-def]
    """Adds ``factor``, a half with a sign, times the work of the impulses (n, 3) at velocities ``v`` (n, 3) to an
    ``account`` (n,), J.
    """
    for j in range(len(account)):
        work = 0.0
        for i in range(3):
            work += impulse[j, i] * v[j, i]
        account[j] += factor * work


@njit("void(float64[:, ::1], int32[::1], int64)", cache=True)
def _hold(v, nodes, axis):  # type: ignore[no-untyped-def]
    for a in nodes:
        v[a, axis] = 0.0


@njit(
    "boolean(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], int32[::1], "
    "float64[:, ::1], float64[:, ::1], boolean[:, ::1], boolean[:, ::1], float64)",
    cache=True,
    error_model="numpy",
)
def _push_out(x, v, impulse, given, mass, nodes, points, normals, held, mirrored, dt):  # type: ignore[no-untyped-def]
    """Impulse form: the gap at the end of the step is never negative; the impulse is along what is left of the normal
    without the ``mirrored`` components. Adds to ``impulse`` and to what each wall has ``given``; whether a wall pushed.
    """
    pushed = False
    for j in range(len(nodes)):
        a = nodes[j]
        for _ in range(_SWEEPS):
            moved = False
            for k in range(len(points)):
                gap, speed, along = 0.0, 0.0, 1.0
                for i in range(3):
                    gap += (x[a, i] - points[k, i]) * normals[k, i]
                    speed += v[a, i] * normals[k, i]
                    if mirrored[j, i]:
                        along -= normals[k, i] * normals[k, i]
                if held[j, k] and gap + dt * speed < 0.0 and along > _ACROSS:
                    for i in range(3):
                        if mirrored[j, i]:
                            continue
                        change = -(gap / dt + speed) / along * normals[k, i]
                        v[a, i] += change
                        impulse[j, i] += mass[a] * change
                        given[j, 3 * k + i] += mass[a] * change
                    moved = pushed = True
            if not moved or len(points) == 1:
                break
    return pushed
