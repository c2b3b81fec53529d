"""Progress lines: if a command is silent for almost 10 s, a thread prints what the command does."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LONGEST = 8.0
"""Time without output, s, after which a progress line is printed."""
_RARER = 1.2
"""Factor by which the time between two progress lines grows from line to line (chosen value: a command of one day
prints about forty lines)."""
_LOOK = 0.125
"""Time between two checks by the thread, as a fraction of ``LONGEST``."""


@contextmanager
def broken(write: Callable[[str], None], words: Callable[[], str]) -> Iterator[Callable[[str], None]]:
    """Context in which the caller prints lines with ``write``. After ``LONGEST`` s without a line a thread prints
    ``words()``. The thread prints ``words()`` again each time that the silent time has grown by a fifth.
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
