"""Tables of a scene: the columns of its slots, faces and edges."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...model.columns import ABSENT, COPIED, ZERO, Columns
from ...model.growing import Rooms
from ...model.state import Bits, Flags, Floats, Indices, Ints
from ..surface.normals import COLUMNS
from ..surface.records import AGED, OPEN, SurfaceNodes, names_of
from .incidence import Incidence


@dataclass
class OwnSlots:
    """Slots of the nodes on this rank, and slots of nodes of other ranks."""

    slots: Indices
    """(h,) slots of local nodes."""
    local: Indices
    """(h,) local indices of the nodes of ``slots``."""
    place: Indices
    """(nodes,) slot of each local node, -1 for a node without slot."""
    far: Indices
    """(k,) slots of nodes that are not on this rank."""
    far_ids: Ints
    """(k,) global ids, ascending, of the nodes of ``far``, which are not on this rank."""
    _rooms: Rooms = field(default_factory=lambda: Rooms("slots", "local"), init=False, repr=False)

    @classmethod
    def of(cls, surface_nodes: SurfaceNodes, nodes: int) -> "OwnSlots":
        """Maps all slots to the local nodes; ``nodes``: number of local nodes."""
        slots, none = np.zeros(0, np.int32), np.zeros(0, np.int64)
        own = cls(slots, slots, np.full(nodes, -1, np.int32), slots, none)
        own.add(0, surface_nodes)
        return own

    def add(self, first: int, rows: SurfaceNodes) -> None:
        """Adds the slots of the nodes ``rows``. The numbers of the new slots start at ``first``."""
        held = np.flatnonzero(rows.local >= 0)
        slots, local = (first + held).astype(np.int32), rows.local[held]
        self._rooms.append(self, len(held), slots=slots, local=local)
        self.place[local] = slots
        if len(held) < rows.n:
            far = np.flatnonzero(rows.local < 0)
            ids = np.concatenate([self.far_ids, rows.id[far]])
            order = np.argsort(ids)
            self.far = np.concatenate([self.far, (first + far).astype(np.int32)])[order]
            self.far_ids = ids[order]


SLOT_COLUMNS = {
    **dict.fromkeys(("normals", "owned", "on_surface", "pushes", "live", "new", "tracked"), COPIED),
    "root": ABSENT | COPIED, "first": ABSENT, "fresh": ZERO, "total": ZERO, "before": ZERO,
}  # fmt: skip
"""Rules for new rows of the columns of SceneSlots (model/columns.py)."""


@dataclass
class SceneSlots:
    """Columns with one value for each slot."""

    owned: Flags
    """(slots,) True for each surface node that this rank owns. A rank computes the contacts of its own surface nodes
    with faces."""
    pushes: Flags
    """(slots,) True for each node to which a contact of this rank may apply an impulse."""
    live: Flags
    """(slots,) True for each node that this rank owns and that is in the broad phase."""
    new: Flags
    """(slots,) True for each node whose candidate pairs must be searched again (registration)."""
    fresh: Flags
    """(slots,) True for each node whose pairs must be tested because its mean normals have changed."""
    tracked: Flags
    """(slots,) True for each node whose motion is measured: nodes in the broad phase, and nodes of faces and edges in
    the broad phase."""
    on_surface: Flags
    """(slots,) True for each local node on the surface. Only local surface nodes are in contact with faces."""
    first: Indices
    """(slots,) index of the first pair of each slot with a face; -1 if the slot has no such pair."""
    root: Indices
    """(slots,) slot at the last search from which each slot was copied. For a slot that is not a copy it is the slot
    itself; for a slot that was added after the search it is -1."""
    normals: Floats
    """(slots, COLUMNS) mean normals of each node; see tables.SlotTable."""
    total: Ints
    """(slots, 3) impulses of the last step on each node, quanta."""
    before: Floats
    """(slots, 3) velocity v(n-1/2) of each node, m/s."""
    columns: Columns = field(default_factory=Columns, init=False, repr=False)
    """All columns of the scene with one value for each slot."""

    @classmethod
    def at_rest(cls, owned: Flags, pushes: Flags) -> "SceneSlots":
        """Returns the columns for the start of a scene, when no node is in the broad phase."""
        n = len(owned)
        live, new, fresh, tracked, on_surface = np.zeros((5, n), bool)
        first, root = np.full(n, -1, np.int32), np.arange(n, dtype=np.int32)
        spare = n + n // 2
        normals, before = np.zeros((spare, COLUMNS))[:n], np.zeros((spare, 3))[:n]
        total = np.zeros((spare, 3), np.int64)[:n]
        return cls(owned, pushes, live, new, fresh, tracked, on_surface, first, root, normals, total, before)


@dataclass
class SceneFaces:
    """Columns with one value for each face."""

    corners: Indices
    """(f, 4) slots of the corners of each face; the last slot is the opposite node of the tet."""
    id: Ints
    """(f,) global ids of the faces, ascending."""
    size: Floats
    exposed: Flags
    """(f,) True for each exposed face; only exposed faces have contacts."""
    live: Flags
    """(f,) True for each face in the broad phase: exposed faces, and faces that may be exposed soon."""
    new: Flags
    """(f,) True for each face whose candidate pairs must be searched again (registration)."""
    fresh: Flags
    """(f,) True for each face whose pairs must be tested, because a corner is new or the face is newly exposed."""

    @classmethod
    def at_rest(cls, corners: Indices, ids: Ints, size: Floats, exposed: Flags) -> "SceneFaces":
        """Returns the columns for the start of a scene, when no face is in the broad phase."""
        return cls(corners, ids, size, exposed, *np.zeros((3, len(corners)), bool))

    @cached_property
    def incidence(self) -> Incidence:
        """Rows of the table at each slot of the last search. The first call of this method must be made before any
        corner is replaced by a copy.
        """
        return Incidence(self.corners)


@dataclass
class SceneEdges:
    """Columns with one value for each edge. Only sharp edges are in the broad phase."""

    corners: Indices
    """(e, 6) slots of each edge; see records.Edges."""
    sides: Ints
    """(e, 2) ids of the two faces of each edge."""
    faces: Indices
    """(e, 2) rows of the two faces of each edge; -1 for a face that this rank does not have."""
    lengths: Floats
    """(2, e) columns ``size`` and ``deep`` of records.Edges, m."""
    opened: Bits
    """(e, 2) states of the two faces of each edge; see records.Edges."""
    meets: Flags
    """(e,) True for each edge if the states of its two faces admit edge-edge contact; see records.Edges."""
    sharp: Flags
    """(e,) True for each edge that is sharp or has been sharp (sharp.py)."""
    own: Flags
    """(e,) True for each edge whose face of smaller id is on this rank."""
    rank: Ints
    """(e,) rank of each edge in an order of all edges. A pair of edges belongs to its edge of lower rank."""
    live: Flags
    """(e,) True for each edge in the broad phase."""
    new: Flags
    """(e,) True for each edge whose candidate pairs must be searched again (registration)."""
    fresh: Flags
    """(e,) True for each edge whose pairs must be tested."""

    @classmethod
    def at_rest(
        cls, corners: Indices, sides: Ints, faces: Indices, lengths: Floats, opened: Bits, sharp: Flags, own: Flags,
        rank: Ints,
    ) -> "SceneEdges":  # fmt: skip
        """Returns the columns for the start of a scene, when no edge is in the broad phase."""
        one, two = opened.T
        meets = np.asarray((np.minimum(one, two) >= AGED) & (np.maximum(one, two) == OPEN))
        return cls(
            corners, sides, faces, lengths, opened, meets, sharp, own, rank, *np.zeros((3, len(corners)), bool)
        )  # fmt: skip

    @cached_property
    def size(self) -> Floats:
        """(e,) initial length of each edge, m."""
        return np.asarray(self.lengths[0])

    @cached_property
    def deep(self) -> Floats:
        """(e,) greatest depth of a contact of each edge, m."""
        return np.asarray(self.lengths[1])

    @cached_property
    def far(self) -> Ints:
        """Rows of the edges that have a face which this rank does not have."""
        return np.flatnonzero((self.faces < 0).any(axis=1))

    @cached_property
    def incidence(self) -> Incidence:
        """Rows of the table at each slot of the last search. The first call of this method must be made before any
        corner is replaced by a copy.
        """
        return Incidence(self.corners)

    @property
    def names(self) -> Ints:
        """(e,) name of each edge; see records.names_of."""
        return names_of(self.sides)
