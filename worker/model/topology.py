"""The topology change of one step: old node to new nodes, by tet; every array indexed by node is extended from it."""

from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from .state import Copies, Indices, Ints

KEY = 2**31
"""More than there are tets."""


def keys(nodes: Ints, tets: Ints) -> Ints:
    """(n,) ids of a node and of a tet as one number that orders like them."""
    return np.asarray(nodes * KEY + tets)


class KeptByNode(Protocol):
    """An object with arrays by node that is updated when nodes separate."""

    def grow(self, split: "Split", ids: Ints) -> None:
        """Takes up the copies of a split; ``ids``: of the local nodes."""


@dataclass
class Split:
    """What separated in a step, on one rank: round every node that it holds."""

    copies: Copies
    first: int
    """Local index of the first copy."""
    touched: Ints
    """(ranks,) not 0 for those that have a node of what breaks."""
    key: Ints
    """(r,) of the tets whose node has become a copy: ids of the node and of the tet as one number, ascending."""
    node: Indices
    """(r,) the copy, local."""
    place: Indices
    """(r,) of the tet in its block, -1 for one of another rank."""
    corner: Indices
    """(r,) of the tet."""
    block: Indices
    """(r,) index of the block."""

    @classmethod
    def elsewhere(cls, first: int, touched: Ints) -> Self:
        """One of which a rank that has ``first`` nodes gets no copy."""
        words, places = np.zeros(0, np.int64), np.zeros(0, np.int32)
        copies = Copies(words, words, places, np.zeros(0, bool), np.zeros(0))
        return cls(copies, first, touched, words, places, places, places, places)

    def followed(self, nodes: Indices, ids: Ints, tets: Ints) -> Indices:
        """What local ``nodes`` (n, k) of tets of global ids ``tets`` (n,) have become; ``ids``: of the local nodes."""
        if not len(self.key):
            return nodes.astype(np.int32)
        wanted = keys(ids[nodes], tets[:, None])
        at = np.minimum(np.searchsorted(self.key, wanted), len(self.key) - 1)
        return np.where(self.key[at] == wanted, self.node[at], nodes).astype(np.int32)

    def followed_sides(self, nodes: Indices, ids: Ints, tets: Ints) -> Indices:
        """The same for facets: ``nodes`` (n, 6) of the sides of ``tets`` (n, 2), three each."""
        return np.concatenate([self.followed(nodes[:, 3 * k : 3 * k + 3], ids, tets[:, k]) for k in (0, 1)], axis=1)
