"""Boundary conditions on velocities, applied between the kick and the move. Symmetry planes are in this file, walls in
walls.py, loads and prescribed motion in drivers.py.

Each boundary has an account of the work of its impulses on the body. The work of an impulse at time n is added in two
halves: the first is computed with the velocity before the impulse, the second with the velocity after it. The kinetic
energy of the energy balance at n, 1/2 m v(n-1/2) . v(n+1/2), contains the first half only. The method ``note`` adds the
second half before the next kick.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np

from ..kernels.jit import njit
from ..migration.parcel import Parcel, length
from ..model.growing import Rooms, extended
from ..model.state import Bits, Flags, Floats, Indices, Ints, Nodes
from ..model.topology import Split
from ..parallel.arguments import Arguments
from ..parallel.passes import Ranges
from ..parallel.team import Stage, team
from . import impulses

FREE, PRESCRIBED, MIRRORED = range(3)
"""Effect of a boundary on a velocity component. FREE: only forces and impulses change the component; PRESCRIBED: the
component has a given value; MIRRORED: the component is zero, because the node lies on a symmetry plane across this
axis."""
KEPT = ("contact_loss", "external_work", "_impulse")
"""Names of the columns with one row for each node that every boundary stores in a checkpoint."""


class Boundary(ABC):
    """Interface between a boundary and the time step."""

    after_contact = False
    """True if the boundary acts after contact, because contact must not change the velocities that the boundary has
    corrected."""
    mirrors = False
    """True if all nodes of the boundary lie on one plane in which the body is mirrored. Exposed faces in the plane of
    the boundary do not belong to the surface."""
    on_faces = False
    """True if the boundary acts on faces of tets, not on nodes."""

    def __init__(self, nodes: Indices) -> None:
        self.nodes = nodes
        self.contact_loss = np.zeros(len(nodes))
        """(n,) energy lost by impact of each node on the boundary, J."""
        self.external_work = np.zeros(len(nodes))
        """(n,) external work done on each node, J."""
        self.given: Floats | None = None
        """(n, 3 walls) sum of the impulses of each wall on each node so far, N s; None if the boundary is not a
        wall."""
        self.friction_loss: Floats | None = None
        """(n,) part of ``contact_loss`` that is due to friction, J; None for a boundary without friction."""
        self.last_push = 0.0
        """Simulated time of the last impulse of the boundary, s."""

        self._before = np.zeros((len(nodes), 3))
        """(n, 3) velocity v(n-1/2) of each node, m/s."""
        self._impulse = np.zeros((len(nodes), 3))
        """(n, 3) impulse of the boundary on each node in the last step, N s."""
        self.over = Ranges(team(1))
        """Threads of the rank, with the ranges of the nodes of the boundary."""
        self._notes = Arguments(*impulses.NOTE)
        self._rooms = Rooms("nodes", *KEPT, "_before")
        self._kept: tuple[str, ...] = KEPT
        """Names of the columns with one row for each node that this boundary stores in a checkpoint."""

    @abstractmethod
    def held_components(self) -> Bits:
        """(n, 3) FREE, PRESCRIBED or MIRRORED for each velocity component. A component that is not FREE has no mobility
        in contact.
        """

    def start(self, state: Nodes) -> None:  # noqa: B027 (forces agree with any velocity)
        """Makes the initial velocities consistent with the boundary."""

    def note(self, state: Nodes) -> None:  # noqa: B027 (a symmetry plane does no work)
        """Stores v(n-1/2) before the kick. Adds the second half of the work of the last impulses to the account."""

    def _note(self, state: Nodes, account: Floats, factor: float) -> None:
        """Runs the kernel of ``note``. ``account``: work of the impulses, J; ``factor``: 1/2 with the sign that the
        work has in the account.
        """
        table = self._note_table(state, account, factor)
        self.over.run(impulses.note, table, len(self.nodes))

    def _note_table(self, state: Nodes, account: Floats, factor: float) -> int:
        return self._notes.set(state.v, self.nodes, self._before, self._impulse, account, factor)

    def noting(self, state: Nodes) -> list[Stage]:
        """Returns the kernels of ``note`` as stages of a program (stretch.py)."""
        return []

    def acting(self, state: Nodes) -> list[Stage] | None:
        """Returns the kernels of ``apply`` as stages of a program; None if code outside of the program is needed."""
        return None

    def mirroring(self, vectors: Floats) -> list[Stage]:
        """Returns the kernels of ``mirror`` as stages of a program."""
        return []

    def went_on(self, dt: float) -> None:  # noqa: B027 (most boundaries need no time step)
        """Sets the last time step to ``dt``, s; to be called after a program of steps."""

    def measure(self, mass: float, speed: float) -> None:  # noqa: B027 (most add up no integers of their own)
        """Chooses the quanta from the largest nodal ``mass``, kg, and the largest ``speed``, m/s, of the scene."""

    def mirror(self, vectors: Floats) -> None:  # noqa: B027 (most boundaries mirror nothing)
        """Sets components of the nodal means ``vectors`` (nodes, 3) to zero, if the mirror image of the body cancels
        them.
        """

    @abstractmethod
    def apply(self, state: Nodes, dt: float, t: float) -> None:
        """Corrects the velocities v(n+1/2) at the simulated time ``t``, s; ``dt``: time step, s."""

    def after_move(self, state: Nodes) -> None:  # noqa: B027 (most boundaries act on velocities alone)
        """Corrects the positions x(n+1)."""

    def release(self, loose: Flags, bounds: "list[Boundary]") -> None:  # noqa: B027 (most hold a node, tets or not)
        """Treats the nodes without tets, ``loose`` (nodes,), as particles after this call. ``bounds``: all boundaries.
        The boundaries before this one in the list have already released their nodes.
        """

    def grow(self, split: Split, ids: Ints) -> None:
        """Adds the copies of separated nodes of the boundary; ``ids``: global ids of the local nodes.

        The energies in the account and the impulse of the last step remain at the parent.
        """
        parents, n = split.copies.parents, len(self.nodes)
        rooms = self._rooms.of(self, len(parents))
        at = _inherit(*rooms, n, parents, split.first)
        if len(at):
            self._rooms.take(self, n + len(at))
            self._inherit(at)

    def drop(self, tets: Ints) -> None:  # noqa: B027 (most boundaries act on nodes)
        """Removes the loads on faces of ``tets``: global ids of tets that erosion has removed on any rank."""

    def keep(self, parcel: Parcel, name: str) -> None:
        """Adds the state of the boundary to a parcel (a checkpoint or migration message), under its ``name``."""
        for key in self._kept:
            values = getattr(self, key)
            column = np.zeros((length(parcel.nodes), *values.shape[1:]))
            column[self.nodes] = values
            parcel.nodes[f"{name}.{key}"] = column

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        """Restores the state from a parcel (a checkpoint or migration message). ``dt``: last time step, s."""
        for key in self._kept:
            setattr(self, key, parcel.nodes[f"{name}.{key}"][self.nodes])
        self._before = np.zeros((len(self.nodes), 3))

    def free(self) -> None:  # noqa: B027 (most boundaries send no messages)
        """Frees all persistent MPI messages."""

    def _inherit(self, at: Ints) -> None:  # noqa: B027 (a boundary of its own may keep more by node)
        """Extends the columns of this boundary by copies of the rows ``at``."""


class Stopping(Boundary):
    """Base class of walls. A wall stops nodes; the impulses of each wall on the nodes are summed."""

    after_contact = True

    def __init__(self, nodes: Indices, walls: int, *, reports: bool) -> None:
        """``walls``: number of walls; ``reports``: True if the run will call ``since_last_report``."""
        super().__init__(nodes)
        self.given: Floats = np.zeros((len(nodes), 3 * walls))
        self._kept = (*KEPT, "given")
        if reports:
            self._reported = self.given.copy()
            self._kept = (*self._kept, "_reported")

    def since_last_report(self) -> Floats:
        """(n, 3) impulses of the walls on each node since the last call, N s."""
        found = (self.given - self._reported).reshape(len(self.given), -1, 3).sum(axis=1)
        self._reported[:] = self.given
        return np.asarray(found)


class SymmetryPlane(Boundary):
    """Symmetry plane. A node that starts on the plane has no velocity across the plane while it has tets, because its
    tets and their mirror images hold it there. If the node has lost all tets, the node and its image are particles
    (mirrors.py).
    """

    mirrors = True

    def __init__(self, nodes: Indices, axis: int, beside: Flags | None = None) -> None:
        """``beside`` (n,): True for a node whose body lies on one side of the plane, with its mirror image on the other
        side; None if this is true for all bodies. If a body lies on both sides of the plane, its nodes remain on the
        plane.
        """
        super().__init__(nodes)
        self._axis = axis
        self._holds, self._mirrors = Arguments(*impulses.HOLD), Arguments(*impulses.HOLD)
        self._beside = np.ones(len(nodes), bool) if beside is None else beside

    def held_components(self) -> Bits:
        held = free(self.nodes)
        held[:, self._axis] = MIRRORED
        return held

    def start(self, state: Nodes) -> None:
        self.mirror(state.v)

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        self.mirror(state.v)

    def acting(self, state: Nodes) -> list[Stage]:
        return self._holding(self._holds, state.v)

    def mirror(self, vectors: Floats) -> None:
        self.over.run(impulses.hold, self._mirrors.set(vectors, self.nodes, self._axis), len(self.nodes))

    def mirroring(self, vectors: Floats) -> list[Stage]:
        return self._holding(self._mirrors, vectors)

    def _holding(self, arguments: Arguments, vectors: Floats) -> list[Stage]:
        return self.over.stages(impulses.hold, arguments.set(vectors, self.nodes, self._axis), (), len(self.nodes))

    def release(self, loose: Flags, bounds: list[Boundary]) -> None:
        stay = ~(loose[self.nodes] & self._beside)
        if not stay.all():
            for name in ("nodes", "_beside", "_before", *KEPT):
                setattr(self, name, getattr(self, name)[stay])

    def _inherit(self, at: Ints) -> None:
        self._beside = extended(self._beside, self._beside[at])


@dataclass(frozen=True)
class Acts:
    """Boundaries sorted by their position in the time step; within a position they have the order in which they act."""

    boundaries: int
    """Number of all boundaries."""
    noting: tuple[Boundary, ...]
    before_contact: tuple[Boundary, ...]
    after_contact: tuple[Boundary, ...]
    moving: tuple[Boundary, ...]

    @classmethod
    def of(cls, scene: list[Boundary]) -> Self:
        """Sorts the boundaries of a scene by their position in the time step."""
        return cls(
            len(scene),
            tuple(each for each in scene if type(each).note is not Boundary.note),
            tuple(each for each in scene if not each.after_contact),
            tuple(each for each in scene if each.after_contact),
            tuple(each for each in scene if type(each).after_move is not Boundary.after_move),
        )


def mirrored(n: int, bounds: Iterable[Boundary]) -> Flags:
    """Returns (n, 3) flags of velocity components: True if symmetry planes hold the component of the node."""
    found = np.zeros((n, 3), bool)
    for bound in bounds:
        found[bound.nodes] |= bound.held_components() == MIRRORED
    return found


def driven(n: int, bounds: Iterable[Boundary]) -> Flags:
    """Returns (n,) flags: True if a velocity component of the node is prescribed."""
    found = np.zeros(n, bool)
    for bound in bounds:
        found[bound.nodes] |= (bound.held_components() == PRESCRIBED).any(axis=1)
    return found


def free(nodes: Indices) -> Bits:
    """Returns (n, 3) FREE for all components."""
    return np.full((len(nodes), 3), FREE, np.uint8)


@njit(
    "int64[::1](int32[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], int64, int64[::1], int64)",
    cache=True,
)
def _inherit(nodes, loss, work, impulse, before, n, parents, first):  # type: ignore[no-untyped-def]
    """Fills the rows from ``n`` on of the columns of a boundary, for copies of its ``n`` nodes. ``first``: local index
    of the first copy; ``parents`` (copies,): local indices of the parents, ascending. Returns the rows of the parents.
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
