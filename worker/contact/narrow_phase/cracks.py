"""Contact across cracks.

The two sides of a broken facet coincide, so no search is needed to find contacts between the two sides. From the moment
of separation on, the two copies of a node on opposite sides are in contact along the normal of the facet, with an
initial gap of exactly zero. Another body could reach the faces of a crack only by entering the crack. Therefore the
faces are not surface until the width of the crack is a fixed fraction of the size of a facet. In the step in which the
width reaches this fraction, the crack opens: its faces, nodes and edges are surface from the next step on; the last
search has included these faces, so that opening needs no search. Cracks that do not widen never cause a search.
"""

from dataclasses import dataclass, field

import numpy as np

from ...kernels.jit import njit
from ...migration.parcel import Table, once
from ...model.growing import Rooms
from ...model.ids import among
from ...model.state import WIDE, Block, Flags, Floats, Indices, Ints, Nodes
from ...model.topology import KEY, Split
from ..surface.families import CornerLists, Corners, Families, TouchingRows
from ..surface.records import CrackSides

AGE, _YOUNG = 16, 0.3
"""Two constants: number of steps between two checks of the ages of cracks; and a fraction of young cracks, above which
all cracks become aged (docs/theory/contact.md, "Edges at cracks")."""
_KEPT = 12
"""Number of columns of the stored impulses of a crack."""
_COLUMNS = "faces", "nodes", "sides", "foreseen", "aged", "places", "kept"
"""Names of the arrays with one row for each crack."""
_IN_LIST, _WALKED = 1, 2
"""Two marks of a node: the node is in the list; the family of the node is in the list."""


