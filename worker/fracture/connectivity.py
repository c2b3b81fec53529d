"""Connected components of tets. Pieces are found on each rank and then joined across ranks to fragments.

The union-find algorithm is Rem's: each tet points to a tet of smaller id, and the paths from two tets to their roots
are merged while the algorithm follows them (Patwary, Blair and Manne, Experiments on union-find algorithms, 2010).
"""

import numpy as np

from ..kernels.jit import njit, types
from ..model.growing import Scratch
from ..model.ids import IdIndex, located, places, unique
from ..model.state import Block, Indices, Ints, Model
from ..parallel.arguments import reader
from ..parallel.comm import Comm
from ..parallel.passes import Pass
from ..parallel.team import TASK, Team, team

_PART = 1 << 62
"""Offset that is larger than all tet ids. For each part without facets the graph has one more node, which connects all
tets of the part. The number of the node of a part is the offset plus the number of the part."""
_TETS = 4096
"""Number of tets in a task. Chosen value: in a bar of 55,000 tets, 7 % of the facets are between tets of two different
tasks, and a single thread joins the tets at these facets."""
_NOWHERE, _ELSEWHERE = -1, -2
"""Values that replace the place of a neighbour tet: no tet, and a tet on another rank."""
_I, _I1, _N1, _N2 = types.int64, types.int64[::1], types.int32[::1], types.int32[:, ::1]
_BIND = _N1, _I1, _N1, _I1, _N2, _N2, types.uint8[:, ::1], _I
_NAME = _I1, _N1, _I1
_read_bind, _read_name = reader(*_BIND), reader(*_NAME)


class Connectivity:
    """Connectivity of the tets of one rank, computed by the threads. The object stores the places of the neighbour tets
    until the tets of the rank change.
    """

    def __init__(self, model: Model, comm: Comm, threads: Team) -> None:
        self._model, self._comm = model, comm
        self._bind = Pass(threads, _bind_range, *_BIND, size=_TETS)
        self._name = Pass(threads, _name_range, *_NAME, size=_TETS)
        self._scratch, self._of = Scratch(), [(-1, -1)]

    def labels(self, held: Ints) -> list[Ints]:
        """Returns the label of the fragment of each tet, (n,) for each block of tets. A label is the smallest global id
        of the tets of the fragment. Collective.

        Two tets are connected if the facet between them is intact, or if a cohesive facet connects them. ``held`` (m,
        2): global ids of the two tets of each cohesive facet that has at least one tet on this rank. A block of tets
        without the array ``across`` is a single piece.
        """
        blocks = self._model.blocks
        self._look_up()
        root, first, borders = np.arange(len(self._ids), dtype=np.int32), 0, list[Ints]()
        for block, beside in zip(blocks, self._beside, strict=True):
            borders.append(self._bind_block(root, block, beside, first))
            first += block.n
        borders.append(_bind_held(root, self._ids, self._where, held.reshape(-1, 2)))
        names = np.empty(len(root), np.int64)
        self._name.run(len(root), names, root, self._ids)
        names = _joined(np.concatenate(borders), names, root, self._ids, self._where, self._comm)
        return np.split(names, np.cumsum([block.n for block in blocks])[:-1]) if blocks else []

    def _look_up(self) -> None:
        """Finds the places of the neighbour tets behind all faces, if the tets of the rank have changed."""
        blocks = self._model.blocks
        if self._of == (now := [(block.n, block.moved) for block in blocks]):
            return
        self._of = now
        self._ids = np.concatenate([np.zeros(0, np.int64), *(block.id for block in blocks)])
        self._where = IdIndex(self._ids)
        self._beside = [_beside(self._where, block) for block in blocks]

    def _bind_block(self, root: Indices, block: Block, beside: Indices, first: int) -> Ints:
        """Joins the tets of a block through their intact faces. ``first``: number of the first tet of the block among
        the tets of the rank. Returns the pairs across ranks, (k, 2), see ``_bind_held``.
        """
        if not block.n:
            return np.zeros((0, 2), np.int64)
        if not len(block.across):
            here = np.arange(first, first + block.n)
            _bind(root, np.column_stack([here[:-1], here[1:]]), self._ids)
            return np.array([[int(self._ids[first]), _PART + block.part]])
        outer = self._scratch.of("outer", 4 * block.n, np.int32)
        counts = self._scratch.of("counts", self._bind.many(block.n))
        self._bind.run(block.n, root, self._ids, outer, counts, beside, block.across, block.bond, first)
        rest = _bind_outer(root, self._ids, outer, counts, beside, first)
        outer = outer[:rest]
        return np.column_stack([self._ids[first + (outer >> 2)], block.across.reshape(-1)[outer] >> 2])


def labels(model: Model, held: Ints, comm: Comm) -> list[Ints]:
    """Returns the labels of the fragments of a model, computed by one thread; see ``Connectivity.labels``.
    Collective.
    """
    return Connectivity(model, comm, team(1)).labels(held)


def _beside(where: IdIndex, block: Block) -> Indices:
    """(n, 4) places of the tets behind the faces of a block."""
    at = where.places(block.across >> 2)
    return np.where(block.across < 0, np.int32(_NOWHERE), np.where(at < 0, np.int32(_ELSEWHERE), at))


