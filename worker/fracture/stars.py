r"""Stars of nodes: the tets round a node, and the pieces into which broken facets cut them.

Two tets of a star are in one piece if a chain of tets leads from one to the other through intact facets that contain
the node. A connection through an edge or through the node alone is a hinge; it carries no moment, and is separated.
::

             +-------+                  +-------+
            / \  t1 # \                / \  t1 /  +
           /   \   #   \              /   \   /  / \         The star of node a, in two dimensions: t1 to t6. Broken
          / t6  \ #  t2 \            / t6  \ /  / t2\        facets (#) cut it into {t1, t4, t5, t6} and {t2, t3}. The
         +-------a-------+          +-------a  a'----+       first piece has the smallest id and keeps a, the second
          \ t5  / #  t3 /            \ t5  / \  \ t3/        one gets the copy a', whose label is (id of a, id of t2).
           \   /   #   /              \   /   \  \ /
            \ / t4  # /                \ / t4  \  +
             +-------+                  +-------+

If a star has more than one piece, the piece with the smallest tet id keeps the node and each other piece gets a copy of
it. A single broken facet inside a body separates no node; a node separates if broken facets divide its star into
pieces.
"""

import numpy as np

from ..kernels.jit import njit, several, types
from ..mesh.faces import FACES
from ..model.growing import Rooms
from ..model.rows import MASS as MASS_ROW
from ..model.state import CHUNK, INTACT, Indices, Ints, Tets
from ..model.topology import keys
from .records import MESH

NODE, TET, RANK, MASS, BEHIND = 0, 1, 2, 3, 4
"""Columns of the table of stars, one row for each node and tet of its star: global ids of node and tet, rank of the
tet, bits of its mass, kg; for each of the three faces that contain the node the id of the tet behind it, -1 if the
face is not an intact facet."""
COLUMNS = 7
PLACE, CORNER, BLOCK = 0, 1, 2
"""Columns of the place of a row's tet: place in its block, corner that is the node, index of the block; all -1 for a
tet of another rank."""
_I1, _I2, _N1 = types.int64[::1], types.int64[:, ::1], types.int32[::1]


