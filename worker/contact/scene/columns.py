"""Tables of a scene: columns of its slots, faces and edges."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...model.columns import ABSENT, COPIED, ZERO, Columns
from ...model.growing import Rooms
from ...model.state import Bits, Flags, Floats, Indices, Ints
from ..surface.normals import COLUMNS
from ..surface.records import AGED, OPEN, SurfaceNodes
from .incidence import Incidence


@dataclass
class OwnSlots:
    """Slots of the nodes on this rank, and of nodes of other ranks."""

    slots: Indices
    """(h,) slots of local nodes."""
    local: Indices
    """(h,) local indices of the nodes of these slots."""
    place: Indices
    """(nodes,) slot of each local node, -1 for a node without slot."""
    far: Indices
    """(k,) slots of nodes that are not on this rank."""
    far_ids: Ints
    """(k,) global ids of the nodes that are not on this rank, ascending."""
    _rooms: Rooms = field(default_factory=lambda: Rooms("slots", "local"), init=False, repr=False)

    @classmethod
    def of(cls, surface_nodes: SurfaceNodes, nodes: int) -> "OwnSlots":
        """Maps all slots to the local nodes, ``nodes`` in number."""
        slots, none = np.zeros(0, np.int32), np.zeros(0, np.int64)
        own = cls(slots, slots, np.full(nodes, -1, np.int32), slots, none)
        own.add(0, surface_nodes)
        return own

    def add(self, first: int, rows: SurfaceNodes) -> None:
        """Adds the slots of ``rows``, from ``first`` on."""
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
"""Rules of the columns of SceneSlots (model/columns.py)."""


@dataclass
class SceneSlots:
    """Columns of the slots."""

    owned: Flags
    """(slots,) True for owned surface nodes; this rank computes the contacts of such nodes with faces."""
    pushes: Flags
    """(slots,) True for nodes to which a contact of this rank may apply an impulse."""
    live: Flags
    """(slots,) True for owned nodes in the broad phase."""
    new: Flags
    """(slots,) True for nodes whose candidate pairs must be searched again (registration)."""
    fresh: Flags
    """(slots,) True for nodes whose pairs must be tested because the mean normals of the node have changed."""
    tracked: Flags
    """(slots,) True for nodes in the broad phase, and for nodes of faces and edges in the broad phase; the motion of
    these nodes is measured."""
    on_surface: Flags
    """(slots,) local nodes on the surface: only these are in contact with faces."""
    first: Indices
    """(slots,) first pair with a face, -1 for none."""
    root: Indices
    """(slots,) for each slot, the slot at the last search of which it is a copy or which it is itself; -1 for a slot
    that was added after the search."""
    normals: Floats
    """(slots, COLUMNS) mean normals; see tables.SlotTable."""
    total: Ints
    """(slots, 3) impulses of the last step, quanta."""
    before: Floats
    """(slots, 3) v(n-1/2), m/s."""
    columns: Columns = field(default_factory=Columns, init=False, repr=False)
    """All columns by slot of the scene."""

    @classmethod
    def at_rest(cls, owned: Flags, pushes: Flags) -> "SceneSlots":
        """Returns the columns; no row is in the broad phase yet."""
        n = len(owned)
        live, new, fresh, tracked, on_surface = np.zeros((5, n), bool)
        first, root = np.full(n, -1, np.int32), np.arange(n, dtype=np.int32)
        spare = n + n // 2
        normals, before = np.zeros((spare, COLUMNS))[:n], np.zeros((spare, 3))[:n]
        total = np.zeros((spare, 3), np.int64)[:n]
        return cls(owned, pushes, live, new, fresh, tracked, on_surface, first, root, normals, total, before)


@dataclass
class SceneFaces:
    """Columns of the faces."""

    corners: Indices
    """(f, 4) slots of the corners of each face; the opposite node of the tet is last."""
    id: Ints
    """(f,) global ids of the faces, ascending."""
    size: Floats
    exposed: Flags
    """(f,) True for exposed faces; only these have contacts."""
    live: Flags
    """(f,) True for faces in the broad phase: exposed faces, and faces that may be exposed soon."""
    new: Flags
    """(f,) True for faces whose candidate pairs must be searched again (registration)."""
    fresh: Flags
    """(f,) True for faces whose pairs must be tested because a corner is new or the face is newly exposed."""

    @classmethod
    def at_rest(cls, corners: Indices, ids: Ints, size: Floats, exposed: Flags) -> "SceneFaces":
        """Returns the columns; no row is in the broad phase yet."""
        return cls(corners, ids, size, exposed, *np.zeros((3, len(corners)), bool))

    @cached_property
    def incidence(self) -> Incidence:
        """Rows of the table at each slot of the last search. The first call must come before any corner has become a
        copy.
        """
        return Incidence(self.corners)


@dataclass
class SceneEdges:
    """Columns of the edges; only sharp edges are in the broad phase."""

    corners: Indices
    """(e, 6) slots: see records.Edges."""
    sides: Ints
    """(e, 2) ids of the two faces of each edge."""
    faces: Indices
    """(e, 2) rows of the two faces of each edge, -1 for a face that this rank does not have."""
    lengths: Floats
    """(2, e) ``size`` and ``deep`` of records.Edges, m."""
    opened: Bits
    """(e, 2) states of the two faces of each edge: see records.Edges."""
    meets: Flags
    """(e,) whether the states of both faces admit edge-edge contact: see records.Edges."""
    sharp: Flags
    """(e,) True for edges that are or have been sharp (sharp.py)."""
    own: Flags
    """(e,) True for edges whose face of smaller id is on this rank."""
    rank: Ints
    """(e,) order of the edges: a pair belongs to the edge of lower rank."""
    live: Flags
    """(e,) True for edges in the broad phase."""
    new: Flags
    """(e,) True for edges whose candidate pairs must be searched again (registration)."""
    fresh: Flags
    """(e,) True for edges whose pairs must be tested."""

    @classmethod
    def at_rest(
        cls, corners: Indices, sides: Ints, faces: Indices, lengths: Floats, opened: Bits, sharp: Flags, own: Flags,
        rank: Ints,
    ) -> "SceneEdges":  # fmt: skip
        """Returns the columns; no row is in the broad phase yet."""
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
        """Rows of edges with a face that this rank does not have."""
        return np.flatnonzero((self.faces < 0).any(axis=1))

    @cached_property
    def incidence(self) -> Incidence:
        """Rows of the table at each slot of the last search. The first call must come before any corner has become a
        copy.
        """
        return Incidence(self.corners)

    @property
    def names(self) -> Ints:
        """(e,) ids of the two faces of each edge as one number: two faces have at most one edge in common."""
        return (self.sides[:, 0] << 32) + self.sides[:, 1]
