"""Tables of a surface: faces and edges, given by global node ids, and nodes with their state.

A face has three nodes, counter-clockwise seen from outside, and the opposite node of its tet. An edge has its two nodes
and, for each of its two faces, the third node of the face and the opposite node of the tet. Ranks exchange the rows of
edges unchanged.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ...model.growing import spacious
from ...model.ids import located
from ...model.state import Bits, Flags, Floats, Indices, Ints

AGED, OPEN = 1, 2
"""States of a face at an edge (Edges.opened)."""


@dataclass
class Rows:
    """Base class of tables. The columns of a table are arrays of equal length."""

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(next(iter(vars(self).values())))

    def columns(self) -> list["np.ndarray"]:
        """Columns, in the order of their declaration."""
        return list(vars(self).values())

    def take(self, chosen: "np.ndarray") -> Self:
        """Returns the ``chosen`` rows as a table."""
        rows = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
        return type(self)(*(column.take(rows, axis=0) for column in self.columns()))

    def spacious(self, rows: Ints) -> Self:
        """Returns a table of the rows ``rows``. Its columns have spare rows."""
        taken = [spacious(len(rows), column.shape[1:], column.dtype) for column in self.columns()]
        for out, column in zip(taken, self.columns(), strict=True):
            np.take(column, rows, axis=0, out=out, mode="clip")  # numpy's mode "raise" would copy the result
        return type(self)(*taken)

    @classmethod
    def joined(cls, tables: Sequence[Self]) -> Self:
        """Concatenates ``tables``."""
        return cls(*map(np.concatenate, zip(*(table.columns() for table in tables), strict=True)))


@dataclass
class Faces(Rows):
    """Exposed faces, and sides of cracks that may open before the next search."""

    id: Ints
    """(n,) id of each face: 4 * global tet id + local face."""
    nodes: Ints
    """(n, 4) global ids of the three corners of each face, and of the opposite node."""
    size: Floats
    """(n,) size of each face, m: the square root of twice its initial area."""
    exposed: Flags
    """(n,) True for each exposed face; False for a side of a crack that is not open yet."""


@dataclass
class Edges(Rows):
    """Table of edges. A row (a, b, c, d, e, f) is the edge ab between the face abc of tet abce and the face bad of tet
    badf; the face of smaller id is first. If more than two faces share an edge, each pair of these faces that may
    enclose material has a row.
    """

    nodes: Ints
    """(n, 6) global ids of the nodes a, b, c, d, e, f of each edge."""
    sides: Ints
    """(n, 2) ids of the faces abc and bad."""
    size: Floats
    """(n,) initial length of each edge, m."""
    deep: Floats
    """(n,) greatest depth of a contact of each edge, m, for any deformation of its tets; see sharp.depths."""
    opened: Bits
    """(n, 2) state of each of the two faces: OPEN if it is exposed, AGED for a side of a crack older than cracks.AGE,
    else 0. An edge is in edge-edge contact if it is sharp, no state is 0 and at least one state is OPEN."""
    sharp: Flags
    """(n,) True for each sharp edge; see sharp.py."""

    @property
    def names(self) -> Ints:
        """(n,) name of each edge; see names_of. The names of the edges of a surface are ascending."""
        return names_of(self.sides)


def names_of(sides: Ints) -> Ints:
    """(n,) ids of the two faces ``sides`` (n, 2) of each edge, combined into one number. The number identifies the
    edge, because two faces have at most one edge in common.
    """
    return np.asarray((sides[:, 0] << 32) + sides[:, 1])


@dataclass(frozen=True)
class CrackSides:
    """Sides of cracks on a rank. Each row has block, tet and face of a side."""

    young: Indices
    """(k, 3) sides of young cracks; the edges of these sides are not in edge-edge contact yet."""
    aged: Indices
    """(m, 3) sides of aged cracks; the edges of these sides are in edge-edge contact."""


@dataclass
class SurfaceNodes(Rows):
    """Table of nodes in the order of ascending global ids: nodes of this rank, and ghosts of nodes of other ranks."""

    id: Ints
    """(n,) global ids of the nodes."""
    local: Indices
    """(n,) local index of each node on this rank; -1 for a ghost."""
    owner: Indices
    """(n,) rank that owns each node."""
    part: Indices
    """(n,) index of the part of each node."""
    mobility: Floats
    """(n, 3) inverse of the mass of each node, 1/kg; zero for a component of the velocity that is held."""
    x: Floats
    """(n, 3) position of each node, m."""
    v: Floats
    """(n, 3) velocity of each node, m/s."""
    course: Floats
    """(n, 3) extrapolated velocity for a search, m/s; see extrapolation.py."""

    def places(self, ids: Ints) -> Indices:
        """Returns the rows of the nodes with the global ids ``ids``, in the shape of ``ids``; all nodes must be
        present.
        """
        return located(self.id, ids)

    def renew(self, places: Indices, others: "SurfaceNodes", chosen: "np.ndarray") -> None:
        """Sets mobility and part of the rows ``places`` (k,) to those of the rows ``chosen`` (k,) of ``others``."""
        self.mobility[places], self.part[places] = others.mobility[chosen], others.part[chosen]


def merged(groups: list[SurfaceNodes]) -> SurfaceNodes:
    """Returns all nodes once, by ascending global id. A node that is in several groups has the row of the first
    group.
    """
    groups = [group for group in groups if group.n] or groups[:1]
    if len(groups) == 1 and (groups[0].id[1:] > groups[0].id[:-1]).all():
        return groups[0]
    every = SurfaceNodes.joined(groups)
    return every.take(np.unique(every.id, return_index=True)[1])
