"""The threads of a rank. A pass is cut into tasks, and the next free thread takes the next task.

A task is a range of a pass: a range of chunks of tets, or of nodes. Tasks of one colour write to no common memory, so
threads need no locks and no separate sums. The colours run one after the other. All sums are of integers, so the answer
is the same on any number of threads.

The calling thread also runs tasks; the other threads are called helpers. At the end of a pass the calling thread waits
for the tasks that have begun, not for threads. If another program uses the core of a helper, the other threads run the
tasks. OpenMP would wait for every thread at the end of every parallel region, which takes milliseconds in that case
(docs/performance/scaling.md, "Threads"). One word of memory contains the number of tasks and the index of the next
task. A thread takes a task by an atomic increment of the word. A colour does not end before its last task, so the
arguments of a task stay valid. Helpers read the word of tasks in a loop for about 50 us, then they sleep until the next
pass. Waking a thread takes about 20 us of the time of another thread. Therefore the calling thread wakes one or two
threads, and each woken thread wakes two more threads while there are tasks.
"""

import ctypes
import threading
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np

from ..kernels.jit import Kernel, njit
from ..model.growing import address_of
from ..model.state import Ints
from .arguments import Tie
from .words import SECOND, TASK, add, call_task, load, now, sched_yield, sem_post, sem_wait, swap, word_at

__all__ = ["TASK", "Stage", "Team", "team"]


_NEXT, _DONE, _ASLEEP, KERNEL, TABLE, TASKS, MOST, WITHIN, CLOCK, SIZE, _SEMAPHORE, END, _THREADS = (
    0, 8, 16, 24, 25, 26, 27, 28, 29, 31, 32, 36, 40,
)  # fmt: skip
"""Offsets in the words that describe a job. A word that several threads write has a cache line of its own. SIZE: length
of each task of a range that ends at END, or 0 if the tasks are a table at the address TASKS; MOST: number of threads
that may work; WITHIN: time in parallel regions so far, ns; CLOCK: two words for reading the clock. From _THREADS on
each thread has a cache line: its time in tasks, ns, and words for the clock."""
_BITS, _MASK = 20, (1 << 20) - 1
"""Number of low bits of the word _NEXT, which are the index of the next task, and the mask of these bits. The higher
bits are the number of tasks."""
_LINE = 8
"""Number of words in a cache line."""
_WAKES = 2
"""Largest number of threads that one thread wakes."""
_POLLS = 4000
"""Number of reads of the task word before a helper sleeps, and before the calling thread yields its core. Chosen value:
the reads take about 50 us, which is longer than the gap between two colours and much shorter than a step."""


@njit("boolean(int64[::1], int64)", cache=True)
def _do_one(job, thread):  # type: ignore[no-untyped-def]
    """Take one task and run it. Return False if no task is left."""
    word = load(job, _NEXT)
    if word & _MASK >= word >> _BITS:
        return False
    word = add(job, _NEXT, 1)
    k = word & _MASK
    if k >= word >> _BITS:
        return False
    size = load(job, SIZE)
    if size > 0:
        first, end = k * size, min((k + 1) * size, load(job, END))
    else:
        tasks = load(job, TASKS)
        first, end = word_at(tasks, 2 * k), word_at(tasks, 2 * k + 1)
    own = _THREADS + _LINE * thread
    begin = now(job, own + 1)
    call_task(load(job, KERNEL), load(job, TABLE), first, end, thread)
    job[own] += now(job, own + 1) - begin
    add(job, _DONE, 1)
    return True


@njit("void(int64[::1], int64)", cache=True)
def _wake(job, semaphore):  # type: ignore[no-untyped-def]
    """Wake sleeping threads. At most _WAKES threads are woken, and no more than there are tasks and threads that may
    work.
    """
    word, threads = load(job, _NEXT), (len(job) - _THREADS) // _LINE
    helpers = min((word >> _BITS) - (word & _MASK), load(job, MOST)) - 1
    for _ in range(_WAKES):
        asleep = load(job, _ASLEEP)
        if asleep <= 0 or threads - 1 - asleep >= helpers:
            return
        if add(job, _ASLEEP, -1) > 0:
            sem_post(semaphore)
        else:  # another caller woke the last sleeping thread
            add(job, _ASLEEP, 1)


@njit("void(int64[::1], int64, int64)", cache=True, nogil=True)
def _help(job, semaphore, thread):  # type: ignore[no-untyped-def]
    """Run tasks in an endless loop; sleep after a time without tasks."""
    idle = 0
    while True:
        if _do_one(job, thread):
            idle = 0
            continue
        idle += 1
        if idle == _POLLS:
            add(job, _ASLEEP, 1)
            sem_wait(semaphore)
            _wake(job, semaphore)
            idle = 0


