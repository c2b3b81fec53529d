"""The topology change of one step: which nodes got copies, and which tets have the copies as new nodes. Every array
indexed by node is extended from it.
"""

from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from .state import Copies, Indices, Ints

KEY = 2**31
"""Factor that is larger than any global tet id."""


def keys(nodes: Ints, tets: Ints) -> Ints:
    """Return (n,) the id of a node and the id of a tet, combined into one integer. The integers have the lexicographic
    order of the pairs.
    """
    return np.asarray(nodes * KEY + tets)


class KeptByNode(Protocol):
    """Interface of an object with arrays that have one row for each node. The arrays are extended when nodes
    separate.
    """

    def grow(self, split: "Split", ids: Ints) -> None:
        """Append the copies of a separation to the arrays by node. ``ids``: global ids of the local nodes."""


@dataclass
class Split:
    """Separation of nodes in one step, on one rank.

    The table has one row for each tet at a separated node of this rank that gets a copy as new node.
    """

    copies: Copies
    first: int
    """Local index of the first copy."""
    touched: Ints
    """(ranks,) not zero for each rank that has a node of a breaking facet."""
    key: Ints
    """(r,) global ids of the node and the tet of each row, combined into one integer (``keys``); ascending."""
    node: Indices
    """(r,) local index of the copy that replaces the node of each row."""
    place: Indices
    """(r,) index of each tet in its block; -1 for a tet of another rank."""
    corner: Indices
    """(r,) corner of each tet at which the separated node is, 0 to 3."""
    block: Indices
    """(r,) index of the block of each tet."""

    @property
    def family(self) -> Indices:
        """(c, 2) local indices of the parents, ascending, and of their copies."""
        copies = np.arange(self.first, self.first + self.copies.n)
        return np.column_stack([self.copies.parents, copies]).astype(np.int32)

    @classmethod
    def elsewhere(cls, first: int, touched: Ints) -> Self:
        """Return a separation without copies on this rank; ``first``: number of nodes of the rank."""
        words, places = np.zeros(0, np.int64), np.zeros(0, np.int32)
        copies = Copies(words, words, places, np.zeros(0, bool), np.zeros(0))
        return cls(copies, first, touched, words, places, places, places, places)

    def followed(self, nodes: Indices, ids: Ints, tets: Ints) -> Indices:
        """Return the new local nodes that replace ``nodes`` (n, k) in the tets with the global ids ``tets`` (n,).

        ``ids``: global ids of the local nodes.
        """
        if not len(self.key):
            return nodes.astype(np.int32)
        wanted = keys(ids[nodes], tets[:, None])
        at = np.minimum(np.searchsorted(self.key, wanted), len(self.key) - 1)
        return np.where(self.key[at] == wanted, self.node[at], nodes).astype(np.int32)

    def followed_sides(self, nodes: Indices, ids: Ints, tets: Ints) -> Indices:
        """Return the new local nodes of facets. ``nodes`` (n, 6): three local nodes for each side; ``tets`` (n, 2):
        tets of the two sides.
        """
        return np.concatenate([self.followed(nodes[:, 3 * k : 3 * k + 3], ids, tets[:, k]) for k in (0, 1)], axis=1)
