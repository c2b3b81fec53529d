"""Erosion: removes the tets that meet an erosion criterion, makes the free faces of their neighbours surface, and sums
the removed energy and momentum.

A tet is marked in the pass over the elements (elements/wear.py); at this time its force of n+1 is already in the nodal
sums. The tet is removed before the contact of the next step, so that this contact includes the exposed faces of its
neighbours. The last force of a removed tet acts in one more velocity update. Therefore the second half of the work of
the last force of a removed tet is added one step later, as for a boundary. Tets that exceed only a strain or damage
limit are collected for some steps and are then removed together, because each removal requires new mean normals. If a
part has ``erosion.nodes = "strike"``, those nodes of the part that have no tets and received a contact impulse are
removed in the same steps.
"""

import numpy as np

from conoid.cases.model.schema import Case

from .boundaries.boundaries import Boundary
from .clock import Clock
from .contact.stage import Contact
from .contact.surface import exposure
from .elements.wear import BROKEN, DAMAGED, FREQUENCY, SOUND, TIRED, life
from .erosion_account import ErosionAccount
from .fracture.removal import Removal
from .migration.parcel import Parcel
from .model.columns import COPIED
from .model.rows import DAMAGE
from .model.state import Flags, Floats, Ints, Model, Nodes
from .parallel.comm import Comm
from .parallel.ownership import Neighbour, complete
from .parallel.tags import Tag

GATHERED = 10
"""Number of steps for which marked tets are collected before they are removed together. Chosen value: it is above 1,
because each removal requires new mean normals and tests of all candidate pairs."""
UNDECIDED = 0.25
"""Ratio of the largest damage in a part to ``erosion.damage``, above which the run gives a warning if no tet of the
part was removed. Chosen value: in the example of a punch (docs/theory/erosion.md, Erosion) the damage of the plate is
0.42 and no tet is removed; with smaller tets the punch cuts a plug out of the plate."""


