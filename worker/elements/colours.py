"""Tasks of a pass over a block: ranges of chunks with colours. Chunks of one colour share no node.

Greedy colouring in the order of the chunks: each chunk gets the first colour that no earlier chunk with a common node
has. The colours stay valid until tets move from chunk to chunk; separation of nodes only removes neighbours.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..kernels.jit import Kernel, njit
from ..model.state import CHUNK, Block, Ints
from ..parallel.arguments import Arguments
from ..parallel.team import Team

_BITS = 63
"""Number of colours in a word of bits. A chunk for which no colour is free gets an additional colour of its own."""


@dataclass(frozen=True)
class Coloured:
    """Tasks sorted by colour."""

    tasks: Ints
    """(k, 2) first chunk of each task, and one past the last chunk."""
    starts: Ints
    """(colours + 1,) first task of each colour; the last value is the number of tasks."""


@njit("void(uint32[:, ::1], int64, int64, int64[::1], int64[::1])", cache=True)
def _give(tets, begin, end, used, colour):  # type: ignore[no-untyped-def]
    """Sets the ``colour`` (end - begin,) of each chunk; ``used`` (nodes,), zero on entry: bits of the colours of the
    chunks of a node.
    """
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
    """Returns the chunks ``begin`` to ``end`` of a block, one a task; ``nodes``: number of nodes of the rank."""
    colour = np.zeros(end - begin, np.int64)
    _give(block.tets[: block.n], begin, end, np.zeros(nodes, np.int64), colour)
    order = np.argsort(colour, kind="stable")
    tasks = begin + order[:, None] + np.arange(2)
    return Coloured(tasks, np.searchsorted(colour[order], np.arange(colour.max(initial=-1) + 2)))


def whole(begin: int, end: int) -> Coloured:
    """Returns the chunks as one task."""
    return Coloured(np.array([[begin, end]]), np.array([0, 1]))


class TetPass:
    """A kernel that adds to the sums of the nodes of tets, to be run over the chunks of blocks."""

    def __init__(self, team: Team, kernel: Kernel, *kinds: Any) -> None:
        """``kernel``: of the signature team.TASK, over chunks; ``kinds``: numba types of its arguments."""
        self._team, self._kernel, self._arguments = team, kernel, Arguments(*kinds)
        self._known: dict[int, tuple[Block, int, Coloured]] = {}

    def run(self, block: Block, nodes: int, *values: Any) -> None:
        """Runs over the chunks of a block of a rank with so many ``nodes``; ``values``: the arguments."""
        if block.n:
            some = self._tasks(block, nodes)
            self._team.run(self._kernel, self._arguments.set(*values), some.tasks, some.starts)

    def _tasks(self, block: Block, nodes: int) -> Coloured:
        known, moved, some = self._known.get(block.part, (None, -1, None))
        if some is None or known is not block or moved != block.moved:
            alone = self._team.threads == 1
            some = whole(0, block.chunks) if alone else coloured(block, 0, block.chunks, nodes)
            self._known[block.part] = block, block.moved, some
        return some
