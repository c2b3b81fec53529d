"""The threads of a rank: a pass is cut into tasks, and each task goes to whichever thread is free.

A task is a range of whatever the pass goes over: chunks of tets, nodes. Tasks of one colour touch nothing in common,
so threads need no locks and no sums of their own; colours come one after the other. All sums are of integers, so the
answer is the same on any number of threads.

The thread that asks works, too, and waits for tasks that have begun, not for threads: where another program has the
core of a helper it does the tasks itself. OpenMP waits for every thread at the end of every region, which takes
milliseconds then (docs/performance/scaling.md, "Threads"). One word says which tasks there are: their number, and the
next one. A thread takes a task by adding one to the word. A colour does not end before its last task, so the arguments
of a task stay as they are. Helpers look at the word for some 50 us, then sleep until the next pass. To wake a thread
takes its waker some 20 us, so the asking thread wakes one or two, and whoever is woken wakes two more while there are
tasks.
"""

import ctypes
import threading
from functools import cache
from typing import Protocol

import numpy as np

from ..kernels.jit import Kernel, njit
from ..model.state import Ints
from .words import SECOND, TASK, add, call_task, load, now, sched_yield, sem_post, sem_wait, swap, word_at

__all__ = ["TASK", "Team", "team"]


_NEXT, _DONE, _ASLEEP, _KERNEL, _TABLE, _TASKS, _MOST, _WITHIN, _CLOCK, _SEMAPHORE, _THREADS = (
    0, 8, 16, 24, 25, 26, 27, 28, 29, 32, 40,
)  # fmt: skip
"""Places in a job's words; what several threads write has a cache line of its own. _MOST is how many threads may work,
_WITHIN how long regions have taken so far, ns, and _CLOCK two words of room for the time. From _THREADS on a line for
each thread: how long it has done tasks, ns, and room for the time."""
_BITS, _MASK = 20, (1 << 20) - 1
"""Of the next task in the word _NEXT; above it stands the number of tasks."""
_LINE = 8
"""Words in a line of the cache."""
_WAKES = 2
"""Threads that a thread wakes."""
_LOOKS = 4000
"""How often a helper looks for a task before it sleeps, and the asking thread before it lets others run. Chosen: some
50 us, longer than what lies between two colours, much shorter than a step."""


@njit("boolean(int64[::1], int64)", cache=True)
def _do_one(job, thread):  # type: ignore[no-untyped-def]
    """Does a task that nobody has taken; False where there is none."""
    word = load(job, _NEXT)
    if word & _MASK >= word >> _BITS:
        return False
    word = add(job, _NEXT, 1)
    k = word & _MASK
    if k >= word >> _BITS:
        return False
    tasks = load(job, _TASKS)
    first, end = word_at(tasks, 2 * k), word_at(tasks, 2 * k + 1)
    own = _THREADS + _LINE * thread
    begin = now(job, own + 1)
    call_task(load(job, _KERNEL), load(job, _TABLE), first, end, thread)
    job[own] += now(job, own + 1) - begin
    add(job, _DONE, 1)
    return True


@njit("void(int64[::1], int64)", cache=True)
def _wake(job, semaphore):  # type: ignore[no-untyped-def]
    """Wakes some of those that sleep, as many as there are tasks for and may work."""
    word, threads = load(job, _NEXT), (len(job) - _THREADS) // _LINE
    helpers = min((word >> _BITS) - (word & _MASK), load(job, _MOST)) - 1
    for _ in range(_WAKES):
        asleep = load(job, _ASLEEP)
        if asleep <= 0 or threads - 1 - asleep >= helpers:
            return
        if add(job, _ASLEEP, -1) > 0:
            sem_post(semaphore)
        else:  # another thread was faster
            add(job, _ASLEEP, 1)


@njit("void(int64[::1], int64, int64)", cache=True, nogil=True)
def _help(job, semaphore, thread):  # type: ignore[no-untyped-def]
    """Does tasks for ever; sleeps where there has been none for a while."""
    idle = 0
    while True:
        if _do_one(job, thread):
            idle = 0
            continue
        idle += 1
        if idle == _LOOKS:
            add(job, _ASLEEP, 1)
            sem_wait(semaphore)
            _wake(job, semaphore)
            idle = 0


