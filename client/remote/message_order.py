"""Messages in the order of ``seq``, each once; missing ones are read from the journal. This module uses no network."""

import time
from collections.abc import Callable, Iterator

from conoid.cases.messages import AnyMessage

Refill = Callable[[int], list[AnyMessage]]
"""Function that returns the messages of the journal after a number, in order."""

_TRIES = 3
"""Number of readings of the journal for a missing message before it is given up. Chosen: the journal is written
before the sample is sent, so the first reading has it unless the file system lags."""


class InOrder:
    """Sorts arriving messages into the order in which they were written.

    A message with a known number is dropped; a gap in the numbers calls ``refill``. The journal is written before
    anything is published, so a refill has the missing messages. If it does not (a file system that lags), it is
    called again a little later, and ``missing`` counts the messages that never came.
    """

    def __init__(self, refill: Refill, after: int = 0, pause: float = 0.2) -> None:
        """``after``: number of the last known message; ``pause`` in s between tries."""
        self.refill = refill
        self.last = after
        self.pause = pause
        self.missing = 0

    def take(self, message: AnyMessage) -> Iterator[AnyMessage]:
        """Yields the messages that are complete in order after ``message`` has arrived."""
        for attempt in range(_TRIES):
            if message.seq <= self.last + 1:
                break
            if attempt:
                time.sleep(self.pause)
            yield from self.catch_up()
        if message.seq > self.last:
            self.missing += message.seq - self.last - 1
            self.last = message.seq
            yield message

    def catch_up(self) -> Iterator[AnyMessage]:
        """Yields the messages of the journal after the last one."""
        for message in self.refill(self.last):
            if message.seq == self.last + 1:
                self.last = message.seq
                yield message
