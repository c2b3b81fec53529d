"""Contact across cracks.

The two sides of a broken facet coincide, so no search is needed to find the contacts of the two sides. From the moment
of separation, the two copies of a node on opposite sides are in contact along the normal of the facet, with an initial
gap of exactly zero. Another body could reach the faces of a crack only by entering the crack. The faces are therefore
not on the surface until the width of the crack is a fixed share of the size of a facet. In the step in which the width
reaches this share, the crack opens: faces, nodes and edges are on the surface from the next step on. The last search
has included these faces, so that opening needs no search. Cracks that do not widen never cause a search.
"""

from dataclasses import dataclass, field

import numpy as np

from ...kernels.jit import njit
from ...migration.parcel import Table, once
from ...model.state import WIDE, Block, Flags, Floats, Indices, Ints, Nodes, extended
from ...model.topology import Split
from ..scene.split_pairs import touching
from ..surface.families import CornerLists, Corners, Families
from ..surface.records import CrackSides

AGE, _YOUNG = 16, 0.3
"""Number of steps between two checks whether cracks become aged, and the share of young cracks above which all
cracks become aged (docs/theory/contact.md, "Edges at cracks")."""
_KEPT = 12
"""Columns of the stored impulses of a crack."""


@dataclass
class Cracks:
    """Cracks: broken facets with a side on this rank whose sides are not surface yet."""

    faces: Ints
    """(m, 2) global ids of the two sides; the side of the tet of smaller id is first."""
    nodes: Indices
    """(m, 6) local nodes of the first side, counter-clockwise seen from outside of its tet, and the nodes across."""
    sides: Indices
    """(m, 2, 3) block, tet and face of either side, -1 for a side of another rank."""
    foreseen: Flags
    """(m,) whether the scene of the last search includes the sides."""
    aged: Flags
    """(m,) aged cracks: edges between their sides and the surface are in edge-edge contact."""
    places: Indices
    """(m, 6) slots of the nodes; all -1 for a crack without separated nodes, and for a crack that another rank
    computes. The rank of the first side computes the crack."""
    kept: Floats
    """(m, 12) stored impulse of each of the three pairs of nodes across, times the row norm of the pair, m/s: along
    the normal (1) and across (3). Zero for a pair that was not active; undefined for a crack that another rank
    computes."""
    families: Families
    """Families (all copies of one original node) of all local nodes."""
    _corners: dict[int, Corners] = field(default_factory=dict)
    """Corners of the narrow sides by block, kept until cracks or families change."""

    @classmethod
    def none(cls, ids: Ints) -> "Cracks":
        """Returns a table without cracks; ``ids`` of the local nodes."""
        faces, sides = np.zeros((0, 2), np.int64), np.zeros((0, 2, 3), np.int32)
        families, none, flags = Families.of(ids), np.zeros((0, 6), np.int32), np.zeros(0, bool)
        return cls(faces, none, sides, flags, flags, none, np.zeros((0, _KEPT)), families)

    def add(self, tets: Ints, nodes: Indices, sides: Indices, blocks: list[Block]) -> None:
        """Adds broken facets between ``tets`` (m, 2) with their three ``nodes`` (m, 3)."""
        faces = 4 * tets + sides[:, :, 2]
        for b, block in enumerate(blocks):
            for k in (0, 1):
                mine = (sides[:, k, 0] == b) & (sides[:, k, 1] >= 0)
                faces[mine, 1 - k] = block.across[sides[mine, k, 1], sides[mine, k, 2]]
        self.faces, self.sides = extended(self.faces, faces), extended(self.sides, sides)
        self.nodes = extended(self.nodes, np.concatenate([nodes, nodes], axis=1))
        self.foreseen = extended(self.foreseen, np.zeros(len(faces), bool))
        self.aged = extended(self.aged, np.zeros(len(faces), bool))
        self.places = extended(self.places, np.full((len(faces), 6), -1, np.int32))
        self.kept = extended(self.kept, np.zeros((len(faces), _KEPT)))
        self._corners = {}

    def corners(self, block: int, lists: CornerLists) -> Corners:
        """Corners of the narrow sides of a block; see corner_contact.py."""
        if block not in self._corners:
            self._corners[block] = lists.of(self.nodes, self.sides, block, self.families)
        return self._corners[block]

    def follow(self, split: Split, ids: Ints) -> None:
        """Updates nodes and families after a split; ``ids`` of the local nodes."""
        parents = np.zeros(len(ids), bool)
        parents[split.copies.parents] = True
        rows = touching(self.nodes, parents)
        self.nodes[rows] = split.followed_sides(self.nodes[rows], ids, self.faces[rows] // 4)
        self.families.grow(split)
        self._corners = {}

    def keep(self, ids: Ints) -> Table:
        """Returns the cracks as a table, one row a side; ``ids`` of the local nodes."""
        rows, k = np.nonzero(self.sides[:, :, 1] >= 0)
        faces = self.faces[rows]
        return {"tet": faces[range(len(rows)), k] // 4, "key": 2 * faces[:, 0] + k, "faces": faces,
                "with": ids[self.nodes[rows]], "aged": self.aged[rows], "kept": self.kept[rows]}  # fmt: skip

    @classmethod
    def resume(cls, table: Table, root: Ints, blocks: list[Block], nodes: Nodes) -> "Cracks":
        """Builds cracks from the rows of a table, sorted by key. The row of the first side is used if present: a rank
        that had only the second side may have the nodes in another order, which changes the last bit of a normal. A
        rank that gets a crack from another rank has not computed this crack, so it has no stored impulses of the crack.
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
        """Returns all local sides, for a scene that includes them."""
        self.foreseen[:] = True
        sides, aged = self.sides.reshape(-1, 3), np.repeat(self.aged, 2)
        here = sides[:, 1] >= 0
        return CrackSides(sides[here & ~aged], sides[here & aged])

    @property
    def ages(self) -> Ints:
        """(2,) numbers of young cracks and of all, each counted by the rank of its first side."""
        mine = self.sides[:, 0, 1] >= 0
        return np.array([int((mine & ~self.aged).sum()), int(mine.sum())])

    def age(self, ages: Ints) -> bool:
        """Makes all cracks aged if enough are young, by the ``ages`` of all ranks; returns True if the cracks became
        aged. In which steps the broad phase runs has no influence, so no result of a run depends on it.
        """
        if due := bool(ages[0] > _YOUNG * ages[1]):
            self.aged[:] = True
        return due

    def beside(self, rows: Ints, blocks: list[Block]) -> tuple[Flags, Flags]:
        """Returns (nodes,) flags of the nodes of the local tets at the cracks ``rows`` and of the families at their
        corners; and flags of the separated nodes among these nodes.
        """
        families, near = self.families, np.zeros(len(self.families.ring), bool)
        nodes = self.nodes[rows]
        torn = nodes != nodes[:, [3, 4, 5, 0, 1, 2]]
        sides = self.sides[rows[torn.any(axis=1)]].reshape(-1, 3)
        for b, block in enumerate(blocks):
            near[block.tets[sides[(sides[:, 0] == b) & (sides[:, 1] >= 0), 1]]] = True
        near |= families.members(nodes[torn].astype(np.int64))
        return near, near & (families.ring != np.arange(len(near)))

    def arrange(self) -> None:
        """Sorts the cracks by the slots of their first nodes: neighbours in space become neighbours in memory."""
        order = np.argsort(self.places[:, 0], kind="stable")
        for column in self._columns().values():
            column[:] = column.take(order, axis=0)
        self._corners = {}

    def open(self, faces: Ints, blocks: list[Block]) -> None:
        """Removes the cracks whose first sides are among ``faces``, ascending, from the table, because their sides are
        now surface. The last rows are moved to the free rows.
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
        """Arrays with a row for each crack."""
        return {name: column for name, column in vars(self).items() if name not in ("families", "_corners")}


@njit("int64[::1](int64[:], int64[::1])", cache=True)
def named(ids, wanted):  # type: ignore[no-untyped-def]
    """Returns the rows of the ``ids`` that are among the ascending ``wanted``."""
    rows, n = np.empty(len(ids), np.int64), 0
    for i in range(len(ids)):
        at = np.searchsorted(wanted, ids[i])
        if at < len(wanted) and wanted[at] == ids[i]:
            rows[n] = i
            n += 1
    return rows[:n].copy()


@njit("int64[::1](int64[::1], int32[:, ::1], int32[:, :, ::1])", cache=True)
def computed(rows, nodes, sides):  # type: ignore[no-untyped-def]
    """Returns those cracks among ``rows`` that this rank computes: cracks with separated nodes whose first side is on
    this rank.
    """
    some, n = np.empty(len(rows), np.int64), 0
    for c in rows:
        apart = nodes[c, 0] != nodes[c, 3] or nodes[c, 1] != nodes[c, 4] or nodes[c, 2] != nodes[c, 5]
        if sides[c, 0, 1] >= 0 and apart:
            some[n] = c
            n += 1
    return some[:n].copy()
