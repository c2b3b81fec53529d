"""Estimate of the time that parallel regions would take with more threads than the machine has cores.

The tasks are run and timed one after the other. For each number of threads (crew) the tasks are assigned as a team
would assign them: colour by colour, the next task goes to the thread that is free first. The costs of parallel regions
are measured before, with two threads. Each colour costs the time ``turn``. After a pause, waking a thread takes the
time ``call`` of the calling thread, and the woken thread begins to work after the time ``wake``. Each woken thread
wakes two more threads (team.py). The estimate ignores that simultaneous tasks slow each other down by the memory that
they share.
"""

import time
from dataclasses import dataclass

import numpy as np

from ..kernels.jit import Kernel, njit, types
from ..model.state import Ints
from .arguments import Arguments, reader
from .team import Team
from .words import TASK, call_task, now

_PAUSE = 100_000
"""Time after which threads without a task sleep, ns. Chosen value: twice the time for which such threads read the task
word in a loop (team.py)."""
_REPEATS = 50
_ROUNDS = 100_000
"""Number of iterations of a task that takes longer than the waking of a thread. Chosen value: the task takes about 100
us."""
_WORDS = types.int64[::1], types.int64
_words = reader(*_WORDS)


def crews_of(threads: int) -> list[int]:
    """Return the numbers of threads for which the estimate is made: 1, 2, 4, 8, ... and ``threads``."""
    return sorted({threads} | {1 << k for k in range(threads.bit_length()) if 1 << k <= threads})


@dataclass(frozen=True)
class Costs:
    """Costs of parallel regions, ns. The docstring of this module defines ``turn``, ``call`` and ``wake``."""

    turn: int
    call: int
    wake: int


@njit("void(boolean, int64[::1], int64[::1], int64[:, ::1])", cache=True)
def _ready(asleep, costs, crews, free):  # type: ignore[no-untyped-def]
    """Set the time at which each thread of each crew can begin the first task of a colour. The last column is the time
    at which the last task of the crew ends.
    """
    for c in range(len(crews)):
        free[c, : crews[c]] = 0
        free[c, crews[c]] = 0
        if asleep:
            free[c, 0], woken, wake = costs[1], 2, costs[2]
            for k in range(1, crews[c]):
                if k > woken:
                    woken, wake = 2 * woken + 2, wake + costs[2]
                free[c, k] = wake


@njit("void(int64, int64[::1], int64[:, ::1])", cache=True)
def _give(took, crews, free):  # type: ignore[no-untyped-def]
    """Assign a task in each crew to the thread that is free first."""
    for c in range(len(crews)):
        first = 0
        for k in range(1, crews[c]):
            if free[c, k] < free[c, first]:
                first = k
        free[c, first] += took
        free[c, crews[c]] = max(free[c, crews[c]], free[c, first])


@njit("int64(int64[::1], int64, int64, int64[:, ::1], int64[::1], int64[::1], int64[::1], int64[:, ::1], int64[::1])",
      cache=True)  # fmt: skip
def _timed(clock, kernel, table, tasks, starts, costs, crews, free, spans):  # type: ignore[no-untyped-def]
    """Run all tasks and return the time that they took, ns. Set ``spans`` (crews,) to the time that each crew would
    take, ns.
    """
    begin = now(clock, 0)
    asleep = begin - clock[2] > _PAUSE
    spans[:] = 0
    for colour in range(len(starts) - 1):
        shared = starts[colour + 1] - starts[colour] > 1
        _ready(asleep and shared, costs, crews, free)
        asleep = asleep and not shared
        for k in range(starts[colour], starts[colour + 1]):
            began = now(clock, 0)
            call_task(kernel, table, tasks[k, 0], tasks[k, 1], 0)
            _give(now(clock, 0) - began, crews, free)
        for c in range(len(crews)):
            spans[c] += free[c, crews[c]] + (costs[0] if shared and crews[c] > 1 else 0)
    clock[2] = now(clock, 0)
    return clock[2] - begin


class Projecting:
    """Runs the tasks of parallel regions one after the other. Sums the time that crews of other sizes would take."""

    def __init__(self, threads: int, costs: Costs | None = None) -> None:
        """``threads``: size of the largest crew; ``costs``: costs of parallel regions. If the costs are not given, the
        object measures them.
        """
        self.crews = crews_of(threads)
        self.costs = costs or measured()
        self.regions = self.colours = self.tasks = 0
        self._crews = np.array(self.crews)
        self._costs = np.array([self.costs.turn, self.costs.call, self.costs.wake])
        self._free = np.zeros((len(self.crews), threads + 1), np.int64)
        self._clock, self._region = np.zeros(3, np.int64), np.zeros(len(self.crews), np.int64)
        self._spans = np.zeros(len(self.crews))

    @property
    def spans(self) -> list[float]:
        """Return the time that each crew would have taken for all parallel regions so far, s."""
        return (1e-9 * self._spans).tolist()  # type: ignore[no-any-return]

    def run(self, kernel: Kernel, table: int, tasks: Ints, starts: Ints) -> int:
        """Run the tasks as ``Team.run`` does; return the CPU time, ns.

        The wall times of tasks are too long if another program used the core. Therefore all wall times are multiplied
        by the ratio of CPU time to wall time.
        """
        self.regions += 1
        self.colours += len(starts) - 1
        self.tasks += len(tasks)
        began = time.thread_time_ns()
        passed = _timed(
            self._clock, kernel.address, table, tasks, starts, self._costs, self._crews, self._free, self._region
        )
        spent = time.thread_time_ns() - began
        self._spans += self._region * min(1.0, spent / max(passed, 1))
        return spent


@njit(TASK, cache=True)
def _spin(table, first, end, thread):  # type: ignore[no-untyped-def]
    """Run a loop of given length that the compiler cannot remove."""
    totals, rounds = _words(table)
    total = totals[thread]
    for k in range(rounds):
        total = total * 6364136223846793005 + k
    totals[thread] = total


def measured() -> Costs:
    """Return the costs of parallel regions, measured with two threads of this process. Each cost is the tenth
    percentile of its measurements, because other programs may use the cores.
    """
    two, totals = Team(2), np.zeros(2, np.int64)
    table, tasks = Arguments(*_WORDS), np.array([[0, 1], [1, 2]])

    def took(rounds: int, pause: bool, number: int) -> int:
        address, found = table.set(totals, rounds), []
        for _ in range(_REPEATS):
            if pause:
                time.sleep(3e-9 * _PAUSE)
            began = time.monotonic_ns()
            two.run(_spin, address, tasks[:number], np.array([0, number]))
            found.append(time.monotonic_ns() - began)
        return int(np.percentile(found, 10))

    alone, turn = took(1, False, 1), took(1, False, 2)
    call, woken, single = took(1, True, 2) - took(1, True, 1), took(_ROUNDS, True, 2), took(_ROUNDS, True, 1)
    return Costs(max(turn - alone, 0), max(call, 0), min(max(woken - single, 0), single))
