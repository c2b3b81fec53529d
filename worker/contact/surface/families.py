"""Families: a family is all copies of one original node of the start, with the node itself. A rank with a tet at a node
has all nodes of the family.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...kernels.jit import njit, record, types
from ...model.state import Flags, Indices, Ints, extended
from ...model.topology import Split

_N1, _N2 = types.int32[::1], types.int32[:, ::1]


@dataclass
class Families:
    """Families of the local nodes."""

    root: Ints
    """(nodes,) global id of the original node at the start of the run."""
    ring: Indices
    """(nodes,) next local node of the family, cyclic; the node itself if the family has one node."""
    leader: Indices
    """(nodes,) local node that represents the family."""

    @classmethod
    def of(cls, root: Ints) -> "Families":
        """Links the nodes of each ``root`` (nodes,) in a ring."""
        (ring, leader), order = np.empty((2, len(root)), np.int32), np.argsort(root, kind="stable")
        first = np.flatnonzero(np.append(True, np.diff(root[order]) != 0)[: len(root)])
        following, ends = np.roll(order, -1), np.append(first, len(root))[1:]
        following[ends - 1] = order[first]
        ring[order], leader[order] = following, np.repeat(order[first], ends - first)
        return cls(root, ring, leader)

    def grow(self, split: Split) -> None:
        """Adds the copies of a split."""
        parents = split.copies.parents
        self.root = extended(self.root, self.root[parents])
        self.ring = extended(self.ring, np.zeros(len(parents), np.int32))
        self.leader = extended(self.leader, self.leader[parents])
        _insert(self.ring, parents, split.first)

    def members(self, nodes: Ints) -> Flags:
        """(nodes,) nodes in the family of one of the ``nodes`` (k,)."""
        return np.asarray(_members(self.ring, nodes))


@njit("void(int32[::1], int64[::1], int64)", cache=True)
def _insert(ring, parents, first):  # type: ignore[no-untyped-def]
    """Inserts copies, numbered from ``first`` on, into the ring after their parents."""
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


class Corners(NamedTuple):
    """Corners of narrow sides at nodes that have separated into three pieces or more, by family."""

    members: Indices
    """Nodes of the families, one family after the other."""
    begin: Indices
    """(families + 1,) offsets of the members of each family."""
    among: Indices
    """(nodes,) position of a node of a family in ``members``."""
    corners: Indices
    """Codes 8 crack + 4 side + corner (0 to 2), one family after the other."""
    start: Indices
    """(families + 1,) offsets of the corners of each family."""


CORNERS = record(Corners, _N1, _N1, _N1, _N1, _N1)


@njit(CORNERS(_N2, types.int32[:, :, ::1], types.int64, _N1, _N1), cache=True)
def by_family(cracks, sides, block, ring, leader):  # type: ignore[no-untyped-def]
    """Returns the ``Corners`` of a ``block``.

    ``cracks`` (m, 6) nodes of all cracks and ``sides`` (m, 2, 3): see Cracks; ``ring`` and ``leader``: see Families.
    """
    alone, unknown = -2, -1
    family = np.full(len(ring), np.int32(unknown), np.int32)
    members, among, end = np.empty(len(ring), np.int32), np.empty(len(ring), np.int32), 0
    begin, count, many = np.empty(len(ring) + 1, np.int32), np.zeros(len(ring) + 1, np.int32), 0
    found, of, n = np.empty(6 * len(cracks), np.int32), np.empty(6 * len(cracks), np.int32), 0
    for c in range(len(cracks)):
        for h in range(2):
            if sides[c, h, 1] < 0 or sides[c, h, 0] != block:
                continue
            for k in range(3):
                p = cracks[c, 3 * h + k]
                if p == cracks[c, 3 - 3 * h + k]:
                    continue
                f = family[leader[p]]
                if f == unknown:
                    f = alone
                    if ring[ring[p]] != p:
                        f, begin[many], d = many, end, p
                        while end == begin[f] or d != p:
                            members[end], among[d], d, end = d, end, ring[d], end + 1
                        many += 1
                    family[leader[p]] = f
                if f >= 0:
                    found[n], of[n] = 8 * c + 4 * h + k, f
                    count[f] += 1
                    n += 1
    start, corners, total = np.empty(many + 1, np.int32), np.empty(n, np.int32), 0
    for f in range(many):
        start[f], total, count[f] = total, total + count[f], total
    begin[many], start[many] = end, total
    for i in range(n):
        corners[count[of[i]]] = found[i]
        count[of[i]] += 1
    return Corners(members[:end].copy(), begin[: many + 1].copy(), among, corners, start)