@njit("void(int64[::1], int64, int64, int64, int64, int64[::1])", cache=True)
def _ask(job, semaphore, kernel, table, tasks, starts):  # type: ignore[no-untyped-def]
    """Colour after colour; returns when all tasks are done."""
    begin = now(job, _CLOCK)
    for colour in range(len(starts) - 1):
        many = starts[colour + 1] - starts[colour]
        job[_KERNEL], job[_TABLE], job[_TASKS] = kernel, table, tasks + 16 * starts[colour]
        swap(job, _DONE, 0)
        swap(job, _NEXT, many << _BITS)
        if many > 1:
            _wake(job, semaphore)
        while _do_one(job, 0):
            pass
        looked = 0
        while load(job, _DONE) < many:
            looked += 1
            if looked > _LOOKS:
                sched_yield()
    job[_WITHIN] += now(job, _CLOCK) - begin


@njit("void(int64[::1], int64, int64, int64[:, ::1])", cache=True)
def _alone(job, kernel, table, tasks):  # type: ignore[no-untyped-def]
    """All tasks, one after the other."""
    begin = now(job, _CLOCK)
    for k in range(len(tasks)):
        call_task(kernel, table, tasks[k, 0], tasks[k, 1], 0)
    job[_WITHIN] += now(job, _CLOCK) - begin


class Timed(Protocol):
    """Does tasks one after the other, and adds up what ``crews``, teams of so many threads, would take."""

    crews: list[int]

    @property
    def spans(self) -> list[float]:
        """What each crew would have taken for all regions so far, s."""

    def run(self, kernel: Kernel, table: int, tasks: Ints, starts: Ints) -> int:
        """As ``Team.run``; the CPU time that it has taken, ns."""


class Team:
    """So many threads, this one among them; they are there until the process ends: see ``team``."""

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self.projecting: Timed | None = None
        """Who does all tasks instead of the threads, where they are to be timed."""
        size = _THREADS + _LINE * threads
        room = np.zeros(size + _LINE, np.int64)
        self._job: Ints = room[-(room.ctypes.data // room.itemsize) % _LINE :][:size]
        self._job[_MOST] = threads
        self._words = self._job.data
        self._semaphore = int(self._job[_SEMAPHORE:].ctypes.data)
        ctypes.CDLL(None).sem_init(ctypes.c_void_p(self._semaphore), 0, 0)
        for thread in range(1, threads):
            arguments = self._job, self._semaphore, thread
            threading.Thread(target=_help, args=arguments, name=f"helper {thread}", daemon=True).start()

    @property
    def most(self) -> int:
        """How many of the threads may work."""
        return int(self._words[_MOST])

    @most.setter
    def most(self, threads: int) -> None:
        self._words[_MOST] = threads

    @property
    def within(self) -> float:
        """How long ``run`` has taken so far, by the clock, s: what more threads could share."""
        return self._words[_WITHIN] / SECOND

    @property
    def helped(self) -> float:
        """How long the threads besides this one have done tasks so far, all together, s."""
        return float(self._job[_THREADS + _LINE :: _LINE].sum()) / SECOND

    def run(self, kernel: Kernel, table: int, tasks: Ints, starts: Ints) -> None:
        """Does ``tasks`` (k, 2), first and end, by a ``kernel`` of the signature TASK with the arguments at the address
        ``table``; those from ``starts[c]`` to ``starts[c + 1]``, at most 2^20, touch nothing in common.
        """
        if self.projecting is not None:
            self._words[_WITHIN] += self.projecting.run(kernel, table, tasks, starts)
        elif self._words[_MOST] == 1:
            _alone(self._job, kernel.address, table, tasks)
        else:
            _ask(self._job, self._semaphore, kernel.address, table, tasks.ctypes.data, starts)


@cache
def team(threads: int) -> Team:
    """The team of so many threads of this process."""
    return Team(threads)
