"""Pool of threads for work that may take long or wait: disk, database, computations.

The number of threads of each user is limited. The event loop never waits for a disk. A request whose task takes too
long is answered with status 503. The thread of such a task stays in use until the task ends; therefore a disk that
hangs blocks only as many threads as the limit of the user allows.
"""

import asyncio
import queue
import threading
from collections import Counter, deque
from collections.abc import Awaitable, Callable
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import partial, wraps
from typing import Any, ParamSpec, TypeVar

from ..errors import ServiceError

P = ParamSpec("P")
T = TypeVar("T")
THREADS = 64
"""Largest number of threads of all users together (chosen value). A disk serves some ten requests at once, and a thread
needs some 100 kB."""
asking: ContextVar[str] = ContextVar("asking", default="nobody")
"""User of the present request: a user name, or a network address."""


@dataclass(eq=False)
class _Job:
    who: str
    work: Callable[[], Any]
    done: asyncio.Future[Any]
    loop: asyncio.AbstractEventLoop = field(default_factory=asyncio.get_running_loop)
    begun: bool = False


class ThreadPool:
    """A pool of threads with a queue for each user. The class is used only in the thread of the event loop."""

    def __init__(self, each: int, waiting: int, patience: float, most: int = THREADS) -> None:
        """Creates the pool. ``each``: largest number of threads of one user; ``waiting``: largest number of waiting
        tasks of one user; ``most``: largest number of threads of all users; ``patience``: largest time in s of a task,
        including the time that it waits.
        """
        self._each, self._waiting, self._patience, self._most = each, waiting, patience, most
        self._jobs: dict[str, deque[_Job]] = {}
        self._taken: Counter[str] = Counter()
        self._handed: queue.SimpleQueue[_Job] = queue.SimpleQueue()
        self._threads = self._busy = 0

    async def run(self, work: Callable[P, T], *args: P.args, **words: P.kwargs) -> T:
        """Returns the result of the function ``work``, which a thread calls for the user; raises its errors. Raises
        ServiceError with status 429 if too many tasks of the user wait, with 503 if the task takes too long.
        """
        who, loop = asking.get(), asyncio.get_running_loop()
        waiting = self._jobs.setdefault(who, deque())
        if len(waiting) >= self._waiting:
            raise busy(f"{self._waiting} of your requests wait for the server's disk or its processors")
        job = _Job(who, partial(work, *args, **words), loop.create_future())
        waiting.append(job)
        self._begin()
        try:
            if not (await asyncio.wait([job.done], timeout=self._patience))[0]:
                raise self._late(job)
            value: T = job.done.result()
            return value
        finally:
            self._forget(job)

    def _late(self, job: _Job) -> ServiceError:
        other = "" if job.begun else "your other requests "
        detail = f"the server's disk or database did not answer {other}for {self._patience:g} s"
        return ServiceError(503, "unavailable", detail, retryable=True, headers={"Retry-After": "5"})

    def _forget(self, job: _Job) -> None:
        """Removes a task that has not started from its queue."""
        if not job.begun:
            self._jobs[job.who].remove(job)
            if not self._jobs[job.who]:
                del self._jobs[job.who]

    def _begin(self) -> None:
        """Starts waiting tasks while threads are free; the users take turns."""
        while self._busy < self._most:
            who = next((who for who, jobs in self._jobs.items() if jobs and self._taken[who] < self._each), None)
            if who is None:
                return
            jobs = self._jobs.pop(who)
            job = jobs.popleft()
            if jobs:
                self._jobs[who] = jobs
            job.begun = True
            self._taken[who] += 1
            self._busy += 1
            if self._busy > self._threads:
                self._threads += 1
                threading.Thread(target=self._work, name="pool", daemon=True).start()
            self._handed.put(job)

    def _work(self) -> None:
        """Executes tasks, one after the other; the main function of a thread. The thread is a daemon, so that a task
        that hangs does not keep the server from ending.
        """
        while True:
            job = self._handed.get()
            value, error = None, None
            try:
                value = job.work()
            except BaseException as raised:
                error = raised
            try:
                job.loop.call_soon_threadsafe(self._end, job, value, error)
            except RuntimeError:  # the event loop is closed because the server is ending
                return
            del job, value, error

    def _end(self, job: _Job, value: Any, error: BaseException | None) -> None:
        self._busy -= 1
        self._taken[job.who] -= 1
        if not self._taken[job.who]:
            del self._taken[job.who]
        if not job.done.done():
            job.done.set_result(value) if error is None else job.done.set_exception(error)
            job.done.exception()  # marks the error as read: the client may have disconnected
        self._begin()


def busy(detail: str) -> ServiceError:
    """Returns the error with status 429: too many requests of the same user are in progress."""
    return ServiceError(429, "busy", detail, retryable=True, headers={"Retry-After": "5"})


def blocking(route: Callable[P, T]) -> Callable[P, Awaitable[T]]:
    """Decorator for a route or a dependency that may block. The decorated function receives ``service`` and runs in a
    thread of ``service.pool``.
    """

    @wraps(route)
    async def run(*args: P.args, **words: P.kwargs) -> T:
        pool: ThreadPool = words["service"].pool  # type: ignore[attr-defined]
        return await pool.run(route, *args, **words)

    return run