@njit("void(int64[::1], int64, int64)", cache=True)
def divide(job, semaphore, many):  # type: ignore[no-untyped-def]
    """Run ``many`` tasks of the pass that is described by the words of the job. Return when all tasks are done."""
    swap(job, _DONE, 0)
    swap(job, _NEXT, many << _BITS)
    if many > 1:
        _wake(job, semaphore)
    while _do_one(job, 0):
        pass
    polls = 0
    while load(job, _DONE) < many:
        polls += 1
        if polls > _POLLS:
            sched_yield()


@njit("void(int64[::1], int64, int64, int64, int64, int64, int64)", cache=True)
def share(job, semaphore, kernel, table, tasks, starts, colours):  # type: ignore[no-untyped-def]
    """Run the tasks of a pass, one colour after the other. Return when all tasks are done."""
    job[KERNEL], job[TABLE], job[SIZE] = kernel, table, 0
    for colour in range(colours):
        first = word_at(starts, colour)
        job[TASKS] = tasks + 16 * first
        divide(job, semaphore, word_at(starts, colour + 1) - first)


@njit("void(int64[::1], int64, int64, int64, int64, int64, int64)", cache=True)
def _ask(job, semaphore, kernel, table, tasks, starts, colours):  # type: ignore[no-untyped-def]
    """Run one pass on all threads."""
    begin = now(job, CLOCK)
    share(job, semaphore, kernel, table, tasks, starts, colours)
    job[WITHIN] += now(job, CLOCK) - begin


@njit("void(int64[::1], int64, int64, int64[:, ::1])", cache=True)
def _alone(job, kernel, table, tasks):  # type: ignore[no-untyped-def]
    """Run one pass on the calling thread."""
    begin = now(job, CLOCK)
    for k in range(len(tasks)):
        call_task(kernel, table, tasks[k, 0], tasks[k, 1], 0)
    job[WITHIN] += now(job, CLOCK) - begin


@dataclass(frozen=True)
class Stage:
    """A pass of a program; it has the arguments of ``Team.run``."""

    kernel: Kernel
    table: int
    tasks: Ints
    starts: Ints
    ties: tuple[Tie, ...] = ()
    """Words of the argument table that change with numbers of the program."""


class Timed(Protocol):
    """A replacement for a team; it runs tasks one after the other, and sums the time that teams of the sizes ``crews``
    would take.
    """

    crews: list[int]

    @property
    def spans(self) -> list[float]:
        """Return the time that each crew would have taken for all parallel regions so far, s."""

    def run(self, kernel: Kernel, table: int, tasks: Ints, starts: Ints) -> int:
        """Run the tasks as ``Team.run`` does; return the CPU time, ns."""


class Team:
    """The threads of a rank, including the calling thread. The threads exist until the process ends (``team``)."""

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self.projecting: Timed | None = None
        """Object that runs all tasks in place of the threads, if the times of tasks are measured."""
        size = _THREADS + _LINE * threads
        room = np.zeros(size + _LINE, np.int64)
        self.job: Ints = room[-(room.ctypes.data // room.itemsize) % _LINE :][:size]
        self.job[MOST] = threads
        self._words = self.job.data
        self.semaphore = int(self.job[_SEMAPHORE:].ctypes.data)
        ctypes.CDLL(None).sem_init(ctypes.c_void_p(self.semaphore), 0, 0)
        for thread in range(1, threads):
            arguments = self.job, self.semaphore, thread
            threading.Thread(target=_help, args=arguments, name=f"helper {thread}", daemon=True).start()

    @property
    def most(self) -> int:
        """Number of threads that may run tasks."""
        return int(self._words[MOST])

    @most.setter
    def most(self, threads: int) -> None:
        self._words[MOST] = threads

    @property
    def within(self) -> float:
        """Wall time in ``run`` so far, s. With more threads the wall time in ``run`` would be shorter."""
        return self._words[WITHIN] / SECOND

    @property
    def helped(self) -> float:
        """Time that all threads except the calling thread have spent in tasks, summed over these threads, s."""
        return float(self.job[_THREADS + _LINE :: _LINE].sum()) / SECOND

    def run(self, kernel: Kernel, table: int, tasks: Ints, starts: Ints) -> None:
        """Run ``tasks`` (k, 2), each given by its first index and its end. ``kernel`` has the signature TASK;
        ``table``: address of its arguments.

        The tasks from ``starts[c]`` to ``starts[c + 1]``, at most 2^20, write to no common memory.
        """
        if self.projecting is not None:
            self._words[WITHIN] += self.projecting.run(kernel, table, tasks, starts)
        elif self._words[MOST] == 1:
            _alone(self.job, kernel.address, table, tasks)
        else:
            places = address_of(tasks), address_of(starts), len(starts) - 1
            _ask(self.job, self.semaphore, kernel.address, table, *places)


@cache
def team(threads: int) -> Team:
    """Return the team of this process with ``threads`` threads."""
    return Team(threads)
