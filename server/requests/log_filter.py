"""Filter for the log: it limits how often a line is repeated, so that the log does not fill the disk."""

import logging
import threading
import time

_MOST, _WINDOW = 20, 60.0
"""Largest number of log lines of one kind within a time, and this time in s. Twenty lines in a minute are enough to see
the cause (chosen values)."""


class FloodFilter(logging.Filter):
    """Filter of log lines for a handler of the log. Log lines are of the same kind if the same line of the source code
    writes them.
    """

    def __init__(self) -> None:
        super().__init__()
        self._lock = threading.Lock()
        self._seen: dict[tuple[str, int], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Returns False if a log line is above the limit. The next line of the same kind that is written gives the
        number of lines that were dropped.
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
