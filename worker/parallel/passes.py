"""Passes over a range that is cut into tasks of equal size. The threads of a rank share the tasks."""

from typing import Any

import numpy as np

from ..kernels.jit import Kernel
from ..model.state import Ints
from .arguments import Arguments, Tie
from .team import Stage, Team

NODES_OF_A_TASK = 4096
"""Number of nodes in a task. Chosen value: a task takes 10 us, compared with 2 us to start a parallel region."""


class _Range:
    """A range of indices from 0 on, cut into tasks of equal size. Only the last task may be shorter."""

    def __init__(self, team: Team, size: int) -> None:
        """``size``: length of a task."""
        self.threads, self.size = team.threads, size
        self._team = team
        self._room, self._starts, self._n = np.zeros((0, 2), np.int64), np.zeros(2, np.int64), 0
        self._tasks: Ints = self._room

    def many(self, n: int) -> int:
        """Return the number of tasks of the range from 0 to ``n``."""
        return -(-n // self.size)

    def _cut(self, n: int) -> None:
        """Cut the range from 0 to ``n`` > 0 into tasks. The callers first test whether the range is already cut,
        because this call takes as long as a small task.
        """
        many = self.many(n)
        if many > len(self._room):
            first = self.size * np.arange(2 * many)
            self._room = np.column_stack([first, first + self.size])
        before = self.many(self._n)
        if before != many:
            if before:
                self._room[before - 1, 1] = before * self.size
            self._starts[1], self._tasks = many, self._room[:many]
        self._room[many - 1, 1], self._n = n, n


class Ranges(_Range):
    """Runs kernels of the signature team.TASK over ranges on a team of threads.

    Tasks may run at the same time, so they must not write to the same memory. The number of the task that begins at
    index ``first`` is ``first`` divided by ``size``.
    """

    def __init__(self, team: Team, size: int = NODES_OF_A_TASK) -> None:
        """``size``: length of a task."""
        super().__init__(team, size)

    def run(self, kernel: Kernel, table: int, n: int) -> None:
        """Run a kernel over the range from 0 to ``n``. ``table``: address of its arguments."""
        if n:
            if n != self._n:
                self._cut(n)
            self._team.run(kernel, table, self._tasks, self._starts)

    def stages(self, kernel: Kernel, table: int, ties: tuple[Tie, ...], n: int) -> list[Stage]:
        """Return a list with the stage of a program that runs a kernel over the range from 0 to ``n``; the list is
        empty if ``n`` is 0. The stage is valid until another range is requested.
        """
        if n and n != self._n:
            self._cut(n)
        return [Stage(kernel, table, self._tasks, self._starts, ties)] if n else []


class Pass(_Range):
    """A kernel with its table of arguments, which can be run over ranges (``Ranges``)."""

    def __init__(self, team: Team, kernel: Kernel, *kinds: Any, size: int = NODES_OF_A_TASK) -> None:
        """``kinds``: numba types of the arguments; ``size``: length of a task."""
        super().__init__(team, size)
        self._kernel, self._arguments = kernel, Arguments(*kinds)

    def run(self, n: int, *values: Any) -> None:
        """Run the kernel over the range from 0 to ``n``. ``values``: arguments of the kernel."""
        if n:
            if n != self._n:
                self._cut(n)
            self._team.run(self._kernel, self._arguments.set(*values), self._tasks, self._starts)

    def stage(self, n: int, *values: Any) -> Stage:
        """Return the stage of a program that runs the kernel over the range from 0 to ``n`` > 0. Numbers among the
        ``values`` may be ``Follow`` objects. The stage is valid until other arguments or another range are requested.
        """
        if n != self._n:
            self._cut(n)
        table, ties = self._arguments.bind(*values)
        return Stage(self._kernel, table, self._tasks, self._starts, ties)
