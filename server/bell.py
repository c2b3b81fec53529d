"""Wakes the coroutines that wait for news of a run. A bell carries no news: who is woken looks at the files."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager


class Listener:
    """One who waits. Call ``clear`` before looking, ``wait`` after having found nothing: no ring is ever missed."""

    def __init__(self) -> None:
        self._rung = asyncio.Event()

    def clear(self) -> None:
        """Forgets the rings so far."""
        self._rung.clear()

    def ring(self) -> None:
        """From the event loop's thread."""
        self._rung.set()

    async def wait(self, timeout: float) -> bool:
        """True when the bell rang since ``clear``, False after ``timeout`` seconds without."""
        try:
            await asyncio.wait_for(self._rung.wait(), timeout)
        except TimeoutError:
            return False
        return True


class Bell:
    """One for all runs."""

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._listeners: dict[str, set[Listener]] = {}
        self.closed = False

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """The loop in which the listeners live."""
        self._loop = loop

    def ring(self, run_id: str) -> None:
        """From any thread."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._ring, run_id)

    def _ring(self, run_id: str) -> None:
        for listener in self._listeners.get(run_id, ()):
            listener.ring()

    def close(self) -> None:
        """Wakes everybody for the last time; ``closed`` tells them to leave. From the loop's thread."""
        self.closed = True
        for run_id in self._listeners:
            self._ring(run_id)

    @property
    def listening(self) -> int:
        """How many wait now."""
        return sum(len(listeners) for listeners in self._listeners.values())

    @contextmanager
    def listen(self, run_id: str) -> Iterator[Listener]:
        """A listener for as long as the block lasts. From the loop's thread."""
        listener = Listener()
        self._listeners.setdefault(run_id, set()).add(listener)
        try:
            yield listener
        finally:
            self._listeners[run_id].discard(listener)
            if not self._listeners[run_id]:
                del self._listeners[run_id]
