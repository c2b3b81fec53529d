"""Order of messages by their number ``seq``, each message once. Missing messages are read from the journal. The
module makes no network requests.
"""

import time
from collections.abc import Callable, Iterator

from conoid.cases.messages import AnyMessage

Refill = Callable[[int], list[AnyMessage]]
"""Function that returns the messages of the journal after a given number, in order."""

_TRIES = 3
"""Number of readings of the journal for a missing message before the message is given up (chosen value: the journal is
written before a message is sent, so that the first reading has the message unless the file system lags)."""


class InOrder:
    """Sorts arriving messages into the order in which they were written.

    A message whose number has been seen is dropped. A gap in the numbers calls ``refill``, which reads the journal.
    The journal is written before a message is sent. If the file system lags and the journal does not have a message
    yet, ``refill`` is called again a little later. ``missing`` counts the messages that never arrived.
    """

    def __init__(self, refill: Refill, after: int = 0, pause: float = 0.2) -> None:
        """``after``: number of the last message that has been received; ``pause``: time between readings of the
        journal, s.
        """
        self.refill = refill
        self.last = after
        self.pause = pause
        self.missing = 0

    def take(self, message: AnyMessage) -> Iterator[AnyMessage]:
        """Yields the messages that now follow the last yielded message without a gap, after ``message`` has arrived."""
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
        """Yields the messages of the journal after the last yielded message."""
        for message in self.refill(self.last):
            if message.seq == self.last + 1:
                self.last = message.seq
                yield message
