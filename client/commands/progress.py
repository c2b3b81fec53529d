"""Nobody waits 10 s without a word: what takes long is said again, by a thread, while nothing else is."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LONGEST = 8.0
"""s after which something is said."""
_RARER = 1.2
"""From one word to the next, over the silence. Chosen: some forty words in a day."""
_LOOK = 0.125
"""Between two looks of the thread, over ``LONGEST``."""


@contextmanager
def broken(write: Callable[[str], None], words: Callable[[], str]) -> Iterator[Callable[[str], None]]:
    """``write``, to be used inside; when ``LONGEST`` s have passed without a line, it writes ``words()``, and after
    that each time that the silence has become longer by a fifth.
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
