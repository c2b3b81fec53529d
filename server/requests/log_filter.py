"""Filter that limits repeated lines in the log, so that the log does not fill the disk."""

import logging
import threading
import time

_MOST, _WINDOW = 20, 60.0
"""Largest number of log lines of one kind, and the time in s in which the lines are counted. The chosen number of lines
is enough to see the cause."""


class FloodFilter(logging.Filter):
    """Filter of log lines for a handler of the log. Log lines are of one kind if the same line of the source code
    writes them.
    """

    def __init__(self) -> None:
        super().__init__()
        self._lock = threading.Lock()
        self._seen: dict[tuple[str, int], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Returns False if a log line is above the limit. The next written line of the same kind contains the number of
        dropped lines.
        """
        place, now = (record.pathname, record.lineno), time.monotonic()
        with self._lock:
            since, count = self._seen.get(place, (now, 0))
            if now > since + _WINDOW:
                if count > _MOST:
                    record.msg = f"{record.getMessage()} (and {count - _MOST} more like this)"
                    record.args = ()
                since, count = now, 0
            self._seen[place] = (since, count + 1)
        return count < _MOST


def install() -> None:
    """Adds the filter to every handler of the log."""
    for handler in logging.getLogger().handlers:
        handler.addFilter(FloodFilter())
