"""Programs of kernels. A program consists of stages that the threads of a rank run one after the other, in one call
without Python code between them.

A stage consists of a kernel, its table of arguments, and its tasks. The tasks are either given before the call
(``Stage``), or they are a range (``Span``). The length of the range is a word of memory. The stage reads the length
when it begins, so an earlier stage may write the length. A stage with the length 0 is skipped. A kernel may also choose
the next stage: it writes the number of this stage to ``Program.control``. A stage number beyond the last stage ends the
call.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..kernels.jit import Kernel, njit
from ..model.growing import address_of
from ..model.state import Ints
from .team import CLOCK, END, KERNEL, MOST, SIZE, TABLE, WITHIN, Stage, Team, divide, share
from .words import call_task, now, word_at

_WORD = 8
"""Size of a word of memory, bytes."""
_WORDS = 7
"""Number of words that describe a stage: kernel, table; tasks, starts, number of colours; address of the length of a
range, length of a task."""


@njit("boolean(int64[::1], int64, int64[::1])", cache=True)
def _of_range(job, semaphore, stage):  # type: ignore[no-untyped-def]
    """Run a stage over a range. Return True if the stage had more than one task."""
    n, size = word_at(stage[5], 0), stage[6]
    many = (n + size - 1) // size
    if many <= 1 or job[MOST] == 1:
        for k in range(many):
            call_task(stage[0], stage[1], k * size, min((k + 1) * size, n), 0)
    else:
        job[KERNEL], job[TABLE], job[SIZE], job[END] = stage[0], stage[1], size, n
        divide(job, semaphore, many)
    return many > 1


@njit("void(int64[::1], int64, int64[::1])", cache=True)
def _of_tasks(job, semaphore, stage):  # type: ignore[no-untyped-def]
    """Run a stage whose tasks are given."""
    tasks, starts, colours = stage[2], stage[3], stage[4]
    first, end = word_at(starts, 0), word_at(starts, colours)
    if job[MOST] > 1 and end - first > 1:
        share(job, semaphore, stage[0], stage[1], tasks, starts, colours)
    else:
        for k in range(first, end):
            call_task(stage[0], stage[1], word_at(tasks, 2 * k), word_at(tasks, 2 * k + 1), 0)


@njit("int64(int64[:, ::1], int64[::1], int64, int64[:, ::1], int64[::1], int64, int64, boolean)", cache=True)
def _run(spent, job, semaphore, stages, control, first, end, again):  # type: ignore[no-untyped-def]
    """Run the stages from ``first`` to ``end``, with ``again`` in a loop until a kernel writes a number beyond ``end``
    to ``control``. Return the number of the stage that would come next. Add the time of each stage, ns, to ``spent``
    (stages, 2): to column 0 if the stage was a range with one task, else to column 1, which is the time in parallel
    regions.
    """
    k, begin = first, now(job, CLOCK)
    while k < end:
        stage, shared = stages[k], 1
        if stage[6] > 0:
            shared = 1 if _of_range(job, semaphore, stage) else 0
        else:
            _of_tasks(job, semaphore, stage)
        done = now(job, CLOCK)
        spent[k, shared] += done - begin
        if shared:
            job[WITHIN] += done - begin
        k, control[0], begin = control[0] if control[0] >= 0 else k + 1, -1, done
        if again and k == end:
            k = first
    return k


@njit("int64(int64[:, ::1], int64[::1], int64, int64[:, ::1], int64[::1], int64, int64)", cache=True, nogil=True)
def _repeat(spent, job, semaphore, stages, control, first, end):  # type: ignore[no-untyped-def]
    """Run the stages in a loop (``_run``), while other Python threads may run."""
    return _run(spent, job, semaphore, stages, control, first, end, True)


@dataclass(frozen=True)
class Span:
    """A pass over a range that begins at 0. The length of the range is the word ``at`` of ``lengths``, read when the
    stage begins. ``size``: length of a task. The number of the task that begins at index ``first`` is ``first`` divided
    by ``size``.
    """

    kernel: Kernel
    table: int
    lengths: Ints
    at: int
    size: int

    def words(self) -> list[int]:
        """Return the words that describe the stage."""
        return [self.kernel.address, self.table, 0, 0, 0, address_of(self.lengths) + _WORD * self.at, self.size]

    def tasks(self) -> Ints:
        """Return the tasks (k, 2) for the present length."""
        n = int(self.lengths[self.at])
        first = np.arange(0, n, self.size)
        return np.column_stack([first, np.minimum(first + self.size, n)])


def _words(stage: Stage) -> list[int]:
    tasks = address_of(stage.tasks), address_of(stage.starts), len(stage.starts) - 1
    return [stage.kernel.address, stage.table, *tasks, 0, 0]


class Program:
    """A program: stages in the order in which they are run."""

    def __init__(self, team: Team, stages: Sequence[Stage | Span], control: Ints) -> None:
        """``control`` (1,): number of the next stage, which kernels may write; -1 for the following stage."""
        self._team, self._stages, self.control = team, list(stages), control
        words = [each.words() if isinstance(each, Span) else _words(each) for each in stages]
        self._words = np.array(words, np.int64).reshape(-1, _WORDS)
        self.spent: Ints = np.zeros((len(stages), 2), np.int64)
        """(stages, 2) wall time of each stage so far, ns: as a range with one task, and in parallel regions."""
        control[0] = -1

    def run(self, first: int = 0, end: int | None = None) -> int:
        """Run the stages from ``first`` to ``end``; by default all stages. Return the number of the stage that would
        come next: ``end``, or a larger number that a kernel has written.
        """
        end = len(self._stages) if end is None else end
        team = self._team
        if team.projecting is None:
            control = self.control
            return int(_run(self.spent, team.job, team.semaphore, self._words, control, first, end, False))
        k = first
        while k < end:
            self._timed(self._stages[k])
            k = int(self.control[0]) if self.control[0] >= 0 else k + 1
            self.control[0] = -1
        return k

    def repeat(self) -> None:
        """Run all stages again and again until a kernel writes a number beyond the last stage to ``control``. The
        threads stay awake between the stages.
        """
        team = self._team
        _repeat(self.spent, team.job, team.semaphore, self._words, self.control, 0, len(self._stages))

    def _timed(self, stage: Stage | Span) -> None:
        """Run a stage and measure the times of its tasks (projecting.py)."""
        if isinstance(stage, Stage):
            self._team.run(stage.kernel, stage.table, stage.tasks, stage.starts)
        elif len(tasks := stage.tasks()):
            self._team.run(stage.kernel, stage.table, tasks, np.array([0, len(tasks)]))
