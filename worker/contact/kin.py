"""New candidates of a split: what a copy has from its parent, and what had nodes in common until it separated."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..jit import njit
from ..state import Indices


@dataclass
class Family:
    """Nodes that separate, and what comes out of them."""

    first: Indices
    """(crowd,) row of ``member`` where the copies of a node begin, -1 for one that has none."""
    member: Indices
    """(c, 2) place of each copy, and whether it is its parent's last."""
    most: int
    """Largest number of copies of a node."""
    pairs: Indices
    """(c, 2) places of the parent and of the copy."""

    @classmethod
    def of(cls, pairs: Indices, n: int) -> Self:
        """The families of ``pairs``, those of a parent one after the other, in a crowd of ``n``."""
        parent, first = pairs[:, 0], np.full(n, -1, np.int32)
        last = np.append(parent[1:] != parent[:-1], True)[: len(parent)]
        end = np.flatnonzero(last) + 1
        count = np.diff(end, prepend=0)
        first[parent[end - 1]] = end - count
        return cls(first, np.column_stack([pairs[:, 1], last]).astype(np.int32), int(count.max(initial=0)), pairs)


@njit("int32[:, ::1](int32[:, ::1], int32[::1], int32[::1], int32[:, ::1])", cache=True)
def inherited(family, first, following, pairs):  # type: ignore[no-untyped-def]
    """(p, 2) candidates, node and face, of the copies of a ``family`` (c, 2), places of parents and copies: those of
    their parents. ``first`` (nodes,), ``following`` and ``pairs``: see node_face.chain.
    """
    n = 0
    for write in range(2):
        if write:
            found = np.empty((n, 2), np.int32)
        n = 0
        for c in range(len(family)):
            p = first[family[c, 0]]
            while p >= 0:
                if write:
                    found[n, 0], found[n, 1] = family[c, 1], pairs[p, 1]
                n += 1
                p = following[p]
    return found


@njit(
    "int64(int32[:, ::1], int64[::1], int32[:, ::1], int32[:, ::1], int32[::1], int32[:, ::1], boolean[::1], "
    "boolean[::1])",
    cache=True,
)
def apart_from_faces(pairs, rows, old, now, first, member, slave, meets):  # type: ignore[no-untyped-def]
    """Pairs of nodes and faces, of ``rows``, that had a corner in common before the split, and have none now.

    ``old`` and ``now`` (r, 4): their corners; ``first`` and ``member``: Family; returns how many there are.
    """
    n = 0
    for r in range(len(rows)):
        for k in range(3):
            node = old[r, k]
            if first[node] < 0 or not slave[node] or not meets[r]:
                continue
            at, end = first[node], False
            while True:
                if node != now[r, 0] and node != now[r, 1] and node != now[r, 2]:
                    pairs[n, 0], pairs[n, 1] = node, rows[r]
                    n += 1
                if end:
                    break
                node, end = member[at, 0], member[at, 1] != 0
                at += 1
    return n


@njit("int64[:, ::1](int64[::1], int32[:, ::1], int32[:, ::1], boolean[::1])", cache=True)
def apart_from_edges(order, old, now, own):  # type: ignore[no-untyped-def]
    """(p, 2) pairs of edges that had an end in common before the split and have none now, where the one of smaller
    faces, the first, is this rank's own.

    ``old`` and ``now`` (e, 2 and 4): their nodes; ``order``: of the ends, flat, by node.
    """
    ends, many = old.reshape(-1), 0
    for write in range(2):
        if write:
            pairs = np.empty((many, 2), np.int64)
        many, i = 0, 0
        while i < len(order):
            j = i
            while j < len(order) and ends[order[j]] == ends[order[i]]:
                j += 1
            for a in range(i, j):
                for b in range(i, j):
                    one, two = order[a] // 2, order[b] // 2
                    if one >= two or not own[one]:
                        continue
                    common = False
                    for k in range(2):
                        common |= now[one, k] == now[two, 0] or now[one, k] == now[two, 1]
                    both = old[one, 0] == old[two, 0] and old[one, 1] == old[two, 1]
                    if common or (both and ends[order[i]] != old[one, 0]):
                        continue
                    if write:
                        pairs[many, 0], pairs[many, 1] = one, two
                    many += 1
            i = j
    return pairs