def count(model: Model, labels: list[Ints], comm: Comm) -> int:
    """Returns the number of fragments of all ranks. Each fragment has exactly one tet whose id is the label of the
    fragment; these tets are counted. Collective.
    """
    named = sum(int((block.id == of).sum()) for block, of in zip(model.blocks, labels, strict=True))
    return int(comm.sum(np.array([named]))[0])


def components(n: int, edges: Ints | Indices) -> Ints:
    """(n,) the smallest number in the connected component of each number from 0 to n - 1; ``edges`` (m, 2): connected
    pairs of numbers.
    """
    root = np.arange(n, dtype=np.int32)
    _bind(root, np.ascontiguousarray(edges, np.int64), np.arange(n))
    _settle(root)
    return root.astype(np.int64)


def _bind_held(root: Indices, ids: Ints, where: IdIndex, pairs: Ints) -> Ints:
    """Joins the tets of each pair in ``pairs`` (m, 2). Returns the pairs across ranks, (k, 2): id of the tet on this
    rank, id of the other tet.
    """
    if not len(pairs):
        return np.zeros((0, 2), np.int64)
    at = where.places(pairs)
    here = at >= 0
    _bind(root, at[here.all(axis=1)].astype(np.int64), ids)
    outer = np.flatnonzero(here[:, 0] != here[:, 1])
    inside = np.where(here[outer, 0], 0, 1)
    return np.column_stack([pairs[outer, inside], pairs[outer, 1 - inside]])


def _joined(border: Ints, names: Ints, root: Indices, ids: Ints, where: IdIndex, comm: Comm) -> Ints:
    """(n,) labels of all tets, after the pieces of all ranks have been joined.

    ``border`` (k, 2): pairs of connected tets, first the id of a tet of this rank, then the id of a tet of another
    rank. ``names`` (n,): labels of the pieces of this rank. Collective.
    """
    asking, asked = comm.join(np.column_stack([names[where.places(border[:, 0])], border[:, 1]])).reshape(-1, 2).T
    if not len(asked):
        return names
    at = where.places(asked)
    mine = np.flatnonzero(at >= 0)
    answers = np.zeros(len(asked), np.int64)
    answers[mine] = 1 + names[at[mine]]
    answers = comm.sum(answers) - 1
    answers[asked >= _PART] = asked[asked >= _PART]
    edges = np.column_stack([asking, answers])[answers >= 0]
    if not len(edges):
        return names
    known = unique(edges)
    one = known[components(len(known), located(known, edges))]
    at = places(known, names)
    return np.where(at >= 0, one[at], names)


@njit("void(int32[::1], int64[::1], int64, int64)", cache=True)
def _unite(root, ids, a, b):  # type: ignore[no-untyped-def]
    """Joins the trees that contain the tet places ``a`` and ``b``; ``root`` (n,): parent of each tet."""
    while root[a] != root[b]:
        if ids[root[a]] < ids[root[b]]:
            a, b = b, a
        above = root[a]
        root[a] = root[b]
        if above == a:
            break
        a = above


@njit("void(int32[::1], int64[:, ::1], int64[::1])", cache=True)
def _bind(root, pairs, ids):  # type: ignore[no-untyped-def]
    """Joins the trees of each pair of tet places, (m, 2); ``root`` (n,): parent of each tet."""
    for m in range(len(pairs)):
        _unite(root, ids, pairs[m, 0], pairs[m, 1])


@njit(TASK, cache=True)
def _bind_range(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: joins the tets of a range of a block through the intact faces between them. Lists in ``outer`` the faces, 4
    * tet + face, whose other tet is outside of the range.

    A face between two tets of a block is used once, from its first tet. A face between two blocks is used from both
    sides, because its facet may have a different state in each block.
    """
    root, ids, outer, counts, beside, across, bond, begin = _read_bind(table)
    n = 4 * first
    for tet in range(first, stop):
        for face in range(4):
            b = beside[tet, face]
            if across[tet, face] < 0 or (begin <= b < begin + tet) or (len(bond) and bond[tet, face] != 0):
                continue
            if begin <= b < begin + stop:
                _unite(root, ids, begin + tet, b)
            else:
                outer[n], n = 4 * tet + face, n + 1
    counts[first // _TETS] = n - 4 * first


@njit("int64(int32[::1], int64[::1], int32[::1], int64[::1], int32[:, ::1], int64)", cache=True)
def _bind_outer(root, ids, outer, counts, beside, begin):  # type: ignore[no-untyped-def]
    """Joins the tets of the listed faces. Writes the faces whose other tet is on another rank to the first elements of
    ``outer``, and returns the number of these faces.
    """
    rest = 0
    for k in range(len(counts)):
        for i in range(4 * _TETS * k, 4 * _TETS * k + counts[k]):
            tet, face = outer[i] >> 2, outer[i] & 3
            if beside[tet, face] >= 0:
                _unite(root, ids, begin + tet, beside[tet, face])
            else:
                outer[rest], rest = outer[i], rest + 1
    return rest


@njit(TASK, cache=True)
def _name_range(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets the ``names`` of tets to the global ids of the roots of their trees."""
    names, root, ids = _read_name(table)
    for a in range(first, stop):
        b = root[a]
        while root[b] != b:
            b = root[b]
        names[a] = ids[b]


@njit("void(int32[::1])", cache=True)
def _settle(root):  # type: ignore[no-untyped-def]
    """Sets the parent of every tet to the root of its tree."""
    for a in range(len(root)):
        b = root[a]
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        root[a] = b
