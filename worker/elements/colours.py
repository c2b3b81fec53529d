"""Tasks of a pass over a block of tets. A task is a range of chunks, and each chunk has a colour. Chunks of one colour
share no node.

Greedy colouring in the order of the chunks: each chunk gets the first colour that no earlier chunk with a common node
has. The colours remain valid until tets move from chunk to chunk. A separation of nodes only removes common nodes.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..kernels.jit import Kernel, njit
from ..model.state import CHUNK, Block, Ints
from ..parallel.arguments import Arguments
from ..parallel.team import Team

_BITS = 63
"""Number of colours whose bits fit into an integer. If no colour is free for a chunk, the chunk gets a further colour
that no other chunk has."""


@dataclass(frozen=True)
class Coloured:
    """Tasks of a pass, sorted by colour."""

    tasks: Ints
    """(k, 2) for each task its first chunk, and its last chunk plus 1."""
    starts: Ints
    """(colours + 1,) first task of each colour; the last value is the number of tasks."""


@njit("void(uint32[:, ::1], int64, int64, int64[::1], int64[::1])", cache=True)
def _give(tets, begin, end, used, colour):  # type: ignore[no-untyped-def]
    """Sets the ``colour`` (end - begin,) of each chunk. ``used`` (nodes,), zero on entry: bit k is set if a chunk of
    the node has the colour k.
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
    """Returns the chunks from ``begin`` to ``end`` of a block as tasks of one chunk each; ``nodes``: number of nodes of
    the rank.
    """
    colour = np.zeros(end - begin, np.int64)
    _give(block.tets[: block.n], begin, end, np.zeros(nodes, np.int64), colour)
    return _sorted(colour, begin)


def joined(blocks: list[Block], nodes: int) -> Coloured:
    """Returns the chunks of several blocks as tasks of one chunk each. The chunks are numbered over all blocks; chunks
    of one colour share no node, also if they belong to different blocks. ``nodes``: number of nodes of the rank.
    """
    used, colours, before = np.zeros(nodes, np.int64), [], 0
    for block in blocks:
        colour = np.zeros(block.chunks, np.int64)
        _give(block.tets[: block.n], 0, block.chunks, used, colour)
        colour[colour >= _BITS] += before
        before += block.chunks
        colours.append(colour)
    return _sorted(np.concatenate(colours), 0)


def _sorted(colour: Ints, begin: int) -> Coloured:
    """Returns the chunks from ``begin`` on as tasks, sorted by the ``colour`` (k,) of each chunk."""
    order = np.argsort(colour, kind="stable")
    tasks = begin + order[:, None] + np.arange(2)
    return Coloured(tasks, np.searchsorted(colour[order], np.arange(colour.max(initial=-1) + 2)))


def whole(begin: int, end: int) -> Coloured:
    """Returns the chunks from ``begin`` to ``end`` as one task."""
    return Coloured(np.array([[begin, end]]), np.array([0, 1]))


class TetPass:
    """Kernel that runs over the chunks of blocks and adds values to sums at nodes."""

    def __init__(self, team: Team, kernel: Kernel, *kinds: Any) -> None:
        """``kernel``: kernel with the signature team.TASK; its range is a range of chunks. ``kinds``: numba types of
        its arguments.
        """
        self._team, self._kernel, self._arguments = team, kernel, Arguments(*kinds)
        self._known: dict[int, tuple[Block, int, Coloured]] = {}

    def run(self, block: Block, nodes: int, *values: Any) -> None:
        """Runs the kernel over the chunks of a block. ``nodes``: number of nodes of the rank; ``values``: arguments of
        the kernel.
        """
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
