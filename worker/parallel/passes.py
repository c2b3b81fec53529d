"""Passes over a range, cut into tasks of equal size, which the threads of a rank share."""

from typing import Any

import numpy as np

from ..kernels.jit import Kernel
from ..model.state import Ints
from .arguments import Arguments
from .team import Stage, Team

NODES_OF_A_TASK = 4096
"""Nodes of a task. Chosen: 10 us of work, against 2 us for a region of threads."""


class Ranges:
    """Runs kernels of the signature team.TASK over ranges on a team of threads.

    Tasks may run at the same time, so they must not write to the same memory. The task that begins at ``first`` has the
    number ``first

    size``.
    """

    def __init__(self, team: Team, size: int = NODES_OF_A_TASK) -> None:
        """``size``: length of a task."""
        self.threads, self.size = team.threads, size
        self._team = team
        self._tasks, self._starts, self._n = np.zeros((0, 2), np.int64), np.zeros(2, np.int64), 0

    def run(self, kernel: Kernel, table: int, n: int) -> None:
        """Run over the range from 0 to ``n``, with the arguments at the address ``table``."""
        if n:
            self._team.run(kernel, table, self._cut(n), self._starts)

    def stage(self, kernel: Kernel, table: int, n: int) -> Stage:
        """The same as a stage of a program, until another range is asked for."""
        return Stage(kernel, table, self._cut(n), self._starts)

    def many(self, n: int) -> int:
        """Return the number of tasks of the range from 0 to ``n``."""
        return -(-n // self.size)

    def _cut(self, n: int) -> Ints:
        many = self.many(n)
        if many > len(self._tasks):
            first = self.size * np.arange(2 * many)
            self._tasks = np.column_stack([first, first + self.size])
        if n != self._n:
            before = self.many(self._n) - 1
            self._tasks[before, 1] = self._tasks[before, 0] + self.size
            self._tasks[many - 1, 1], self._starts[1], self._n = n, many, n
        return self._tasks[:many]


class Pass:
    """A kernel with its table of arguments, run over ranges."""

    def __init__(self, team: Team, kernel: Kernel, *kinds: Any, size: int = NODES_OF_A_TASK) -> None:
        """``kinds``: numba types of the arguments; ``size``: length of a task."""
        self._ranges, self._kernel, self._arguments = Ranges(team, size), kernel, Arguments(*kinds)

    def run(self, n: int, *values: Any) -> None:
        """Run over the range from 0 to ``n``; ``values``: the arguments."""
        if n:
            self._ranges.run(self._kernel, self._arguments.set(*values), n)

    def stage(self, n: int, *values: Any) -> Stage:
        """The same as a stage of a program, until other arguments or another range are asked for."""
        return self._ranges.stage(self._kernel, self._arguments.set(*values), n)

    def many(self, n: int) -> int:
        """Return the number of tasks of the range from 0 to ``n``."""
        return self._ranges.many(n)
