"""Which tets hold together: connected pieces of a rank, joined with those of the others to fragments."""

import numpy as np

from ..ids import located, places, unique
from ..jit import njit
from ..parallel.comm import Comm
from ..state import Block, Indices, Ints, Model

_PART = 1 << 62
"""Added to the number of a part: the name of what joins its tets, above all tet ids."""
_WIDE = 128
"""Times as many ids as tets, up to which where each of them stands is laid out in a table. Chosen: it has no more bytes
than the state of the tets then."""


def labels(model: Model, held: Ints, comm: Comm) -> list[Ints]:
    """For each block (n,) the smallest global id of the tets that hold together with each tet; all ranks take part.

    Tets hold together through faces whose bond is whole, and through ``held``, (m, 2) global ids of pairs that a facet
    still joins; a pair is given on a rank that has one of the two. Without ``across`` a part is one piece.
    """
    ids = np.concatenate([np.zeros(0, np.int64), *(block.id for block in model.blocks)])
    known, place = _where(ids)
    root = np.arange(len(ids), dtype=np.int32)
    borders, first = [_across_pairs(root, held, ids, known, place)], 0
    for block in model.blocks:
        borders.append(_across(root, first, block, ids, known, place))
        first += block.n
    _settle(root)
    own, theirs = np.concatenate(borders).T
    names = _joined(ids, root, np.column_stack([ids[root[own]], theirs]), known, place, comm)
    return np.split(names, np.cumsum([block.n for block in model.blocks])[:-1]) if model.blocks else []


def count(model: Model, labels: list[Ints], comm: Comm) -> int:
    """How many fragments there are by these labels: one tet of each has its name; all ranks take part."""
    first = sum(int((block.id == of).sum()) for block, of in zip(model.blocks, labels, strict=True))
    return int(comm.sum(np.array([first]))[0])


def components(n: int, edges: Ints | Indices) -> Ints:
    """(n,) the smallest number that each of n things is connected with by ``edges``, (m, 2)."""
    return np.asarray(_roots(n, np.ascontiguousarray(edges, np.int64)))


def _where(ids: Ints) -> tuple[Ints, Indices]:
    """For ``_place``: nothing and where each id up to the largest stands, or the ids in order and where these stand."""
    end = int(ids.max(initial=-1)) + 1
    if end > _WIDE * len(ids):
        order = np.argsort(ids)
        return ids[order], order.astype(np.int32)
    place = np.full(end, -1, np.int32)
    place[ids] = np.arange(len(ids), dtype=np.int32)
    return ids[:0], place


def _across(root: Indices, first: int, block: Block, ids: Ints, known: Ints, place: Indices) -> Ints:
    """Joins the tets of a block, which stand from ``first`` on, with what is behind their whole faces; (k, 2) places of
    tets and what is behind them on other ranks.
    """
    if not block.n:
        return np.zeros((0, 2), np.int64)
    if not len(block.across):
        here = np.arange(first, first + block.n)
        _bind_all(root, here, ids)
        return np.array([[first, _PART + block.part]])
    border = np.empty((block.across.size, 2), np.int64)
    return border[: _bind_faces(border, root, first, block.across, block.bond, ids, known, place)]


def _across_pairs(root: Indices, held: Ints, ids: Ints, known: Ints, place: Indices) -> Ints:
    """The same of pairs of tets (m, 2)."""
    border = np.empty((len(held), 2), np.int64)
    return border[: _bind_pairs(border, root, np.ascontiguousarray(held.reshape(-1, 2)), ids, known, place)]


def _joined(ids: Ints, root: Indices, border: Ints, known: Ints, place: Indices, comm: Comm) -> Ints:
    """(n,) the names of the pieces of all tets, when those that meet at borders have become one.

    ``border`` (k, 2): pieces of this rank, and the tets of others that they hold together with.
    """
    borders = comm.join(border).reshape(-1, 2)
    if not len(borders):
        return ids[root]
    answers = comm.sum(_answers(borders, ids, root, known, place)) - 1
    parts = borders[:, 1] >= _PART
    answers[parts] = borders[parts, 1]
    edges = np.column_stack([borders[:, 0], answers])[answers >= 0]
    names = unique(edges)
    if not len(names):
        return ids[root]
    one = names[components(len(names), located(names, edges))]
    pieces = np.flatnonzero(root == np.arange(len(root)))
    at = places(names, ids[pieces])
    found = ids.copy()
    found[pieces] = np.where(at >= 0, one[at], ids[pieces])
    return np.asarray(found[root])


