"""Nobody waits 10 s without a word: what takes long is said again, by a thread, while nothing else is."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LONGEST = 8.0
"""s after which something is said."""
_LOOK = 0.125
"""Between two looks of the thread, over ``LONGEST``."""


@contextmanager
def broken(write: Callable[[str], None], words: Callable[[], str]) -> Iterator[Callable[[str], None]]:
    """``write``, to be used inside; whenever ``LONGEST`` s have passed without a line, it writes ``words()``."""
    last, over = time.monotonic(), threading.Event()

    def say(text: str) -> None:
        nonlocal last
        last = time.monotonic()
        write(text)

    def listen() -> None:
        while not over.wait(LONGEST * _LOOK):
            if time.monotonic() - last >= LONGEST:
                say(words())

    thread = threading.Thread(target=listen, name="silence", daemon=True)
    thread.start()
    try:
        yield say
    finally:
        over.set()
        thread.join()
