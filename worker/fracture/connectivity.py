"""Which tets hold together: connected pieces of a rank, joined with those of the others to fragments."""

import numpy as np

from ..ids import places
from ..jit import njit
from ..parallel.comm import Comm
from ..state import Block, Indices, Ints, Model

_PART = 1 << 62
"""Added to the number of a part: the name of what joins its tets, above all tet ids."""


def labels(model: Model, held: Ints, comm: Comm) -> list[Ints]:
    """For each block (n,) the smallest global id of the tets that hold together with each tet; all ranks take part.

    Tets hold together through faces whose bond is whole, and through ``held``, (m, 2) global ids of pairs that a facet
    still joins; a pair is given on a rank that has one of the two. Without ``across`` a part is one piece.
    """
    ids = np.concatenate([np.zeros(0, np.int64), *(block.id for block in model.blocks)])
    order = np.argsort(ids)
    known = ids[order]
    pairs = np.concatenate([held.reshape(-1, 2), *(_joints(block) for block in model.blocks)])
    at = places(known, pairs)
    here = at >= 0
    piece = known[components(len(known), at[here.all(axis=1)])]
    outer = np.flatnonzero(here[:, 0] != here[:, 1])
    inside = np.where(here[outer, 0], 0, 1)
    border = np.column_stack([piece[at[outer, inside]], pairs[outer, 1 - inside]])
    found = np.empty_like(ids)
    found[order] = _joined(np.unique(border, axis=0), known, piece, comm)
    return np.split(found, np.cumsum([block.n for block in model.blocks])[:-1]) if model.blocks else []


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


def components(n: int, edges: Ints | Indices) -> Ints:
    """(n,) the smallest number that each of n things is connected with by ``edges``, (m, 2)."""
    return np.asarray(_roots(n, np.ascontiguousarray(edges, np.int64)))


def _joints(block: Block) -> Ints:
    """(k, 2) global ids of tets of the block and of what they hold together with."""
    if not len(block.across):
        if not block.n:
            return np.zeros((0, 2), np.int64)
        chain = np.column_stack([block.id[:-1], block.id[1:]])
        return np.vstack([chain, [[block.id[0], _PART + block.part]]])
    whole = block.across >= 0
    if len(block.bond):
        whole &= block.bond == 0
    tet, face = np.nonzero(whole)
    return np.column_stack([block.id[tet], block.across[tet, face] // 4]).astype(np.int64)


def _joined(border: Ints, known: Ints, piece: Ints, comm: Comm) -> Ints:
    """``piece``, the names of the pieces of the tets ``known``, when those that meet at borders have become one.

    ``border`` (k, 2): pieces of this rank, and the tets of others that they hold together with.
    """
    borders = np.concatenate(comm.share(border))
    asked = np.unique(borders[:, 1])
    at = places(known, asked)
    answer = np.concatenate(comm.share(np.column_stack([asked[at >= 0], piece[at[at >= 0]]])))
    parts = asked[asked >= _PART]
    answer = np.vstack([answer[np.argsort(answer[:, 0])], np.column_stack([parts, parts])])
    at = places(answer[:, 0], borders[:, 1])
    edges = np.column_stack([borders[:, 0], answer[at, 1]])[at >= 0] if len(answer) else borders[:0]
    names = np.unique(edges)
    one = names[components(len(names), places(names, edges))]
    at = places(names, piece)
    return np.asarray(np.where(at >= 0, one[at], piece)) if len(one) else piece
