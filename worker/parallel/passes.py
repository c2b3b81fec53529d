"""Passes over a range, cut into tasks of equal size. The threads of a rank share the tasks."""

from typing import Any

import numpy as np

from ..kernels.jit import Kernel
from ..model.state import Ints
from .arguments import Arguments
from .team import Stage, Team

NODES_OF_A_TASK = 4096
"""Number of nodes in a task. Chosen value: a task is 10 us of work; a region of threads costs 2 us."""


class Ranges:
    """Runs kernels of the signature team.TASK over ranges on a team of threads.

    Tasks may run at the same time, so they must not write to the same memory. The number of the task that begins at
    index ``first`` is ``first`` divided by ``size``.
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
        """Return the run over the range from 0 to ``n`` as a stage of a program. The stage is valid until another
        range is requested.
        """
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
    """A kernel with its table of arguments, to be run over ranges."""

    def __init__(self, team: Team, kernel: Kernel, *kinds: Any, size: int = NODES_OF_A_TASK) -> None:
        """``kinds``: numba types of the arguments; ``size``: length of a task."""
        self._ranges, self._kernel, self._arguments = Ranges(team, size), kernel, Arguments(*kinds)

    def run(self, n: int, *values: Any) -> None:
        """Run over the range from 0 to ``n``; ``values``: the arguments."""
        if n:
            self._ranges.run(self._kernel, self._arguments.set(*values), n)

    def stage(self, n: int, *values: Any) -> Stage:
        """Return the run as a stage of a program. The stage is valid until other arguments or another range are
        requested.
        """
        return self._ranges.stage(self._kernel, self._arguments.set(*values), n)

    def many(self, n: int) -> int:
        """Return the number of tasks of the range from 0 to ``n``."""
        return self._ranges.many(n)
