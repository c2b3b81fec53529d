"""What contact knows of a surface: faces and edges as rows of global node ids, nodes with their state.

A face is three nodes, counter-clockwise seen from outside, and the node of its tet that lies opposite. An edge is its
two nodes and, of each of the two faces that meet there, the third one. Rows travel between ranks as they are.
"""

from dataclasses import dataclass

import numpy as np

from ..state import Floats, Indices, Ints


@dataclass
class Faces:
    """Exposed faces, ``n`` of them."""

    id: Ints
    """(n,) 4 * global tet id + local face."""
    nodes: Ints
    """(n, 4) global ids."""
    size: Floats
    """(n,) square root of twice the initial area, m."""

    @property
    def n(self) -> int:
        """Number of faces."""
        return len(self.id)

    def take(self, chosen: "np.ndarray") -> "Faces":
        """Some of the faces."""
        return Faces(self.id[chosen], self.nodes[chosen], self.size[chosen])


@dataclass
class Edges:
    """Sharp edges, ``n`` of them; a row (a, b, c, d): edge ab between face abc and face bad, a < b."""

    nodes: Ints
    """(n, 4) global ids."""
    size: Floats
    """(n,) initial length, m."""

    @property
    def n(self) -> int:
        """Number of edges."""
        return len(self.size)

    def take(self, chosen: "np.ndarray") -> "Edges":
        """Some of the edges."""
        return Edges(self.nodes[chosen], self.size[chosen])


@dataclass
class Crowd:
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

    @property
    def n(self) -> int:
        """Number of nodes."""
        return len(self.id)

    def take(self, chosen: "np.ndarray") -> "Crowd":
        """Some of the nodes."""
        return Crowd(
            self.id[chosen], self.local[chosen], self.owner[chosen], self.part[chosen], self.mobility[chosen],
            self.x[chosen], self.v[chosen],
        )  # fmt: skip

    def places(self, ids: Ints) -> Indices:
        """Where these global ids stand, in the shape of ``ids``; all must be here."""
        return np.searchsorted(self.id, ids).astype(np.int32)


def merged(crowds: list[Crowd]) -> Crowd:
    """All nodes once, by ascending id; the first crowd that has a node gives its row."""
    every = [np.concatenate(columns) for columns in zip(*(_columns(c) for c in crowds), strict=True)]
    _, first = np.unique(every[0], return_index=True)
    return Crowd(*(column[first] for column in every))


def _columns(crowd: Crowd) -> tuple["np.ndarray", ...]:
    return (crowd.id, crowd.local, crowd.owner, crowd.part, crowd.mobility, crowd.x, crowd.v)
