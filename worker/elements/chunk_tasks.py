"""Tasks of the passes over the tets of a rank, and passes over all blocks in one parallel region.

With one region for each block, the threads would wait for each other after the last chunks of each block; a part of few
chunks, or a part that is at rest except for few chunks, would keep only one thread busy.
"""

import numpy as np

from ..kernels.jit import Kernel, njit, types
from ..model.state import Block, Floats, Ints
from ..parallel.arguments import Arguments, reader
from ..parallel.team import TASK, Team
from ..parallel.words import call_task, now
from .colours import Coloured, coloured, joined, whole

_KINDS = types.int64, types.int64[::1], types.int64[::1], types.int64[:, ::1]
_read = reader(*_KINDS)
_CLOCK, _LINE = 2, 8
"""Number of words in which a thread reads the clock, at the beginning of its row of times; and number of words in a
cache line. The row of a thread is a multiple of a cache line, so that threads do not write to the same line."""


class ChunkTasks:
    """Tasks of ranges of chunks, coloured if the rank has several threads."""

    def __init__(self, team: Team) -> None:
        self._team, self._arguments = team, Arguments(*_KINDS)
        self._coloured: dict[tuple[int, int], tuple[int, Coloured]] = {}
        """Tasks of ranges of chunks; the key is the part and the first chunk. Each entry also has the value of
        ``Block.moved`` (count of moved tets) for which its tasks are valid."""
        self._known: tuple[tuple[int, int, int], ...] = ()
        self._tasks = Coloured(np.zeros((0, 2), np.int64), np.zeros(1, np.int64))
        self._begins, self._spent = np.zeros(1, np.int64), np.zeros((0, 0), np.int64)

    def of(self, block: Block, begin: int, end: int, nodes: int) -> Coloured:
        """Returns the tasks of the chunks from ``begin`` to ``end`` of a block; ``nodes``: number of nodes of the
        rank.
        """
        moved, known = self._coloured.get((block.part, begin), (-1, None))
        if known is None or moved != block.moved:
            known = whole(begin, end) if self._team.threads == 1 else coloured(block, begin, end, nodes)
            self._coloured[block.part, begin] = block.moved, known
        return known

    def run_joined(self, kernel: Kernel, tables: list[int], blocks: list[Block], nodes: int) -> Floats:
        """Runs the kernel over all chunks of the blocks in one parallel region. ``tables``: address of the arguments of
        each block; ``nodes``: number of nodes of the rank. Returns the fraction (blocks,) of the time that was spent on
        each block.
        """
        if (key := tuple((block.part, block.moved, block.chunks) for block in blocks)) != self._known:
            self._known, self._tasks = key, joined(blocks, nodes)
            self._begins = np.cumsum([0, *(block.chunks for block in blocks)])
            row = -(-(_CLOCK + len(blocks)) // _LINE) * _LINE
            self._spent = np.zeros((self._team.threads, row), np.int64)
        self._spent[:] = 0
        table = self._arguments.set(kernel.address, np.array(tables), self._begins, self._spent)
        self._team.run(_over, table, self._tasks.tasks, self._tasks.starts)
        spent: Ints = self._spent[:, _CLOCK : _CLOCK + len(blocks)].sum(axis=0)
        return np.asarray(spent / max(int(spent.sum()), 1))


@njit(TASK, cache=True)
def _over(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs the kernel over one chunk, ``first``, counted over all blocks."""
    kernel, tables, begins, spent = _read(table)
    b = np.searchsorted(begins, first, side="right") - 1
    began = now(spent[thread], 0)
    call_task(kernel, tables[b], first - begins[b], stop - begins[b], thread)
    spent[thread, _CLOCK + b] += now(spent[thread], 0) - began
