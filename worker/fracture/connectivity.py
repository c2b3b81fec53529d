"""Connected components of tets: pieces on each rank, joined across ranks to fragments.

Union-find by Rem's algorithm: each tet points to a tet of smaller id, and the paths of two tets to their roots are
merged while they are walked (Patwary, Blair and Manne, Experiments on union-find algorithms, 2010).
"""

import numpy as np

from ..kernels.jit import njit
from ..model.ids import IdIndex, located, places, unique
from ..model.state import Block, Indices, Ints, Model
from ..parallel.comm import Comm

_PART = 1 << 62
"""Offset above all tet ids. The offset plus the number of a part is the name of a node of the graph that connects
all tets of a part without facets."""


def labels(model: Model, held: Ints, comm: Comm) -> list[Ints]:
    """Labels of fragments, (n,) for each block, a label for each tet: the smallest global id of its tets. Collective.

    Tets are connected through faces whose bond is intact, and through ``held``, (m, 2) global ids of tets of cohesive
    facets; a pair is given on a rank that has at least one of the two tets. A block without the array ``across`` is one
    piece.
    """
    ids = np.concatenate([np.zeros(0, np.int64), *(block.id for block in model.blocks)])
    where, root, first = IdIndex(ids), np.arange(len(ids), dtype=np.int32), 0
    borders = [_bind_held(root, ids, where, held.reshape(-1, 2))]
    for block in model.blocks:
        borders.append(_bind_block(root, ids, where, block, first))
        first += block.n
    _settle(root)
    own, theirs = np.concatenate(borders).T
    names = _joined(np.column_stack([ids[root[own]], theirs]), root, ids, where, comm)
    return np.split(names, np.cumsum([block.n for block in model.blocks])[:-1]) if model.blocks else []


def count(model: Model, labels: list[Ints], comm: Comm) -> int:
    """Returns the number of fragments with these labels: exactly one tet of each has the label as its id.
    Collective.
    """
    named = sum(int((block.id == of).sum()) for block, of in zip(model.blocks, labels, strict=True))
    return int(comm.sum(np.array([named]))[0])


def components(n: int, edges: Ints | Indices) -> Ints:
    """(n,) the smallest number in the connected component of each of the numbers 0 to n - 1; ``edges`` (m, 2)."""
    root = np.arange(n, dtype=np.int32)
    _bind(root, np.ascontiguousarray(edges, np.int64), np.arange(n))
    _settle(root)
    return root.astype(np.int64)


def _bind_held(root: Indices, ids: Ints, where: IdIndex, pairs: Ints) -> Ints:
    """Joins pairs of tets (m, 2); returns, for pairs across ranks, (k, 2) the place of the tet on this rank and the id
    of the other tet.
    """
    at = where.places(pairs)
    here = at >= 0
    _bind(root, at[here.all(axis=1)].astype(np.int64), ids)
    outer = np.flatnonzero(here[:, 0] != here[:, 1])
    inside = np.where(here[outer, 0], 0, 1)
    return np.column_stack([at[outer, inside].astype(np.int64), pairs[outer, 1 - inside]])


def _bind_block(root: Indices, ids: Ints, where: IdIndex, block: Block, first: int) -> Ints:
    """Joins the tets of a block, whose places begin at ``first``, through their intact faces; returns (k, 2) as
    ``_bind_held``.
    """
    if not block.n:
        return np.zeros((0, 2), np.int64)
    if not len(block.across):
        here = np.arange(first, first + block.n)
        _bind(root, np.column_stack([here[:-1], here[1:]]), ids)
        return np.array([[first, _PART + block.part]])
    pairs, outer = np.empty((block.across.size, 2), np.int64), np.empty(block.across.size, np.int64)
    inner, rest = _across_faces(pairs, outer, where.places(block.across >> 2), block.across, block.bond, first)
    _bind(root, pairs[:inner], ids)
    outer = outer[:rest]
    return np.column_stack([first + (outer >> 2), block.across.reshape(-1)[outer] >> 2])


def _joined(border: Ints, root: Indices, ids: Ints, where: IdIndex, comm: Comm) -> Ints:
    """(n,) labels of all tets, after the pieces of all ranks have been joined.

    ``border`` (k, 2): labels of pieces of this rank, and ids of the tets of other ranks that they are connected
    with. Collective.
    """
    asking, asked = comm.join(border).reshape(-1, 2).T
    at = where.places(asked)
    named = ids[root]
    mine = np.flatnonzero(at >= 0)
    answers = np.zeros(len(asked), np.int64)
    answers[mine] = 1 + named[at[mine]]
    answers = comm.sum(answers) - 1
    answers[asked >= _PART] = asked[asked >= _PART]
    edges = np.column_stack([asking, answers])[answers >= 0]
    if not len(edges):
        return np.asarray(named)
    names = unique(edges)
    one = names[components(len(names), located(names, edges))]
    pieces = np.flatnonzero(root == np.arange(len(root)))
    at = places(names, ids[pieces])
    joined = ids.copy()
    joined[pieces] = np.where(at >= 0, one[at], ids[pieces])
    return np.asarray(joined[root])


@njit("void(int32[::1], int64[:, ::1], int64[::1])", cache=True)
def _bind(root, pairs, ids):  # type: ignore[no-untyped-def]
    """Joins the trees ``root`` (n,) of pairs (m, 2) of places of tets."""
    for m in range(len(pairs)):
        a, b = pairs[m, 0], pairs[m, 1]
        while root[a] != root[b]:
            if ids[root[a]] < ids[root[b]]:
                a, b = b, a
            above = root[a]
            root[a] = root[b]
            if above == a:
                break
            a = above


@njit("UniTuple(int64, 2)(int64[:, ::1], int64[::1], int32[:, ::1], int32[:, ::1], uint8[:, ::1], int64)", cache=True)
def _across_faces(pairs, outer, behind, across, bond, first):  # type: ignore[no-untyped-def]
    """Fills ``pairs`` with the places of tets of a block and of the tets ``behind`` their intact faces, and ``outer``
    with the faces, 4 * tet + face, whose other tet is on another rank; returns the number of pairs and the number of
    faces.
    """
    inner, rest = 0, 0
    for tet in range(len(behind)):
        for face in range(4):
            if across[tet, face] < 0 or (len(bond) and bond[tet, face] != 0):
                continue
            if behind[tet, face] < 0:
                outer[rest] = 4 * tet + face
                rest += 1
            else:
                pairs[inner, 0], pairs[inner, 1] = first + tet, behind[tet, face]
                inner += 1
    return inner, rest


@njit("void(int32[::1])", cache=True)
def _settle(root):  # type: ignore[no-untyped-def]
    """Points every tet directly at its root."""
    for a in range(len(root)):
        b = root[a]
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        root[a] = b
