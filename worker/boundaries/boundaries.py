"""What acts on velocities between kick and move: symmetry planes here, walls in walls.py, what drives in drivers.py.

Each books the work that it does on the body. An impulse at time n does it in two halves, with the velocity before and
after: at time n only the first has been spent (the kinetic energy of the ledger is 1/2 m v(n-1/2) . v(n+1/2)), and the
second is booked when ``note`` is called before the next kick.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np

from ..kernels.jit import njit
from ..migration.parcel import Parcel, length
from ..model.growing import Rooms
from ..model.state import Bits, Flags, Floats, Indices, Ints, Nodes, extended
from ..model.topology import Split
from ..parallel.arguments import Arguments
from ..parallel.passes import Ranges
from ..parallel.team import team
from . import impulses

FREE, PRESCRIBED, MIRRORED = range(3)
"""What a boundary does to a velocity component: it may change it by forces and impulses only; it sets it; it sets it to
zero because the node lies on a plane of symmetry across that axis."""
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
        self.given: Floats | None = None
        """(n, 3 walls) what each wall has given each node so far, N s; none of what is no wall."""
        self.friction_loss: Floats | None = None
        """(n,) what of ``contact_loss`` friction has taken, J; none where there is no friction."""
        self.last_push = 0.0
        """Last time at which the boundary pushed, s."""

        self._before = np.zeros((len(nodes), 3))
        """(n, 3) v(n-1/2), m/s."""
        self._impulse = np.zeros((len(nodes), 3))
        """(n, 3) of the last step, N s."""
        self.over = Ranges(team(1))
        """Whose threads go over its nodes."""
        self._notes = Arguments(*impulses.NOTE)
        self._rooms = Rooms("nodes", *KEPT, "_before")
        self._kept: tuple[str, ...] = KEPT
        """What it remembers of its nodes."""

    @abstractmethod
    def held_components(self) -> Bits:
        """(n, 3) FREE, PRESCRIBED or MIRRORED. What is not FREE has no mobility in contact."""

    def start(self, state: Nodes) -> None:  # noqa: B027 (forces agree with any velocity)
        """Makes the initial velocities agree with the boundary."""

    def note(self, state: Nodes) -> None:  # noqa: B027 (a symmetry plane does no work)
        """Before the kick: keeps v(n-1/2), and books the second half of the last impulses' work."""

    def _note(self, state: Nodes, account: Floats, factor: float) -> None:
        """``note`` with an account of the work of its impulses, J; ``factor``: a half with its sign there."""
        table = self._notes.set(state.v, self.nodes, self._before, self._impulse, account, factor)
        self.over.run(impulses.note, table, len(self.nodes))

    def measure(self, mass: float, speed: float) -> None:  # noqa: B027 (most add up no integers of their own)
        """The quanta, by the largest nodal ``mass``, kg, and ``speed``, m/s, of the scene."""

    def mirror(self, vectors: Floats) -> None:  # noqa: B027 (most boundaries mirror nothing)
        """Takes what the mirror image cancels out of the means of ``vectors`` (nodes, 3) over the tets of its nodes."""

    @abstractmethod
    def apply(self, state: Nodes, dt: float, t: float) -> None:
        """Corrects v(n+1/2) at time ``t``, s; ``dt`` is the step ahead, s."""

    def after_move(self, state: Nodes) -> None:  # noqa: B027 (most boundaries act on velocities alone)
        """Corrects x(n+1)."""

    def release(self, loose: Flags, bounds: "list[Boundary]") -> None:  # noqa: B027 (most hold a node, tets or not)
        """Nodes without tets that fly on, ``loose`` (nodes,), are particles from now on; ``bounds``: all of the scene,
        those before this one have released theirs.
        """

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
        for key in self._kept:
            values = getattr(self, key)
            column = np.zeros((length(parcel.nodes), *values.shape[1:]))
            column[self.nodes] = values
            parcel.nodes[f"{name}.{key}"] = column

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        """Takes it back; ``dt``: of the last step, s."""
        for key in self._kept:
            setattr(self, key, parcel.nodes[f"{name}.{key}"][self.nodes])
        self._before = np.zeros((len(self.nodes), 3))

    def free(self) -> None:  # noqa: B027 (most boundaries send no messages)
        """Gives all standing messages back to MPI."""

    def _inherit(self, at: Ints) -> None:  # noqa: B027 (a boundary of its own may keep more by node)
        """Takes up copies of the nodes at the places ``at``; they stand behind all nodes."""


class Stopping(Boundary):
    """Walls: they stop nodes, and add up the impulses that they give."""

    after_contact = True

    def __init__(self, nodes: Indices, walls: int, *, tells: bool) -> None:
        """So many ``walls``; ``tells``: whether ``since_told`` will be called."""
        super().__init__(nodes)
        self.given: Floats = np.zeros((len(nodes), 3 * walls))
        self._kept = (*KEPT, "given")
        if tells:
            self._told = self.given.copy()
            self._kept = (*self._kept, "_told")

    def since_told(self) -> Floats:
        """(n, 3) what the walls have given each node since this was last asked, N s."""
        found = (self.given - self._told).reshape(len(self.given), -1, 3).sum(axis=1)
        self._told[:] = self.given
        return np.asarray(found)


class SymmetryPlane(Boundary):
    """Nodes that start on a plane across an axis have no velocity along it, while they have tets: these are mirrored,
    and hold the node on the plane. A node without tets and its images are particles (mirrors.py).
    """

    mirrors = True

    def __init__(self, nodes: Indices, axis: int, beside: Flags | None = None) -> None:
        """``beside`` (n,): nodes of bodies that lie on one side of the plane, where their images are on the other; all
        if not given. A node of a body that lies on both sides stays on the plane.
        """
        super().__init__(nodes)
        self._axis = axis
        self._beside = np.ones(len(nodes), bool) if beside is None else beside

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

    def release(self, loose: Flags, bounds: list[Boundary]) -> None:
        stay = ~(loose[self.nodes] & self._beside)
        if not stay.all():
            for name in ("nodes", "_beside", "_before", *KEPT):
                setattr(self, name, getattr(self, name)[stay])

    def _inherit(self, at: Ints) -> None:
        self._beside = extended(self._beside, self._beside[at])


@dataclass(frozen=True)
class Acts:
    """The boundaries that have something to do at each place of a step, in the order in which they act."""

    boundaries: int
    """Number of all."""
    noting: tuple[Boundary, ...]
    before_contact: tuple[Boundary, ...]
    after_contact: tuple[Boundary, ...]
    moving: tuple[Boundary, ...]

    @classmethod
    def of(cls, scene: list[Boundary]) -> Self:
        """Those of a scene."""
        return cls(
            len(scene),
            tuple(each for each in scene if type(each).note is not Boundary.note),
            tuple(each for each in scene if not each.after_contact),
            tuple(each for each in scene if each.after_contact),
            tuple(each for each in scene if type(each).after_move is not Boundary.after_move),
        )


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


@njit("void(float64[:, ::1], int32[::1], int64)", cache=True)
def _hold(v, nodes, axis):  # type: ignore[no-untyped-def]
    for a in nodes:
        v[a, axis] = 0.0
