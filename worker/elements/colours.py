"""The tasks of a pass over a block: ranges of chunks, and their colours. Chunks of one colour share no node.

Colours are given greedily, chunk by chunk in the order of the block: each gets the first one that no chunk before it
with a node of its own has. They hold until tets move from chunk to chunk; nodes that separate only take neighbours
away.
"""

from dataclasses import dataclass

import numpy as np

from ..kernels.jit import njit
from ..model.state import CHUNK, Block, Ints

_BITS = 63
"""Colours that a word has bits for; a chunk that finds none free has a colour for itself alone."""


@dataclass(frozen=True)
class Coloured:
    """Tasks in the order of their colours."""

    tasks: Ints
    """(k, 2) first chunk and the one behind the last."""
    starts: Ints
    """(colours + 1,) the first task of each colour, and the end."""


@njit("void(uint32[:, ::1], int64, int64, int64[::1], int64[::1])", cache=True)
def _give(tets, begin, end, used, colour):  # type: ignore[no-untyped-def]
    """The ``colour`` (end - begin,) of each chunk; ``used`` (nodes,), zero before: the colours of a node's chunks."""
    single = _BITS
    for c in range(begin, end):
        taken = 0
        for e in range(c * CHUNK, min((c + 1) * CHUNK, len(tets))):
            for j in range(4):
                taken |= used[tets[e, j]]
        mine = 0
        while mine < _BITS and (taken >> mine) & 1:
            mine += 1
        if mine == _BITS:
            colour[c - begin] = single
            single += 1
            continue
        colour[c - begin] = mine
        for e in range(c * CHUNK, min((c + 1) * CHUNK, len(tets))):
            for j in range(4):
                used[tets[e, j]] |= np.int64(1) << mine


def coloured(block: Block, begin: int, end: int, nodes: int) -> Coloured:
    """The chunks ``begin`` to ``end`` of a block on a rank with so many ``nodes``, one a task."""
    colour = np.zeros(end - begin, np.int64)
    _give(block.tets[: block.n], begin, end, np.zeros(nodes, np.int64), colour)
    order = np.argsort(colour, kind="stable")
    tasks = begin + order[:, None] + np.arange(2)
    return Coloured(tasks, np.searchsorted(colour[order], np.arange(colour.max(initial=-1) + 2)))


def whole(begin: int, end: int) -> Coloured:
    """The chunks as one task."""
    return Coloured(np.array([[begin, end]]), np.array([0, 1]))
