"""Progress lines: a command that is silent for almost 10 s prints what it does, from a thread."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LONGEST = 8.0
"""Time in s without output after which a line is printed."""
_RARER = 1.2
"""Growth of the time between two lines, relative to the silent time. Chosen value: a day has some forty lines."""
_LOOK = 0.125
"""Time between two checks of the thread, over ``LONGEST``."""


@contextmanager
def broken(write: Callable[[str], None], words: Callable[[], str]) -> Iterator[Callable[[str], None]]:
    """Context in which the caller prints with ``write``. After ``LONGEST`` s without a line, the context writes
    ``words()``, and again each time that the silent time has increased by a fifth.
    """
    last, spoken, over = time.monotonic(), 0.0, threading.Event()

    def say(text: str) -> None:
        nonlocal last, spoken
        last, spoken = time.monotonic(), 0.0
        write(text)

    def listen() -> None:
        nonlocal spoken
        while not over.wait(LONGEST * _LOOK):
            silent = time.monotonic() - last
            if silent >= max(LONGEST, spoken + LONGEST, _RARER * spoken):
                spoken = silent
                write(words())

    thread = threading.Thread(target=listen, name="silence", daemon=True)
    thread.start()
    try:
        yield say
    finally:
        over.set()
        thread.join()
