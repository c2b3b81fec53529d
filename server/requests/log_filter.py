"""A filter of the log against floods: repeated messages do not fill the disk."""

import logging
import threading
import time

_MOST, _WINDOW = 20, 60.0
"""Largest number of lines of one kind in so many s. Chosen: enough to see the cause."""


class FloodFilter(logging.Filter):
    """Filter for a handler of the log. Lines of one kind come from one line of the source."""

    def __init__(self) -> None:
        super().__init__()
        self._lock = threading.Lock()
        self._seen: dict[tuple[str, int], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Returns False for a line above the limit. The next line that is written has the number of dropped ones."""
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
    """Adds the filter to every handler."""
    for handler in logging.getLogger().handlers:
        handler.addFilter(FloodFilter())
