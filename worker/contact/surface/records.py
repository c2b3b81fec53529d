"""What contact knows of a surface: faces and edges as rows of global node ids, nodes with their state.

A face is three nodes, counter-clockwise seen from outside, and the node of its tet that lies opposite. An edge is its
two nodes and, of each of the two faces that meet there, the third one and the one opposite. Rows travel between ranks
as they are.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from ...model.growing import Rooms
from ...model.ids import located
from ...model.state import Bits, Flags, Floats, Indices, Ints

AGED, OPEN = 1, 2
"""How far a face of an edge is open."""


@dataclass
class Rows:
    """Columns of equal length."""

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(next(iter(vars(self).values())))

    @cached_property
    def _rooms(self) -> Rooms:
        """Of a table that grows."""
        return Rooms(*vars(self))

    def columns(self) -> list["np.ndarray"]:
        """The columns, in the order of their names here."""
        return [column for name, column in vars(self).items() if name != "_rooms"]

    def append(self, rows: Self) -> None:
        """Takes up more rows, behind these."""
        columns = dict(vars(rows))
        columns.pop("_rooms", None)
        self._rooms.append(self, rows.n, **columns)

    def take(self, chosen: "np.ndarray") -> Self:
        """Some of the rows."""
        return type(self)(*(column[chosen] for column in self.columns()))

    @classmethod
    def joined(cls, tables: Sequence[Self]) -> Self:
        """All rows of all tables, in turn."""
        return cls(*map(np.concatenate, zip(*(table.columns() for table in tables), strict=True)))


@dataclass
class Faces(Rows):
    """Exposed faces, and sides of cracks that may open before the next search."""

    id: Ints
    """(n,) 4 * global tet id + local face."""
    nodes: Ints
    """(n, 4) global ids."""
    size: Floats
    """(n,) square root of twice the initial area, m."""
    exposed: Flags
    """(n,) False for a side of a crack that has not opened yet."""


@dataclass
class Edges(Rows):
    """Edges; a row (a, b, c, d, e, f): edge ab between face abc of tet abce and face bad of tet badf, that of the
    smaller id first. Where more than two faces meet in an edge, every two of them that may enclose a body make a row.
    """

    nodes: Ints
    """(n, 6) global ids."""
    sides: Ints
    """(n, 2) ids of the faces abc and bad."""
    size: Floats
    """(n,) initial length, m."""
    deep: Floats
    """(n,) depth, m, beyond which it holds nothing, however its tets deform; see sharp.depths."""
    opened: Bits
    """(n, 2) how far either face is open: OPEN where it is exposed, AGED for the side of a crack that has come of age
    (cracks.AGE), else 0. The edge meets others when it is sharp, both faces are open at all and one is exposed."""
    sharp: Flags
    """(n,) see sharp.py."""

    @property
    def names(self) -> Ints:
        """(n,) the two faces of each edge as one number: two faces have one edge in common."""
        return (self.sides[:, 0] << 32) + self.sides[:, 1]


@dataclass(frozen=True)
class CrackSides:
    """Sides of cracks on a rank: block, place and face."""

    young: Indices
    """(k, 3) whose edges meet none yet."""
    aged: Indices
    """(m, 3) whose edges do."""


@dataclass
class SurfaceNodes(Rows):
    """Nodes by ascending global id, those of this rank and copies of others'."""

    id: Ints
    """(n,) global ids."""
    local: Indices
    """(n,) index on this rank, -1 for a copy."""
    owner: Indices
    """(n,) rank that owns the node."""
    part: Indices
    """(n,) index of the part."""
    mobility: Floats
    """(n, 3) one over the mass, 1/kg; zero where a component of the velocity is held."""
    x: Floats
    """(n, 3) position, m."""
    v: Floats
    """(n, 3) velocity, m/s."""
    course: Floats
    """(n, 3) velocity with which it flies on for a search, m/s; see extrapolation.py."""

    def places(self, ids: Ints) -> Indices:
        """Where these global ids stand, in the shape of ``ids``; all must be here."""
        return located(self.id, ids)


def merged(groups: list[SurfaceNodes]) -> SurfaceNodes:
    """All nodes once, by ascending id; the first surface_nodes that has a node gives its row."""
    every = SurfaceNodes.joined(groups)
    return every.take(np.unique(every.id, return_index=True)[1])
