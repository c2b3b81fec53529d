"""Passes over the nodes of a rank: in tasks of some thousand nodes, which touch nothing in common."""

import numpy as np

from ..jit import Kernel
from ..state import Ints
from .team import Team

_TASK = 4096
"""Nodes a task. Chosen: 10 us of work, against 2 us that a region of threads costs."""


class OverNodes:
    """Has the threads of a team run kernels over nodes."""

    def __init__(self, team: Team) -> None:
        self._team, self.threads = team, team.threads
        self._n, self._tasks = 0, _tasks(0)

    def run(self, kernel: Kernel, table: int, n: int) -> None:
        """A ``kernel`` of the signature TASK over ``n`` nodes, with the arguments at the address ``table``."""
        if n != self._n:
            self._n, self._tasks = n, _tasks(n)
        self._team.run(kernel, table, *self._tasks)


def _tasks(n: int) -> tuple[Ints, Ints]:
    first = np.arange(0, n, _TASK)
    return np.column_stack([first, np.minimum(first + _TASK, n)]), np.array([0, len(first)])