@dataclass
class Cracks:
    """Cracks: broken facets that have a side on this rank and whose sides are not surface yet."""

    faces: Ints
    """(m, 2) global ids of the two sides; the side of the tet of smaller id is first."""
    nodes: Indices
    """(m, 6) local nodes of each crack: three nodes of the first side, counter-clockwise seen from outside of its tet,
    and the nodes across."""
    sides: Indices
    """(m, 2, 3) block, tet and face of each side; -1 for a side of another rank."""
    foreseen: Flags
    """(m,) True for each crack whose sides were included in the last search."""
    aged: Flags
    """(m,) True for each aged crack. The edges between the sides of an aged crack and the surface are in edge-edge
    contact."""
    places: Indices
    """(m, 6) slots of the nodes. All slots are -1 for a crack without separated nodes, and for a crack that another
    rank computes. A crack is computed by the rank of its first side."""
    kept: Floats
    """(m, 12) stored impulse of each of the three pairs of opposite nodes, multiplied by the row norm, m/s: along the
    normal (1 value) and across it (3 values). The stored impulse is zero for a pair that was not active, and undefined
    for a crack that another rank computes."""
    families: Families
    """Families of all local nodes. A family is all copies of one original node."""
    _corners: dict[int, Corners] = field(default_factory=dict)
    """Corners of the narrow sides; the keys are blocks. The corners are kept until cracks or families change."""
    _rooms: Rooms = field(default_factory=lambda: Rooms(*_COLUMNS), init=False, repr=False)

    @classmethod
    def none(cls, ids: Ints) -> "Cracks":
        """Returns a table with no cracks; ``ids``: global ids of the local nodes."""
        faces, sides = np.zeros((0, 2), np.int64), np.zeros((0, 2, 3), np.int32)
        families, none, flags = Families.of(ids), np.zeros((0, 6), np.int32), np.zeros(0, bool)
        return cls(faces, none, sides, flags, flags, none, np.zeros((0, _KEPT)), families)

    def add(self, faces: Ints, nodes: Indices, sides: Indices) -> None:
        """Adds cracks for broken facets between the ``faces`` (m, 2), with the three ``nodes`` (m, 3) of each facet."""
        both = np.concatenate([nodes, nodes], axis=1)
        new = {"foreseen": False, "aged": False, "places": -1, "kept": 0.0}
        self._rooms.append(self, len(faces), faces=faces, nodes=both, sides=sides, **new)
        self._corners = {}

    def corners(self, block: int, lists: CornerLists) -> Corners:
        """Returns the corners of the narrow sides of a block; see corner_contact.py."""
        if block not in self._corners:
            self._corners[block] = lists.of(self.nodes, self.sides, block, self.families)
        return self._corners[block]

    def follow(self, split: Split, ids: Ints, touching: TouchingRows) -> Ints:
        """Updates nodes and families after a separation of nodes; ``ids``: global ids of the local nodes. Returns the
        rows of the cracks that have a separated node.
        """
        families, parents = self.families, split.copies.parents
        families.marks[parents] = 1
        rows = touching.of(self.nodes, families.marks)
        families.marks[parents] = 0
        _follow(self.nodes, self.faces, rows, ids, split.key, split.node)
        families.link(split)
        self._corners = {}
        return rows

    def keep(self, ids: Ints) -> Table:
        """Returns the cracks as a table with one row for each side; ``ids``: global ids of the local nodes."""
        rows, k = np.nonzero(self.sides[:, :, 1] >= 0)
        faces = self.faces[rows]
        return {"tet": faces[range(len(rows)), k] // 4, "key": 2 * faces[:, 0] + k, "faces": faces,
                "with": ids[self.nodes[rows]], "aged": self.aged[rows], "kept": self.kept[rows]}  # fmt: skip

    @classmethod
    def resume(cls, table: Table, root: Ints, blocks: list[Block], nodes: Nodes) -> "Cracks":
        """Builds cracks from the rows of a table, sorted by key. If the row of the first side is present, it is used,
        because a rank that had only the second side may have the nodes in another order, which changes the last bit of
        a normal. If a rank gets a crack from another rank, it has no stored impulses of the crack.
        """
        table = once(table, table["faces"][:, 0])
        faces = np.array(table["faces"])
        sides = np.full((len(faces), 2, 3), -1, np.int32)
        for b, block in enumerate(blocks):
            order = np.argsort(block.id)
            at = order[np.minimum(np.searchsorted(block.id[order], faces // 4), block.n - 1)]
            rows, k = np.nonzero(block.id[at] == faces // 4)
            sides[rows, k] = np.column_stack([np.full(len(rows), b), at[rows, k], faces[rows, k] % 4])
        nowhere, kept = np.full((len(faces), 6), -1, np.int32), np.array(table["kept"])
        families = Families.of(root)
        foreseen, aged = np.zeros(len(faces), bool), np.array(table["aged"])
        return cls(faces, nodes.places(table["with"]), sides, foreseen, aged, nowhere, kept, families)

    def foresee(self) -> CrackSides:
        """Marks all local sides as included in a search, and returns these sides for the new scene."""
        self.foreseen[:] = True
        sides, aged = self.sides.reshape(-1, 3), np.repeat(self.aged, 2)
        here = sides[:, 1] >= 0
        return CrackSides(sides[here & ~aged], sides[here & aged])

    @property
    def ages(self) -> Ints:
        """(2,) number of young cracks, and number of all cracks. The rank of the first side of a crack counts the
        crack.
        """
        mine = self.sides[:, 0, 1] >= 0
        return np.array([int((mine & ~self.aged).sum()), int(mine.sum())])

    def age(self, ages: Ints) -> bool:
        """Makes all cracks aged if the fraction of young cracks is large enough. ``ages``: counts over all ranks.
        Returns True if the cracks became aged. The decision does not depend on the steps in which the broad phase runs,
        so no result of a run depends on these steps.
        """
        if due := bool(ages[0] > _YOUNG * ages[1]):
            self.aged[:] = True
        return due

    def beside(self, rows: Ints, blocks: list[Block]) -> Indices:
        """Returns the nodes of the local tets at the cracks ``rows``, and the nodes of the families at the corners of
        these tets. Each node is returned once. The nodes of the cracks that this rank computes are included.
        """
        marks, ring = self.families.marks, self.families.ring
        found = np.empty(len(ring), np.int32)
        n = _families_beside(found, marks, rows, self.nodes, ring)
        for b, block in enumerate(blocks):
            n = _tets_beside(found, n, marks, rows, self.nodes, self.sides, b, block.tets)
        marks[found[:n]] = 0
        return found[:n]

    def arrange(self) -> None:
        """Sorts the cracks by the slots of their first nodes, so that cracks that are neighbours in space are
        neighbours in memory.
        """
        order = np.argsort(self.places[:, 0], kind="stable")
        for column in self._columns().values():
            column[:] = column.take(order, axis=0)
        self._corners = {}

    def at_tets(self, tets: Ints) -> Ints:
        """Returns the rows of the cracks at ``tets``, ids, ascending, whose first side is on this rank."""
        return np.flatnonzero(among(tets, self.faces // 4).any(axis=1) & (self.sides[:, 0, 1] >= 0))

    def drop(self, block: int, places: Indices) -> None:
        """Updates the table after a removal of tets without cracks from a block; ``places``: new places of the tets of
        the block.
        """
        here = (self.sides[:, :, 0] == block) & (self.sides[:, :, 1] >= 0)
        self.sides[here, 1] = places[self.sides[here, 1]]

    def forget(self, removed: Flags, ids: Ints) -> None:
        """Removes the ``removed`` nodes (nodes,) from their families; these nodes are corners of no contact. ``ids``:
        global ids of the local nodes.
        """
        families = self.families
        some = np.flatnonzero(removed & (families.ring != np.arange(len(removed))))
        if len(some):
            families.root[some] = -1 - ids[some]
            self.families, self._corners = Families.of(families.root), {}

    def open(self, faces: Ints, blocks: list[Block]) -> None:
        """Removes cracks from the table because their sides are now surface; ``faces``: first sides of these cracks,
        ascending. The last rows of the table of cracks are moved to the rows that become free.
        """
        rows = named(self.faces[:, 0], faces)
        sides = self.sides[rows].reshape(-1, 3)
        for b, block in enumerate(blocks):
            mine = sides[(sides[:, 0] == b) & (sides[:, 1] >= 0)]
            block.bond[mine[:, 1], mine[:, 2]] = WIDE
        left = len(self.faces) - len(rows)
        stays = np.ones(len(rows), bool)
        stays[rows[rows >= left] - left] = False
        holes, movers = rows[rows < left], left + np.flatnonzero(stays)
        for name, column in self._columns().items():
            column[holes] = column[movers]
            setattr(self, name, column[:left])
        self._corners = {}

    def _columns(self) -> "dict[str, np.ndarray]":
        """Returns the arrays with one row for each crack."""
        return {name: column for name, column in vars(self).items() if name in _COLUMNS}


@njit("void(int32[:, ::1], int64[:, ::1], int64[::1], int64[::1], int64[::1], int32[::1])", cache=True)
def _follow(nodes, faces, rows, ids, key, became):  # type: ignore[no-untyped-def]
    """Replaces the nodes of the cracks ``rows`` by their copies. ``key`` and ``became``: columns key and node of a
    Split.
    """
    for r in rows:
        for k in range(6):
            wanted = ids[nodes[r, k]] * KEY + faces[r, k // 3] // 4
            at = np.searchsorted(key, wanted)
            if at < len(key) and key[at] == wanted:
                nodes[r, k] = became[at]


@njit("int64(int32[::1], uint8[::1], int64[::1], int32[:, ::1], int32[::1])", cache=True)
def _families_beside(found, marks, rows, nodes, ring):  # type: ignore[no-untyped-def]
    """Lists the families of the separated nodes of the cracks ``rows``. Returns the number of listed nodes."""
    n = 0
    for r in rows:
        for k in range(6):
            a = nodes[r, k]
            if a == nodes[r, (k + 3) % 6] or marks[a] & _WALKED:
                continue
            while not marks[a] & _WALKED:
                marks[a] = _IN_LIST | _WALKED
                found[n], n, a = a, n + 1, ring[a]
    return n


@njit(
    "int64(int32[::1], int64, uint8[::1], int64[::1], int32[:, ::1], int32[:, :, ::1], int64, uint32[:, ::1])",
    cache=True,
)
def _tets_beside(found, n, marks, rows, nodes, sides, block, tets):  # type: ignore[no-untyped-def]
    """Adds nodes to a list of ``n`` nodes. The added nodes are those of the local tets of one block at the cracks
    ``rows`` with separated nodes. Returns the new number of nodes.
    """
    for r in rows:
        if nodes[r, 0] == nodes[r, 3] and nodes[r, 1] == nodes[r, 4] and nodes[r, 2] == nodes[r, 5]:
            continue
        for s in range(2):
            if sides[r, s, 0] != block or sides[r, s, 1] < 0:
                continue
            for k in range(4):
                a = tets[sides[r, s, 1], k]
                if not marks[a]:
                    marks[a] = _IN_LIST
                    found[n], n = a, n + 1
    return n


@njit("int64[::1](int64[:], int64[::1])", cache=True)
def named(ids, wanted):  # type: ignore[no-untyped-def]
    """Returns the indices of those elements of ``ids`` that are also in ``wanted``, which is ascending."""
    rows, n = np.empty(len(ids), np.int64), 0
    for i in range(len(ids)):
        at = np.searchsorted(wanted, ids[i])
        if at < len(wanted) and wanted[at] == ids[i]:
            rows[n] = i
            n += 1
    return rows[:n].copy()