class Stars:
    """Stars of all nodes of one block: a pool of tets in which the tets of each node are contiguous.

    When a node separates, its range of the pool is divided among it and its copies.
    """

    def __init__(self, tets: Tets, nodes: int) -> None:
        """``tets`` (n, 4): local nodes of the tets; ``nodes``: number of local nodes."""
        corners = tets.reshape(-1)
        self.pool: Indices = (np.argsort(corners, kind="stable") // 4).astype(np.int32)
        """Places of the tets of the stars, node after node."""
        self.count: Indices = np.bincount(corners, minlength=nodes).astype(np.int32)
        """(nodes,) number of tets of each node."""
        self.first: Indices = (np.cumsum(self.count) - self.count).astype(np.int32)
        """(nodes,) start of the range of each node in the pool."""
        self._rooms = Rooms("first", "count")

    def grow(self, copies: int) -> None:
        """Appends new nodes without tets."""
        n = len(self.first)
        for room in self._rooms.of(self, copies):
            room[n : n + copies] = 0
        self._rooms.take(self, n + copies)

    def reconnect(self, tets: Tets, nodes: Ints, rows: Ints, places: Ints, of: Ints, new: int, block: int) -> None:
        """Sets the separated nodes in the tets (n, 4) of this block, and divides the ranges of the pool.

        ``rows`` (r, COLUMNS) of the complete stars of the local ``nodes`` (k,), sorted, and their ``places`` (r, 3);
        ``of`` (r,) the piece, -1 for the piece that keeps its node: piece 0 gets the local node ``new``; ``block``:
        index of this block.
        """
        _reconnect(self.pool, self.first, self.count, tets, nodes, rows, places, of, new, block)


@njit(several(_I2, _I2, _I1)(_I1, _N1, _N1, _N1, _I1, MESH, types.int64, types.int64), cache=True)
def describe(nodes, first, count, pool, ids, mesh, block, rank):  # type: ignore[no-untyped-def]
    """Returns the rows (r, COLUMNS) and places (r, 3) of the stars of ascending local ``nodes`` (k,) in one block,
    by node and tet, and (k + 1,) the start of the rows of each; ``ids``: global ids of all local nodes.
    """
    begin = np.zeros(len(nodes) + 1, np.int64)
    for i in range(len(nodes)):
        begin[i + 1] = begin[i] + count[nodes[i]]
    rows, places = np.empty((begin[-1], COLUMNS), np.int64), np.empty((begin[-1], 3), np.int64)
    bits = mesh.state.view(np.int64)
    for i in range(len(nodes)):
        a = nodes[i]
        star = pool[first[a] : first[a] + count[a]].copy()
        for s in range(1, len(star)):  # insertion sort, because a star has only about twenty tets
            e, r = star[s], s
            while r > 0 and mesh.id[star[r - 1]] > mesh.id[e]:
                star[r] = star[r - 1]
                r -= 1
            star[r] = e
        r = begin[i]
        for e in star:
            corner = 0
            while mesh.tets[e, corner] != a:
                corner += 1
            places[r, PLACE], places[r, CORNER], places[r, BLOCK] = e, corner, block
            rows[r, NODE], rows[r, TET], rows[r, RANK] = ids[a], mesh.id[e], rank
            rows[r, MASS] = bits[(e // CHUNK * mesh.columns + MASS_ROW) * CHUNK + e % CHUNK]
            for m in range(3):
                k = FACES[corner, m]
                held = mesh.across[e, k] >= 0 and mesh.bond[e, k] == INTACT
                rows[r, BEHIND + m] = mesh.across[e, k] // 4 if held else -1
            r += 1
    return rows, places, begin


def ordered(rows: Ints, places: Ints) -> tuple[Ints, Ints]:
    """Sorts rows by node and tet; ``places`` (p, 3) belong to the first p rows; the others get -1."""
    order = np.argsort(keys(rows[:, NODE], rows[:, TET]))
    every = np.concatenate([places, np.full((len(rows) - len(places), 3), -1)])
    return rows[order], every[order]


@njit("int64(int64[::1], int64)", cache=True)
def _root(parent, i):  # type: ignore[no-untyped-def]
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit("boolean(int64[::1], int64[:, ::1], int64[::1], int64, int64)", cache=True)
def _join(parent, rows, tets, begin, end):  # type: ignore[no-untyped-def]
    """Joins the rows of one star that are connected through intact facets; the root of each piece is its smallest row.
    Returns True if the star is a single piece.
    """
    apart = end - begin - 1
    for i in range(begin, end):
        for m in range(BEHIND, COLUMNS):
            behind, j = rows[i, m], i + 1
            if behind <= tets[i]:  # no facet, or a facet that was joined from the other side
                continue
            while j < end and tets[j] < behind:
                j += 1
            if j == end or tets[j] != behind:
                continue
            one, two = _root(parent, i), _root(parent, j)
            if one != two:
                parent[max(one, two)] = min(one, two)
                apart -= 1
        if not apart:
            return True
    return False


@njit(several(_I1, _I2, _I1, _N1, types.float64[::1])(_I2), cache=True)
def pieces(rows):  # type: ignore[no-untyped-def]
    """Returns the pieces that separate from their nodes, by node and smallest tet; ``rows`` by node and tet.

    (r,) the piece of each row, -1 in the piece with the smallest tet of its node, which keeps the node; and for each
    piece: ids of the node and of its smallest tet, place of the node among the nodes of ``rows``, rank of that tet, and
    a quarter of the mass of its tets, kg.
    """
    n, i_node = len(rows), 0
    parent, of, first, mass = np.arange(n), np.full(n, -1), np.empty(n, np.int64), np.zeros(n)
    node = np.empty(n, np.int64)
    tets, quarters = rows[:, TET].copy(), rows[:, MASS].copy().view(np.float64)
    begin, k = 0, 0
    while begin < n:
        end = begin
        while end < n and rows[end, NODE] == rows[begin, NODE]:
            end += 1
        whole = _join(parent, rows, tets, begin, end)
        for i in range(end if whole else begin + 1, end):
            root = _root(parent, i)
            if root == begin:
                continue
            if root == i:
                of[i], first[k], node[k] = k, i, i_node
                k += 1
            of[i] = of[root]
            mass[of[i]] += 0.25 * quarters[i]
        begin, i_node = end, i_node + 1
    labels, ranks = np.empty((k, 2), np.int64), np.empty(k, np.int32)
    for p in range(k):
        labels[p, 0], labels[p, 1], ranks[p] = rows[first[p], NODE], rows[first[p], TET], rows[first[p], RANK]
    return of, labels, node[:k].copy(), ranks, mass[:k].copy()


@njit(types.void(_N1, _N1, _N1, types.uint32[:, ::1], _I1, _I2, _I2, _I1, types.int64, types.int64), cache=True)
def _reconnect(pool, first, count, tets, nodes, rows, places, of, new, block):  # type: ignore[no-untyped-def]
    """See Stars.reconnect. The range of a node in the pool: first the tets that keep the node, then the tets of each
    copy, by id.
    """
    begin, n, k = 0, len(rows), 0
    while begin < n:
        end = begin
        while end < n and rows[end, NODE] == rows[begin, NODE]:
            end += 1
        at, piece = first[nodes[k]], -1
        while True:
            following, start = -1, at
            for r in range(begin, end):
                if of[r] > piece and (following < 0 or of[r] < following):
                    following = of[r]
                if places[r, BLOCK] == block and of[r] == piece:
                    pool[at] = places[r, PLACE]
                    at += 1
                    if piece >= 0:
                        tets[places[r, PLACE], places[r, CORNER]] = new + piece
            a = nodes[k] if piece < 0 else new + piece
            if piece < 0 or at > start:
                first[a], count[a] = start, at - start
            if following < 0:
                break
            piece = following
        begin, k = end, k + 1
