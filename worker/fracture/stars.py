r"""Stars of nodes. The star of a node is the set of tets around it. Broken facets cut a star into pieces.

Two tets of a star are in one piece if a chain of tets leads from one to the other through intact facets that contain
the node. A connection through an edge or through the node alone is a hinge; a hinge carries no moment and is separated.
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

If a star has more than one piece, the piece with the smallest tet id keeps the node, and each other piece gets a copy
of the node. A single broken facet inside of a body separates no node.
"""

from typing import ClassVar

import numpy as np

from ..kernels.jit import njit, several, types
from ..mesh.faces import FACES
from ..model.columns import ZERO
from ..model.growing import Scratch
from ..model.rows import MASS as MASS_ROW
from ..model.state import CHUNK, INTACT, Floats, Indices, Ints, Tets
from ..model.topology import keys
from ..parallel.arguments import reader
from ..parallel.passes import Pass
from ..parallel.team import TASK, Team
from .records import MESH, Mesh

NODE, TET, RANK, MASS, BEHIND = 0, 1, 2, 3, 4
"""Columns of the table of stars. The table has one row for each node and each tet of its star: global ids of node and
tet, rank of the tet, bit pattern of its mass, kg. For each of the three faces that contain the node, the row has the id
of the tet behind the face; -1 if the face is not an intact facet."""
COLUMNS = 7
PLACE, CORNER, BLOCK = 0, 1, 2
"""Columns of the place of the tet of a row: place of the tet in its block, corner of the tet that is the node, and
index of the block. All three are -1 for a tet of another rank."""
_I1, _I2, _N1 = types.int64[::1], types.int64[:, ::1], types.int32[::1]


_DESCRIBE = _I2, _I2, _I1, _I1, _N1, _N1, _N1, _I1, MESH, types.int64, types.int64
_CUT = _I1, _I1, _I1, _I2, _I1
_read_describe, _read_cut = reader(*_DESCRIBE), reader(*_CUT)
_NODES = 8
"""Number of nodes in a task; chosen value: a task takes 10 to 20 us, compared with 2 us to start a parallel region."""


