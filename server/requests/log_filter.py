"""A filter of the log against floods: repeated messages do not fill the disk."""

import logging
import threading
import time

_MOST, _WINDOW = 20, 60.0
"""Lines of one kind that are written in so many s. Chosen: enough to see the cause."""


class FloodFilter(logging.Filter):
    """For a handler. Lines of one kind come from one place in the source."""

    def __init__(self) -> None:
        super().__init__()
        self._lock = threading.Lock()
        self._seen: dict[tuple[str, int], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """False for a line above the limit; the next line that is written says how many were left out."""
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
