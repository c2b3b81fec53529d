"""Energies and impulses of contact on one rank, summed for each node and each part."""

import numpy as np

from conoid.cases.model.schema import Case

from ..kernels.jit import njit, types
from ..migration.parcel import Parcel
from ..model.columns import ZERO
from ..model.state import Floats, Indices, Ints, Nodes
from ..parallel import fixed_point
from ..parallel.arguments import reader
from ..parallel.comm import Comm
from ..parallel.passes import Pass
from ..parallel.team import TASK, Team
from .account import Account
from .scene.scene import Scene
from .solver.impulse_work import book

_SLOTS = 2048
"""Number of slots in a task. Chosen value: a task takes about 20 us, compared with 2 us to start a parallel region."""
_F1, _F2, _N1 = types.float64[::1], types.float64[:, ::1], types.int32[::1]
_BOOK = _F1, _F1, _N1, _N1, _F2, types.int64[:, ::1], _F2, types.float64
_read = reader(*_BOOK)


@njit(TASK, cache=True)
def _book(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``impulse_work.book``."""
    loss, external, places, index, before, total, mobility, scale = _read(table)
    book(loss, external, places, index, before, total, mobility, scale, first, stop)


class Books:
    """Sums of the energies and impulses of contact. Half of the work of an impulse, computed with v(n-1/2), is added in
    the step that applies the impulse; the other half, computed with v(n+1/2), is added in the next step.
    """

    def __init__(self, nodes: Nodes, case: Case, impulse: float, energy: float, team: Team) -> None:
        """``impulse``, N s, and ``energy``, J: upper bounds of the impulse and of the energy at one node in one
        step.
        """
        self._book = Pass(team, _book, *_BOOK, size=_SLOTS)
        self.contact_loss = np.zeros(nodes.n)
        """(nodes,) energy lost by impact and friction, J."""
        self.external_work = np.zeros(nodes.n)
        """(nodes,) external work: work of the supports of held nodes against contact, J."""
        self.scale = fixed_point.scale_for(impulse)
        """Number of quanta per N s of an impulse."""
        self.friction = fixed_point.Tally(np.full(2, energy))
        """Two works of friction, J: the work so far; and the part of the work of the last step that the energy ledger
        does not contain yet."""
        self.account = Account(energy)
        self.agreed = self.account.words
        """Words of the account, summed over all ranks in the last reduction (account.py)."""
        parts, asked = len(case.parts), any(probe.by is not None for probe in case.probes)
        self.parts = np.zeros((parts, 3), np.int64)
        """(parts, 3) sum of the impulses on each part so far, quanta."""
        self.pairs = np.zeros((parts, parts, 3) if asked else (0, 0, 3), np.int64)
        """(parts, parts, 3) sum of the impulses so far on each part (first index) from each other part, quanta. The
        array is (0, 0, 3) if no probe of the case has the key ``by``."""
        self.pressed = np.zeros((nodes.n if "contact_pressure" in case.run.fields else 0, 3), np.int64)
        """(nodes, 3) sum of the impulses since the last frame, quanta; (0, 3) if the field ``contact_pressure`` is not
        requested."""
        # The energies and impulses of a copy of a node start with zero; the parent keeps its values.
        nodes.columns.declare(self, contact_loss=ZERO, external_work=ZERO, pressed=ZERO)
        self.open: Ints = np.zeros((0, 3), np.int64)
        """(nodes, 3) impulses of the last step before a restart or a repartition, quanta. After the work of the
        impulses from before a restart was added, the array has the shape (0, 3)."""

    def keep(self, parcel: Parcel, scene: Scene | None) -> None:
        """Adds all sums to the ``parcel`` (a checkpoint or migration message). If there is a scene, the impulses of the
        last step are read from the ``scene``.
        """
        parcel.nodes["contact.contact_loss"] = self.contact_loss
        parcel.nodes["contact.external_work"] = self.external_work
        parcel.sums["contact.parts"], parcel.sums["contact.friction"] = self.parts, self.friction.words
        parcel.sums["contact.account"], parcel.sums["contact.pairs"] = self.account.words, self.pairs
        if len(self.pressed):
            parcel.nodes["contact.pressed"] = self.pressed
        total = np.array(self.open) if len(self.open) else np.zeros((len(self.contact_loss), 3), np.int64)
        if scene is not None:
            total[scene.own.local] = scene.slots.total[scene.own.slots]
        parcel.nodes["contact.total"] = total

    def resume(self, parcel: Parcel, known: tuple[float, float, float, float]) -> None:
        """Restores the sums from the ``parcel`` (a checkpoint or migration message). ``known``: values of the
        account.
        """
        self.contact_loss = np.array(parcel.nodes["contact.contact_loss"])
        self.external_work = np.array(parcel.nodes["contact.external_work"])
        self.account.resume(parcel.sums["contact.account"], known)
        self.parts, self.friction.words = parcel.sums["contact.parts"], parcel.sums["contact.friction"]
        if "contact.pressed" in parcel.nodes:
            self.pressed = np.array(parcel.nodes["contact.pressed"])
        self.pairs, self.open = parcel.sums["contact.pairs"], parcel.nodes["contact.total"]

    @staticmethod
    def friction_work(friction: Floats) -> float:
        """Heat of friction of all ranks at time n, J, without the half of the work of the last step that
        ``contact_loss`` does not contain yet. ``friction``: sums over all ranks.
        """
        work, later = friction
        return float(work - later)

    def impulses(self, comm: Comm) -> Floats:
        """(parts, 3) sum of the contact impulses on each part so far, N s. Collective."""
        return np.asarray(comm.sum(self.parts) / self.scale)

    def between(self, comm: Comm) -> Floats:
        """(parts, parts, 3) sum of the contact impulses on each part from each other part so far, N s. Collective."""
        return np.asarray(comm.sum(self.pairs) / self.scale)

    def due(self) -> None:
        """Sets the outstanding half of the work of friction to zero, because the next call of ``book`` adds that
        half.
        """
        self.friction.words[:, 1] = 0

    def press(self, scene: Scene) -> None:
        """Adds the impulses of the step to the impulses since the last frame, if the contact pressure is requested."""
        if len(self.pressed):
            self.pressed[scene.own.local] += scene.slots.total[scene.own.slots]

    def book(self, scene: Scene, places: Indices) -> None:
        """Adds half of the work of the last impulses at the slots ``places`` of the scene, computed with the velocities
        ``before``. The solver adds the other half.
        """
        self._book.run(
            len(places), self.contact_loss, self.external_work, places, scene.surface_nodes.local, scene.slots.before,
            scene.slots.total, scene.surface_nodes.mobility, self.scale,
        )  # fmt: skip

    def book_resumed(self, nodes: Nodes, mobility: Floats) -> None:
        """Adds the second half of the work of impulses from before a restart or a repartition. ``mobility`` (nodes, 3),
        1/kg.
        """
        if len(self.open):
            some = np.flatnonzero(self.open.any(axis=1)).astype(np.int32)
            every = np.arange(len(self.open), dtype=np.int32)
            self._book.run(
                len(some), self.contact_loss, self.external_work, some, every, nodes.v, self.open, mobility, self.scale
            )  # fmt: skip
            self.open = self.open[:0]