class Stars:
    """Stars of all nodes of one block: a pool of tets in which the tets of each node are contiguous.

    When a node separates, its range in the pool is divided among the node and its copies.
    """

    COLUMNS: ClassVar = {"first": ZERO, "count": ZERO}
    """Columns with one value for each node (model/columns.py)."""

    def __init__(self, tets: Tets, nodes: int, threads: Team) -> None:
        """``tets`` (n, 4): local nodes of the tets; ``nodes``: number of local nodes."""
        corners = tets.reshape(-1)
        self.pool: Indices = (np.argsort(corners, kind="stable") // 4).astype(np.int32)
        """Places of the tets of the stars, ordered by node."""
        self.count: Indices = np.bincount(corners, minlength=nodes).astype(np.int32)
        """(nodes,) number of tets of each node."""
        self.first: Indices = (np.cumsum(self.count) - self.count).astype(np.int32)
        """(nodes,) start of the range of each node in the pool."""
        self._describe, self._scratch = Pass(threads, _describe, *_DESCRIBE, size=_NODES), Scratch()

    def drop(self, places: Indices) -> None:
        """Removes tets; ``places`` (n,): new place of each tet of the block, -1 for a removed tet."""
        moved = places[self.pool]
        kept = moved >= 0
        before = np.concatenate([[0], np.cumsum(kept)]).astype(np.int32)
        end = self.first + self.count
        self.count[:] = before[end] - before[self.first]
        self.first[:] = before[self.first]
        self.pool = moved[kept]

    def describe(self, nodes: Ints, ids: Ints, mesh: Mesh, block: int, rank: int) -> tuple[Ints, Ints, Ints]:
        """Returns three arrays that are valid until the next call: the rows (r, COLUMNS) of the stars of ``nodes`` in
        this block, ordered by node and tet; the places (r, 3) of the tets; and (k + 1,) the first row of each node.
        ``nodes`` (k,): local nodes, ascending; ``ids``: global ids of all local nodes.
        """
        begins = _begins(nodes, self.count)
        n = int(begins[-1])
        rows, places = self._scratch.of("rows", n, np.int64, COLUMNS), self._scratch.of("places", n, np.int64, 3)
        lists = self.first, self.count, self.pool
        self._describe.run(len(nodes), rows, places, begins, nodes, *lists, ids, mesh, block, rank)
        return rows, places, begins

    def reconnect(self, tets: Tets, nodes: Ints, rows: Ints, places: Ints, of: Ints, new: int, block: int) -> None:
        """Replaces separated nodes in the tets (n, 4) of this block, and divides the ranges of the pool.

        ``rows`` (r, COLUMNS): complete stars of the local ``nodes`` (k,), sorted; ``places`` (r, 3): places of their
        tets. ``of`` (r,): number of the piece of each row; -1 for the piece that keeps its node. Piece 0 gets the local
        node ``new``. ``block``: index of this block.
        """
        _reconnect(self.pool, self.first, self.count, tets, nodes, rows, places, of, new, block)


@njit(_I1(_I1, _N1), cache=True)
def _begins(nodes, count):  # type: ignore[no-untyped-def]
    """(k + 1,) first row of each of the ``nodes`` (k,)."""
    begins = np.zeros(len(nodes) + 1, np.int64)
    for i in range(len(nodes)):
        begins[i + 1] = begins[i] + count[nodes[i]]
    return begins


@njit(TASK, cache=True)
def _describe(table, begin, stop, thread):  # type: ignore[no-untyped-def]
    """Task: writes the rows of Stars.describe."""
    rows, places, begins, nodes, first, count, pool, ids, mesh, block, rank = _read_describe(table)
    for i in range(begin, stop):
        a = nodes[i]
        star = pool[first[a] : first[a] + count[a]]
        for s in range(1, len(star)):  # insertion sort, because a star has only about twenty tets
            e, r = star[s], s
            while r > 0 and mesh.id[star[r - 1]] > mesh.id[e]:
                star[r] = star[r - 1]
                r -= 1
            star[r] = e
        for s in range(len(star)):
            _row(rows, places, begins[i] + s, star[s], a, ids, mesh, block, rank)


@njit(
    types.void(_I2, _I2, types.int64, types.int64, types.int64, _I1, MESH, types.int64, types.int64), cache=True
)  # fmt: skip
def _row(rows, places, r, e, a, ids, mesh, block, rank):  # type: ignore[no-untyped-def]
    """Writes row ``r``, for node ``a`` and tet ``e``."""
    corner = 0
    while mesh.tets[e, corner] != a:
        corner += 1
    places[r, PLACE], places[r, CORNER], places[r, BLOCK] = e, corner, block
    rows[r, NODE], rows[r, TET], rows[r, RANK] = ids[a], mesh.id[e], rank
    mass = mesh.state[(e // CHUNK * mesh.columns + MASS_ROW) * CHUNK + e % CHUNK]
    rows[r, MASS] = np.float64(mass).view(np.int64)
    for m in range(3):
        k = FACES[corner, m]
        held = mesh.across[e, k] >= 0 and mesh.bond[e, k] == INTACT
        rows[r, BEHIND + m] = mesh.across[e, k] // 4 if held else -1


def ordered(rows: Ints, places: Ints) -> tuple[Ints, Ints]:
    """Sorts the rows by node and tet. ``places`` (p, 3): places of the tets of the first p rows; the other rows get the
    place -1.
    """
    order = np.argsort(keys(rows[:, NODE], rows[:, TET]))
    every = np.concatenate([places, np.full((len(rows) - len(places), 3), -1)])
    return rows[order], every[order]


@njit("int64(int64[::1], int64)", cache=True)
def _root(parent, i):  # type: ignore[no-untyped-def]
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit("boolean(int64[::1], int64[:, ::1], int64, int64)", cache=True)
def _join(parent, rows, begin, end):  # type: ignore[no-untyped-def]
    """Joins the rows of one star whose tets are connected through intact facets. The root of each piece is its row with
    the smallest number. Returns True if the star is a single piece.
    """
    apart = end - begin - 1
    for i in range(begin, end):
        for m in range(BEHIND, COLUMNS):
            behind, j = rows[i, m], i + 1
            if behind <= rows[i, TET]:  # the face is not a facet, or its facet was joined from the other side
                continue
            while j < end and rows[j, TET] < behind:
                j += 1
            if j == end or rows[j, TET] != behind:
                continue
            one, two = _root(parent, i), _root(parent, j)
            if one != two:
                parent[max(one, two)] = min(one, two)
                apart -= 1
        if not apart:
            return True
    return False


class Pieces:
    """Object that cuts stars into pieces on the threads of a rank."""

    def __init__(self, threads: Team) -> None:
        self._cut, self._scratch = Pass(threads, _cut, *_CUT, size=_NODES), Scratch()

    def of(self, rows: Ints, begins: Ints) -> tuple[Ints, Ints, Ints, Indices, Floats]:
        """Returns the pieces that separate from their nodes, ordered by node and smallest tet. ``rows``: star rows,
        ordered by node and tet; ``begins`` (k + 1,): first row of each node.

        The first result (r,) is the number of the piece of each row, -1 for the piece with the smallest tet, which
        keeps the node. The array is valid until the next call. Further results have one value for each piece: id of its
        node, id of its smallest tet, index of the node among the nodes of ``rows``, rank of the smallest tet, and a
        quarter of the mass of its tets, kg.
        """
        n = len(begins) - 1
        of, parent, many = (self._scratch.of(name, m) for name, m in (("of", len(rows)), ("p", len(rows)), ("m", n)))
        self._cut.run(n, of, many, parent, rows, begins)
        found: tuple[Ints, Ints, Indices, Floats] = _numbered(of, many, rows, begins)
        return of, *found


@njit(TASK, cache=True)
def _cut(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: numbers the pieces of each star. ``of`` (r,): number of the piece of each row; ``many`` (k,): number of
    pieces of each star.
    """
    of, many, parent, rows, begins = _read_cut(table)
    for i in range(first, stop):
        begin, end, k = begins[i], begins[i + 1], 0
        for r in range(begin, end):
            parent[r] = r
        whole = _join(parent, rows, begin, end)
        for r in range(begin, end):
            root = begin if whole else _root(parent, r)
            if root == begin:
                of[r] = -1
            elif root == r:
                of[r], k = k, k + 1
            else:
                of[r] = of[root]
        many[i] = k


@njit(several(_I2, _I1, _N1, types.float64[::1])(_I1, _I1, _I2, _I1), cache=True)
def _numbered(of, many, rows, begins):  # type: ignore[no-untyped-def]
    """Numbers the pieces of all stars. Returns the labels, nodes, ranks and masses of the pieces (Pieces.of)."""
    total = many.sum()
    labels, node = np.empty((total, 2), np.int64), np.empty(total, np.int64)
    ranks, mass, k = np.empty(total, np.int32), np.zeros(total), 0
    for i in range(len(many)):
        if many[i] == 0:
            continue
        last = -1
        for r in range(begins[i], begins[i + 1]):
            if of[r] < 0:
                continue
            if of[r] > last:  # this is the smallest tet of the next piece
                last = of[r]
                labels[k + last, 0], labels[k + last, 1] = rows[r, NODE], rows[r, TET]
                ranks[k + last], node[k + last] = rows[r, RANK], i
            of[r] += k
            mass[of[r]] += 0.25 * np.int64(rows[r, MASS]).view(np.float64)
        k += many[i]
    return labels, node, ranks, mass


@njit(_I1(_I2), cache=True)
def node_begins(rows):  # type: ignore[no-untyped-def]
    """(k + 1,) first row of each node in ``rows``, which are the rows of stars, ordered by node."""
    begins, n = np.empty(len(rows) + 1, np.int64), 0
    for r in range(len(rows)):
        if r == 0 or rows[r, NODE] != rows[r - 1, NODE]:
            begins[n], n = r, n + 1
    begins[n] = len(rows)
    return begins[: n + 1].copy()


@njit(types.void(_N1, _N1, _N1, types.uint32[:, ::1], _I1, _I2, _I2, _I1, types.int64, types.int64), cache=True)
def _reconnect(pool, first, count, tets, nodes, rows, places, of, new, block):  # type: ignore[no-untyped-def]
    """Divides the pool ranges of separated nodes for Stars.reconnect. After the division the range of a node has first
    the tets that keep the node, then the tets of each copy, ordered by id.
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
