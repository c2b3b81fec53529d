"""Wake-up of coroutines that wait for a change of a run. A wake-up carries no data: the coroutine reads the run's files
again.
"""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager


class Listener:
    """A waiter for changes of a run. Call ``clear``, read the files, and call ``wait`` if the files contain nothing
    new. In this order no change of the files can be missed.
    """

    def __init__(self) -> None:
        self._rung = asyncio.Event()

    def clear(self) -> None:
        """Clears the event of the waiter."""
        self._rung.clear()

    def ring(self) -> None:
        """Sets the event of the waiter; called in the thread of the event loop."""
        self._rung.set()

    async def wait(self, timeout: float) -> bool:
        """Waits for the event. Returns True if the event was set since ``clear``, and False after ``timeout`` seconds
        without an event.
        """
        try:
            await asyncio.wait_for(self._rung.wait(), timeout)
        except TimeoutError:
            return False
        return True


class Wakeups:
    """The waiters of all runs."""

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._listeners: dict[str, set[Listener]] = {}
        self.closed = False

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """Sets the event loop of the waiters."""
        self._loop = loop

    def ring(self, run_id: str) -> None:
        """Wakes all waiters of a run; called from any thread."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._ring, run_id)

    def _ring(self, run_id: str) -> None:
        for listener in self._listeners.get(run_id, ()):
            listener.ring()

    def close(self) -> None:
        """Wakes all waiters for the last time; the waiters end when they read ``closed``. The method is called in the
        thread of the event loop.
        """
        self.closed = True
        for run_id in self._listeners:
            self._ring(run_id)

    @property
    def listening(self) -> int:
        """Number of present waiters."""
        return sum(len(listeners) for listeners in self._listeners.values())

    @contextmanager
    def listen(self, run_id: str) -> Iterator[Listener]:
        """Registers a waiter while the ``with`` block runs. The method is called in the thread of the event loop."""
        listener = Listener()
        self._listeners.setdefault(run_id, set()).add(listener)
        try:
            yield listener
        finally:
            self._listeners[run_id].discard(listener)
            if not self._listeners[run_id]:
                del self._listeners[run_id]
