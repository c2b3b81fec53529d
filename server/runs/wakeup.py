"""Wake-up of coroutines that wait for a change of a run. A wake-up has no data: the coroutine then reads the files of
the run.
"""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager


class Listener:
    """Waits for changes of a run. Call ``clear``, read the files, and call ``wait`` if the files contain nothing new.
    In this order no change of the files can be missed.
    """

    def __init__(self) -> None:
        self._rung = asyncio.Event()

    def clear(self) -> None:
        """Resets the event of the listener."""
        self._rung.clear()

    def ring(self) -> None:
        """Sets the event of the listener; called in the thread of the event loop."""
        self._rung.set()

    async def wait(self, timeout: float) -> bool:
        """Waits for the event. Returns True if the event was set since ``clear``, False if ``timeout`` seconds have
        passed.
        """
        try:
            await asyncio.wait_for(self._rung.wait(), timeout)
        except TimeoutError:
            return False
        return True


class Wakeups:
    """The listeners of all runs."""

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._listeners: dict[str, set[Listener]] = {}
        self.closed = False

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """Sets the event loop in which the listeners wait."""
        self._loop = loop

    def ring(self, run_id: str) -> None:
        """Wakes all listeners of a run; may be called from any thread."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._ring, run_id)

    def _ring(self, run_id: str) -> None:
        for listener in self._listeners.get(run_id, ()):
            listener.ring()

    def close(self) -> None:
        """Wakes all listeners for the last time; they end because ``closed`` is set. The method is called in the thread
        of the event loop.
        """
        self.closed = True
        for run_id in self._listeners:
            self._ring(run_id)

    @property
    def listening(self) -> int:
        """Number of listeners at present."""
        return sum(len(listeners) for listeners in self._listeners.values())

    @contextmanager
    def listen(self, run_id: str) -> Iterator[Listener]:
        """Registers a listener for the time of the ``with`` block. The method is called in the thread of the event
        loop.
        """
        listener = Listener()
        self._listeners.setdefault(run_id, set()).add(listener)
        try:
            yield listener
        finally:
            self._listeners[run_id].discard(listener)
            if not self._listeners[run_id]:
                del self._listeners[run_id]