class Erosion:
    """The erosion of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, neighbours: list[Neighbour], contact: Contact | None, bounds: list[Boundary],
        comm: Comm, clock: Clock, extremes: tuple[float, float, float],
    ) -> None:  # fmt: skip
        """``extremes``: largest nodal mass, kg, largest speed, m/s, and largest distance from the origin, m, of the
        scene.
        """
        self._model, self._neighbours, self._contact = model, neighbours, contact
        self._bounds = bounds
        self._comm, self._clock = comm, clock
        self._specs = [part.erosion for part in case.parts]
        self._struck = np.zeros(model.nodes.n, bool)
        """(nodes,) particles that are removed because they received a contact impulse."""
        self.removal: Removal | None = None
        """Removal of tets from bodies that break; None if the case has no such bodies."""
        self.removed = np.zeros(model.nodes.n, bool)
        """(nodes,) True for each node that is removed. The velocity of a removed node is zero."""
        self._tets_at = self._completed([block.tets.astype(np.int64) for block in model.blocks])
        # A copy and its parent have tets. The number of tets of a copy is counted before it is used.
        model.nodes.columns.declare(self, removed=COPIED, _struck=COPIED, _tets_at=COPIED)
        self._leaving: tuple[Ints, Floats] = np.zeros(0, np.int64), np.zeros((0, 3))
        """Nodes that are removed in this step, and their velocities v(n-1/2), m/s."""
        self.account = ErosionAccount(clock, extremes)
        self._limit = 0.0
        self.due = False
        """True if tets or nodes are removed at the start of the next step."""

    def begin(self, limit: float) -> None:
        """Computes the limits of the stable step, which the case gives as fractions of the first stable step.
        ``limit``: 1 / first stable step, 1/s.
        """
        self._limit = limit
        for block in self._model.blocks:
            spec = self._specs[block.part]
            if spec is not None:
                block.life[FREQUENCY] = limit / spec.time_step

    def keep(self, parcel: Parcel) -> None:
        """Adds the state of erosion to a parcel (a checkpoint or migration message)."""
        nodes, ids = self._model.nodes, parcel.nodes["id"]
        account = self.account
        parcel.known["erosion"] = self._limit, self.due, account.work.scale, account.nodal.scale
        parcel.nodes["erosion.removed"], parcel.nodes["erosion.tets_at"] = self.removed, self._tets_at
        parcel.nodes["erosion.struck"] = self._struck
        alone = np.flatnonzero((self._tets_at == 0) & nodes.owned)
        parcel.rows["erosion.alone"] = {"at": nodes.x[alone], "with": ids[alone][:, None]}
        account.keep(parcel, nodes.x)

    def resume(self, parcel: Parcel) -> None:
        """Restores the state of erosion from a parcel (a checkpoint or migration message)."""
        limit, self.due, self.account.work.scale, self.account.nodal.scale = parcel.known["erosion"]
        self.begin(limit)
        self.removed, self._tets_at = parcel.nodes["erosion.removed"], parcel.nodes["erosion.tets_at"]
        self._struck = parcel.nodes["erosion.struck"]
        self.account.resume(parcel)
        self._release()

    def strikes(self) -> int:
        """Marks nodes that have no tets and received a contact impulse in this step, in parts with ``erosion.nodes =
        "strike"``; to be called after contact. Returns TIRED (elements/wear.py) if nodes of this rank must be removed,
        else SOUND.
        """
        loose = np.flatnonzero(self._loose)
        if self._contact is not None:
            flying = loose[self._of_kind("strike")[self._model.nodes.part[loose]]]
            self._struck[flying[self._contact.searches.pushed(flying)]] = True
        return TIRED if len(loose) and self._leaves[loose].any() else SOUND

    def decide(self, found: int) -> None:
        """Decides whether the next step removes tets or nodes. ``found``: maximum over all ranks of SOUND, TIRED and
        BROKEN (elements/wear.py).
        """
        self.due = found == BROKEN or (found > SOUND and self._clock.step % GATHERED == 0)

    def warnings(self, eroded: int) -> list[str]:
        """Returns the warnings for the end of the run; ``eroded``: number of removed tets on all ranks. Collective."""
        parts = self._model.parts
        left, damage = np.zeros(len(parts), np.int64), np.zeros(len(parts))
        for block in self._model.blocks:
            left[block.part] += block.n
            if block.has(DAMAGE) and block.n:
                damage[block.part] = max(damage[block.part], block.at(DAMAGE, np.arange(block.n)).max())
        left, damage = self._comm.sum(left), self._comm.maximum(damage)
        found = [f"part {parts[k]!r} has no tet left: erosion removed all of them" for k in np.flatnonzero(left == 0)]
        limits = [float(life(spec)[DAMAGED]) for spec in self._specs]
        undecided = [k for k, limit in enumerate(limits) if not eroded and UNDECIDED * limit < damage[k] < limit]
        return found + [
            f"part {parts[k]!r} is damaged to {damage[k]:.2g} of erosion.damage {limits[k]:g} and no tet was removed: "
            "shear bands are at least as wide as a tet, and smaller tets reach the limit sooner (conoid converge shows "
            "whether this matters)"
            for k in undecided
        ]

    @property
    def particles(self) -> int:
        """Number of free nodes without tets (particles). Collective."""
        nodes = self._model.nodes
        return int(self._comm.sum(np.array([(nodes.owned & self._loose).sum()]))[0])

    @property
    def idle(self) -> bool:
        """True if no tet or node must be removed, no work of a removal must be added later, and all nodes have tets."""
        return not (self.due or self.account.outstanding or (self._tets_at == 0).any())

    def note(self, state: Nodes) -> None:
        """Adds the second half of the work of the last removal; to be called before the kick."""
        self.account.note(state)

    def remove(self, state: Nodes) -> None:
        """Removes the marked tets, if the removal is scheduled for this step. Collective."""
        self._leaving = np.zeros(0, np.int64), np.zeros((0, 3))
        if self.due:
            self._remove(state)
            self.due = False

    def stop_removed(self, state: Nodes) -> None:
        """Adds the nodes that are removed in this step to the account, and sets the velocities of all removed nodes to
        zero; to be called after the kick.
        """
        leaving, before = self._leaving
        if len(leaving):
            self.account.add_nodes(state, leaving, before)
        state.v[self.removed] = 0.0

    def _remove(self, state: Nodes) -> None:
        """Removes the marked tets. Also removes the nodes that have lost all their tets, if their part requires this.
        Collective.
        """
        blocks, none = self._model.blocks, np.zeros((0, exposure.WORDS), np.int64)
        worn = [np.flatnonzero(block.worn) for block in blocks]
        if self.removal is not None:
            self.removal.begin(worn)
        some = [(block, places) for block, places in zip(blocks, worn, strict=True) if len(places)]
        left = [block.tets[places].astype(np.int64) for block, places in some]
        ids = [np.zeros(0, np.int64), *(block.id[places] for block, places in some)]
        known = some if self._contact is not None or self.removal is not None else []
        gone = np.concatenate([none, *(exposure.leaving(block, places, state.id) for block, places in known)])
        self._drop(worn, state.x)
        self._unload(np.concatenate(ids))
        self._count(left)
        self._choose_nodes(state)
        self._release()
        if self._contact is not None:
            self._contact.uncover(gone, self._loose, self.removed)
        if self.removal is not None:
            self.removal.end(gone, self._tets_at > 0)

    def _drop(self, worn: list[Ints], x: Floats) -> None:
        """Adds the energies of the tets ``worn`` of each block to the account, and removes these tets. ``x`` (nodes,
        3): positions, m.
        """
        for index, (block, places) in enumerate(zip(self._model.blocks, worn, strict=True)):
            if len(places):
                self.account.add_tets(block, places, x)
                moves = block.drop(places)
                if self.removal is not None:
                    self.removal.drop(index, moves)

    def _count(self, left: list[Ints]) -> None:
        """Updates the number of tets at each node after the removal of the tets ``left``. If nodes can separate, all
        tets are counted again, because the number of tets of a copy of a node is not stored. Collective.
        """
        if self.removal is None:
            self._tets_at -= self._completed(left)
        else:
            self._tets_at = self._completed([block.tets.astype(np.int64) for block in self._model.blocks])
        self._model.elements_global -= int(self._comm.sum(np.array([sum(len(tets) for tets in left)]))[0])

    def _choose_nodes(self, state: Nodes) -> None:
        """Chooses the nodes that are removed in this step."""
        leaving = self._leaves & self._loose
        some = np.flatnonzero(leaving)
        self._leaving, self.removed = (some, state.v[some]), self.removed | leaving

    @property
    def _leaves(self) -> Flags:
        """(nodes,) nodes that are removed as soon as they have no tets."""
        return np.asarray(self._struck | self._of_kind("remove")[self._model.nodes.part])

    def _of_kind(self, kind: str) -> Flags:
        """(parts,) parts whose ``erosion.nodes`` is this ``kind``."""
        return np.array([spec is not None and spec.nodes == kind for spec in self._specs])

    @property
    def _loose(self) -> Flags:
        """(nodes,) True for each particle; a particle is a node that has no tets and is not removed."""
        return np.asarray((self._tets_at == 0) & ~self.removed)

    def _release(self) -> None:
        """Sets the nodes without tets as particles in all boundaries."""
        for bound in self._bounds:
            bound.release(self._loose, self._bounds)

    def _unload(self, gone: Ints) -> None:
        """Removes the boundary loads of removed tets, on every rank that has a node of such a tet. ``gone``: global ids
        of the removed tets of this rank. Collective.
        """
        if any(bound.on_faces for bound in self._bounds):
            gone = self._comm.join(gone)
            for bound in self._bounds:
                bound.drop(gone)

    def _completed(self, tets: list[Ints]) -> Ints:
        """(nodes,) number of tets in ``tets`` at each node, counted over all ranks. Collective."""
        corners = np.concatenate([np.zeros(0, np.int64), *(rows.reshape(-1) for rows in tets)])
        counts = np.bincount(corners, minlength=self._model.nodes.n)[:, None].astype(np.int64)
        complete(self._comm, self._neighbours, counts, Tag.TETS_AT_NODE)
        return counts[:, 0]
