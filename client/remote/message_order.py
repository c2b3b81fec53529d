"""Messages in the order of ``seq``, each once: what the stream missed is read from the journal. No network in here."""

import time
from collections.abc import Callable, Iterator

from conoid.cases.messages import AnyMessage

Refill = Callable[[int], list[AnyMessage]]
"""The messages of the journal after a number, in order."""

_TRIES = 3
"""Times the journal is read for a message that is missing before it is given up. Chosen: the journal is written before
the sample is sent, so the first reading finds it but on a file system that lags behind."""


class InOrder:
    """Turns messages as they arrive into messages as they were written.

    A number that was seen is dropped; a number that skips some calls ``refill``. The journal is written before
    anything is published, so a refill has what is missing; should it not (a file system that lags behind), it is
    asked again a little later, and ``missing`` counts what never came.
    """

    def __init__(self, refill: Refill, after: int = 0, pause: float = 0.2) -> None:
        """``after`` is the number of the last message that is known already; ``pause`` in s between tries."""
        self.refill = refill
        self.last = after
        self.pause = pause
        self.missing = 0

    def take(self, message: AnyMessage) -> Iterator[AnyMessage]:
        """What can be told now that ``message`` has arrived."""
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
        """What the journal has beyond the last message told."""
        for message in self.refill(self.last):
            if message.seq == self.last + 1:
                self.last = message.seq
                yield message
