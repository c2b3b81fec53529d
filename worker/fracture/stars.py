"""The stars of nodes: the tets round each, and the pieces into which broken facets have cut them.

Two tets of a star belong together when a chain of tets leads from one to the other through intact facets that contain
the node. What holds by an edge or by the node alone is a hinge, which carries no moment: it is let go. When a star is
in more than one piece, the piece with the smallest tet id keeps the node and every other gets a copy of it. One broken
facet inside a body separates nothing; a closed sheet of them round a node does.
"""

import numpy as np

from ..jit import njit
from ..mesh.faces import FACES
from ..state import CHUNK, INTACT, Indices, Ints, Tets, extended
from ..state import MASS as MASS_ROW

NODE, TET, RANK, MASS, BEHIND = 0, 1, 2, 3, 4
"""Columns of a row, one a node and tet of its star: global ids of the node and the tet, rank of the tet, bits of its
mass, kg; and for the three faces that contain the node the id of the tet behind an intact one, -1 for others."""
COLUMNS = 7
"""Number of columns: the last three are those of BEHIND."""


class Stars:
    """The tets of every node of one block: a pool in which each node's tets stand together.

    When a node separates, its stretch of the pool is cut into those of its copies.
    """

    def __init__(self, tets: Tets, nodes: int) -> None:
        """``tets`` (n, 4) over ``nodes`` local nodes."""
        corners = tets.reshape(-1)
        self.pool: Indices = (np.argsort(corners, kind="stable") // 4).astype(np.int32)
        """Places of tets."""
        self.count: Indices = np.bincount(corners, minlength=nodes).astype(np.int32)
        """(nodes,)."""
        self.first: Indices = (np.cumsum(self.count) - self.count).astype(np.int32)
        """(nodes,) where the node's tets begin in the pool."""

    def grow(self, copies: int) -> None:
        """Takes up new nodes, which have no tets yet."""
        none = np.zeros(copies, np.int32)
        self.first, self.count = extended(self.first, none), extended(self.count, none)

    def retie(self, tets: Tets, nodes: Ints, rows: Ints, places: Ints, became: Ints, new: int) -> None:
        """Gives tets (n, 4) of this block the nodes that theirs have become, and every node its star.

        ``rows`` (r, COLUMNS) of the whole stars of the local ``nodes`` (k,), sorted; ``places`` (r, 2), place and
        corner of tets of this block, -1 for other rows; ``became`` (r,) the copy, local, -1 where the node stays
        itself; ``new`` how many nodes there are with the copies.
        """
        self.grow(new - len(self.count))
        _retie(self.pool, self.first, self.count, tets, nodes, rows, places, became)


@njit(
    "void(int64[:, ::1], int64[:, ::1], int64[::1], int32[::1], int32[::1], int32[::1], uint32[:, ::1], int64[::1], "
    "int64[::1], int64[::1], int32[:, ::1], uint8[:, ::1], int64, int64)",
    cache=True,
)
def describe(rows, places, nodes, first, count, pool, tets, ids, node_ids, state, across, bond, columns, rank):  # type: ignore[no-untyped-def]
    """Fills ``rows`` (r, COLUMNS) and ``places`` (r, 2), place and corner of the tet, for the stars of ``nodes``.

    ``state``: that of the block, flat, with ``columns`` rows a chunk.
    """
    r = 0
    for a in nodes:
        for s in range(first[a], first[a] + count[a]):
            e = pool[s]
            corner = 0
            while tets[e, corner] != a:
                corner += 1
            places[r, 0], places[r, 1] = e, corner
            rows[r, NODE], rows[r, TET], rows[r, RANK] = node_ids[a], ids[e], rank
            rows[r, MASS] = state[(e // CHUNK * columns + MASS_ROW) * CHUNK + e % CHUNK]
            for m in range(3):
                k = FACES[corner, m]
                held = across[e, k] >= 0 and bond[e, k] == INTACT
                rows[r, BEHIND + m] = across[e, k] // 4 if held else -1
            r += 1


@njit("int64(int64[:, ::1], int64, int64, int64)", cache=True)
def _row_of(rows, begin, end, tet):  # type: ignore[no-untyped-def]
    """The row of a tet among those of a star, which are sorted; -1 where it is not."""
    last = end
    while begin < end:
        middle = (begin + end) // 2
        if rows[middle, TET] < tet:
            begin = middle + 1
        else:
            end = middle
    return begin if begin < last and rows[begin, TET] == tet else -1


@njit("int64(int64[::1], int64)", cache=True)
def _root(parent, i):  # type: ignore[no-untyped-def]
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit("Tuple((int64[::1], boolean[::1]))(int64[:, ::1])", cache=True)
def pieces(rows):  # type: ignore[no-untyped-def]
    """(r,) the smallest tet id of the piece that each row belongs to, and whether the piece leaves its node; ``rows``
    sorted by node, then by tet.
    """
    n = len(rows)
    parent, label, leaves = np.arange(n), np.empty(n, np.int64), np.empty(n, np.bool_)
    begin = 0
    while begin < n:
        end = begin
        while end < n and rows[end, NODE] == rows[begin, NODE]:
            end += 1
        for i in range(begin, end):
            for m in range(BEHIND, COLUMNS):
                if rows[i, m] <= rows[i, TET]:  # none, or one that has seen this one behind it
                    continue
                j = _row_of(rows, i + 1, end, rows[i, m])
                if j < 0:
                    continue
                one, two = _root(parent, i), _root(parent, j)
                parent[max(one, two)] = min(one, two)
        for i in range(begin, end):
            root = _root(parent, i)
            label[i], leaves[i] = rows[root, TET], root != begin
        begin = end
    return label, leaves


@njit(
    "void(int32[::1], int32[::1], int32[::1], uint32[:, ::1], int64[::1], int64[:, ::1], int64[:, ::1], int64[::1])",
    cache=True,
)
def _retie(pool, first, count, tets, nodes, rows, places, became):  # type: ignore[no-untyped-def]
    """See Stars.retie. A node's stretch of the pool: its own tets, then those of each copy, by ascending id."""
    begin, n, k = 0, len(rows), 0
    while begin < n:
        end = begin
        while end < n and rows[end, NODE] == rows[begin, NODE]:
            end += 1
        at, node = first[nodes[k]], -1
        while True:
            following = -1
            start = at
            for r in range(begin, end):
                if became[r] > node and (following < 0 or became[r] < following):
                    following = became[r]
                if places[r, 0] >= 0 and became[r] == node:
                    pool[at] = places[r, 0]
                    at += 1
                    if node >= 0:
                        tets[places[r, 0], places[r, 1]] = node
            a = nodes[k] if node < 0 else node
            if node < 0 or at > start:
                first[a], count[a] = start, at - start
            if following < 0:
                break
            node = following
        begin, k = end, k + 1
