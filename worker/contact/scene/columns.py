"""What a scene knows of its slots, faces and edges: a column each, by their rows."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...model.growing import Rooms
from ...model.state import Bits, Flags, Floats, Indices, Ints
from ..surface.normals import COLUMNS
from ..surface.records import AGED, OPEN, SurfaceNodes

_FRESH = {
    **dict.fromkeys(("owned", "pushes", "live", "new", "fresh", "tracked", "on_surface"), False),
    "first": -1, "normals": 0.0, "total": 0,
}  # fmt: skip
"""What a slot begins with."""


@dataclass
class OwnSlots:
    """Which nodes have which slots: those that this rank holds, and others."""

    slots: Indices
    """(h,) which they are."""
    local: Indices
    """(h,) indices of their nodes on this rank."""
    place: Indices
    """(nodes,) slot of each node of this rank, -1 for those that have none."""
    far: Indices
    """(k,) slots of nodes that this rank does not hold."""
    far_ids: Ints
    """(k,) global ids of these, ascending."""
    _rooms: Rooms = field(default_factory=lambda: Rooms("slots", "local"), init=False, repr=False)
    _by_node: Rooms = field(default_factory=lambda: Rooms("place"), init=False, repr=False)

    @classmethod
    def of(cls, surface_nodes: SurfaceNodes, nodes: int) -> "OwnSlots":
        """Of all slots, for so many ``nodes`` of this rank."""
        slots, none = np.zeros(0, np.int32), np.zeros(0, np.int64)
        own = cls(slots, slots, np.full(nodes, -1, np.int32), slots, none)
        own.add(0, surface_nodes)
        return own

    def add(self, first: int, rows: SurfaceNodes) -> None:
        """Takes up more slots, from ``first`` on."""
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

    def grow(self, nodes: int) -> None:
        """Up to so many ``nodes`` of this rank; the new ones have no slots yet."""
        if nodes > len(self.place):
            self._by_node.append(self, nodes - len(self.place), place=-1)


@dataclass
class SceneSlots:
    """The slots."""

    owned: Flags
    """(slots,) the nodes whose contacts with faces this rank computes."""
    pushes: Flags
    """(slots,) which nodes a contact of this rank may push."""
    live: Flags
    """(slots,) the owned that are searched."""
    new: Flags
    """(slots,) which have to be registered."""
    fresh: Flags
    """(slots,) whose pairs have to be tested, for they have other mean normals."""
    tracked: Flags
    """(slots,) nodes of what is searched."""
    on_surface: Flags
    """(slots,) of nodes that are held here: only those on the surface meet faces."""
    first: Indices
    """(slots,) the first pair with a face, -1 for none."""
    normals: Floats
    """(slots, COLUMNS) mean normals; see tables.SlotTable."""
    total: Ints
    """(slots, 3) impulses of the last step, quanta."""
    before: Floats
    """(slots, 3) v(n-1/2)."""
    _rooms: Rooms = field(default_factory=lambda: Rooms("before", *_FRESH), init=False, repr=False)

    @classmethod
    def at_rest(cls, owned: Flags, pushes: Flags) -> "SceneSlots":
        """Nothing is searched yet."""
        n = len(owned)
        live, new, fresh, tracked, on_surface = np.zeros((5, n), bool)
        first, normals, total, before = (
            np.full(n, -1, np.int32), np.zeros((n, COLUMNS)), np.zeros((n, 3), np.int64), np.zeros((n, 3)),
        )  # fmt: skip
        return cls(owned, pushes, live, new, fresh, tracked, on_surface, first, normals, total, before)

    def add(self, rows: SurfaceNodes) -> None:
        """Takes up more slots."""
        self._rooms.append(self, rows.n, before=rows.v, **_FRESH)

    def inherit(self, copies: Indices, parents: Indices) -> None:
        """Copies have the normals of their parents, are searched as they are, and pushed by the same ranks."""
        for column in (self.normals, self.owned, self.on_surface, self.pushes, self.live, self.new, self.tracked):
            column[copies] = column[parents]


@dataclass
class SceneFaces:
    """The faces."""

    corners: Indices
    """(f, 4) slots."""
    id: Ints
    """(f,) ascending."""
    size: Floats
    exposed: Flags
    """(f,) only exposed faces are met."""
    live: Flags
    """(f,) which are searched: what is exposed, and what may be soon."""
    new: Flags
    """(f,) which have to be registered."""
    fresh: Flags
    """(f,) whose pairs have to be tested: new corners, newly exposed."""

    @classmethod
    def at_rest(cls, corners: Indices, ids: Ints, size: Floats, exposed: Flags) -> "SceneFaces":
        """Nothing is searched yet."""
        return cls(corners, ids, size, exposed, *np.zeros((3, len(corners)), bool))


@dataclass
class SceneEdges:
    """The edges; only sharp ones are searched."""

    corners: Indices
    """(e, 6) slots: see records.Edges."""
    sides: Ints
    """(e, 2) ids of their faces."""
    faces: Indices
    """(e, 2) rows of these, -1 for a face that is not here."""
    lengths: Floats
    """(2, e) ``size`` and ``deep`` of records.Edges, m."""
    opened: Bits
    """(e, 2) how far either face is open: see records.Edges."""
    meets: Flags
    """(e,) whether its faces allow that others meet it: see records.Edges."""
    sharp: Flags
    """(e,) whether it is, or has been (sharp.py)."""
    own: Flags
    """(e,) whose face of smaller id is of this rank."""
    rank: Ints
    """(e,) of two edges, that of lower rank has the pair."""
    live: Flags
    """(e,) which are searched."""
    new: Flags
    """(e,) which have to be registered."""
    fresh: Flags
    """(e,) whose pairs have to be tested."""

    @classmethod
    def at_rest(
        cls, corners: Indices, sides: Ints, faces: Indices, lengths: Floats, opened: Bits, sharp: Flags, own: Flags,
        rank: Ints,
    ) -> "SceneEdges":  # fmt: skip
        """Nothing is searched yet."""
        meets = np.asarray((opened.min(axis=1, initial=OPEN) >= AGED) & (opened.max(axis=1, initial=0) == OPEN))
        return cls(
            corners, sides, faces, lengths, opened, meets, sharp, own, rank, *np.zeros((3, len(corners)), bool)
        )  # fmt: skip

    @cached_property
    def size(self) -> Floats:
        """(e,) initial length, m."""
        return np.asarray(self.lengths[0])

    @cached_property
    def deep(self) -> Floats:
        """(e,) depth beyond which it holds nothing, m."""
        return np.asarray(self.lengths[1])

    @cached_property
    def far(self) -> Ints:
        """Rows of edges with a face that is not here."""
        return np.flatnonzero((self.faces < 0).any(axis=1))

    @property
    def names(self) -> Ints:
        """(e,) the two faces of each edge as one number: two faces have one edge in common."""
        return (self.sides[:, 0] << 32) + self.sides[:, 1]