@njit("int64[::1](int64, int64[:, ::1])", cache=True)
def _roots(n, edges):  # type: ignore[no-untyped-def]
    """See ``components``: of two trees that an edge joins, the one of the larger root hangs onto the smaller root."""
    root = np.arange(n)
    for m in range(len(edges)):
        a, b = edges[m, 0], edges[m, 1]
        while root[a] != a:
            root[a] = a = root[root[a]]
        while root[b] != b:
            root[b] = b = root[root[b]]
        root[max(a, b)] = min(a, b)
    for a in range(n):
        root[a] = root[root[a]]
    return root


@njit("int64(int64[::1], int32[::1], int64)", cache=True, forceinline=True)
def _place(known, place, wanted):  # type: ignore[no-untyped-def]
    """Where the tet ``wanted`` stands, -1 where it is not here; see ``_where``."""
    if not len(known):
        return place[wanted] if wanted < len(place) else -1
    at = np.searchsorted(known, wanted)
    return place[at] if at < len(known) and known[at] == wanted else -1


@njit("void(int32[::1], int64, int64, int64[::1])", cache=True, forceinline=True)
def _bind(root, a, b, ids):  # type: ignore[no-untyped-def]
    """Joins the trees of the tets at ``a`` and ``b``: the root of the larger id hangs onto the other one."""
    while root[a] != a:
        root[a] = root[root[a]]
        a = root[a]
    while root[b] != b:
        root[b] = root[root[b]]
        b = root[b]
    if ids[a] < ids[b]:
        root[b] = a
    else:
        root[a] = b


@njit("void(int32[::1], int64[::1], int64[::1])", cache=True)
def _bind_all(root, chosen, ids):  # type: ignore[no-untyped-def]
    """Joins all of the tets at ``chosen``."""
    for m in range(1, len(chosen)):
        _bind(root, chosen[m - 1], chosen[m], ids)


@njit(
    "int64(int64[:, ::1], int32[::1], int64, int32[:, ::1], uint8[:, ::1], int64[::1], int64[::1], int32[::1])",
    cache=True,
)
def _bind_faces(border, root, first, across, bond, ids, known, place):  # type: ignore[no-untyped-def]
    """See ``_across``; sets the first rows of ``border`` and returns how many."""
    rows = 0
    for tet in range(len(across)):
        for face in range(4):
            if across[tet, face] < 0 or (len(bond) and bond[tet, face] != 0):
                continue
            other = across[tet, face] // 4
            at = _place(known, place, other)
            if at < 0:
                border[rows, 0], border[rows, 1] = first + tet, other
                rows += 1
            elif root[first + tet] != root[at]:
                _bind(root, first + tet, at, ids)
    return rows


@njit("int64(int64[:, ::1], int32[::1], int64[:, ::1], int64[::1], int64[::1], int32[::1])", cache=True)
def _bind_pairs(border, root, pairs, ids, known, place):  # type: ignore[no-untyped-def]
    """See ``_across_pairs``; sets the first rows of ``border`` and returns how many."""
    rows = 0
    for m in range(len(pairs)):
        a, b = _place(known, place, pairs[m, 0]), _place(known, place, pairs[m, 1])
        if a >= 0 and b >= 0:
            _bind(root, a, b, ids)
        elif a >= 0 or b >= 0:
            border[rows, 0], border[rows, 1] = (a, pairs[m, 1]) if a >= 0 else (b, pairs[m, 0])
            rows += 1
    return rows


@njit("void(int32[::1])", cache=True)
def _settle(root):  # type: ignore[no-untyped-def]
    """Hangs every tet onto its root."""
    for a in range(len(root)):
        b = root[a]
        while root[b] != b:
            root[b] = b = root[root[b]]
        root[a] = b


@njit("int64[::1](int64[:, ::1], int64[::1], int32[::1], int64[::1], int32[::1])", cache=True)
def _answers(borders, ids, root, known, place):  # type: ignore[no-untyped-def]
    """(k,) one more than the name of the piece of the second of each of ``borders`` (k, 2); 0 where it is not here."""
    found = np.zeros(len(borders), np.int64)
    for m in range(len(borders)):
        at = _place(known, place, borders[m, 1])
        if at >= 0:
            found[m] = ids[root[at]] + 1
    return found
