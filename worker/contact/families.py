"""Families: nodes that were one. Whoever has a tet at a node holds all of its family."""

from dataclasses import dataclass

import numpy as np

from ..jit import njit
from ..state import Flags, Indices, Ints, extended
from ..topology import Split


@dataclass
class Families:
    """By local node."""

    root: Ints
    """(nodes,) global id of the node that each was part of at the start."""
    ring: Indices
    """(nodes,) the next one of its family here, itself where it is alone."""
    leader: Indices
    """(nodes,) the one here that stands for its family."""

    @classmethod
    def of(cls, root: Ints) -> "Families":
        """The nodes of each ``root`` (nodes,) as a ring."""
        (ring, leader), order = np.empty((2, len(root)), np.int32), np.argsort(root, kind="stable")
        first = np.flatnonzero(np.append(True, np.diff(root[order]) != 0)[: len(root)])
        following, ends = np.roll(order, -1), np.append(first, len(root))[1:]
        following[ends - 1] = order[first]
        ring[order], leader[order] = following, np.repeat(order[first], ends - first)
        return cls(root, ring, leader)

    def grow(self, split: Split) -> None:
        """Takes up the copies of a split."""
        parents = split.copies.parents
        self.root = extended(self.root, self.root[parents])
        self.ring = extended(self.ring, np.zeros(len(parents), np.int32))
        self.leader = extended(self.leader, self.leader[parents])
        _insert(self.ring, parents, split.first)

    def members(self, nodes: Ints) -> Flags:
        """(nodes,) who is of the family of one of the ``nodes`` (k,)."""
        return np.asarray(_members(self.ring, nodes))


@njit("void(int32[::1], int64[::1], int64)", cache=True)
def _insert(ring, parents, first):  # type: ignore[no-untyped-def]
    """Copies, from ``first`` on, come behind their parents."""
    for c in range(len(parents)):
        ring[first + c], ring[parents[c]] = ring[parents[c]], first + c


@njit("boolean[::1](int32[::1], int64[::1])", cache=True)
def _members(ring, nodes):  # type: ignore[no-untyped-def]
    """See Families.members."""
    found = np.zeros(len(ring), np.bool_)
    for a in nodes:
        while not found[a]:
            found[a] = True
            a = ring[a]
    return found
