"""Runs whose folder exists. A run that has ended and whose folder is missing is in no list, no count and no sweep;
requests for it get the status 410.
"""

import errno
import os
import threading
import time
from collections.abc import Iterable, Set
from pathlib import Path

from ..database.identity import FILE
from .events import Run

_FRESH = 1.0
"""Time in s for which the list of folders is used before it is read again; a run without a folder stays in lists for
this time at most. Reading 10,000 names takes 5 ms (reason of the chosen value)."""


class ExistingRuns:
    """The names of the folders of all runs. All methods of this class may be called from any thread; the content of the
    folders is not read.
    """

    def __init__(self, runs: Path) -> None:
        """Creates the object without reading names."""
        self._runs, self._reading = runs, threading.Lock()
        self._names: set[str] = set()
        self._gone: set[str] = set()
        """Runs that were looked up one by one and have no folder; each run is looked up only once."""
        self._read = -_FRESH

    def left(self, runs: Iterable[Run]) -> list[Run]:
        """Returns the given runs, without runs that have ended and have no folder. The list of folders is at most
        ``_FRESH`` s old. Raises OSError if the folder of all runs cannot be read.
        """
        self._refresh()
        return [run for run in runs if not (run.state.final and self._is_gone(run.id))]

    def gone(self, ended: Set[str]) -> set[str]:
        """Returns those of the given runs that have ended and have no folder. Raises OSError if the folder of all runs
        cannot be read.
        """
        self._refresh()
        return {run_id for run_id in ended - self._names if self._is_gone(run_id)}

    def there(self, run_id: str) -> bool:
        """Whether the folder of the run exists now. Raises OSError if the folder of all runs is missing."""
        if (self._runs / run_id).is_dir():
            return True
        self._require()
        self._names.discard(run_id)
        self._gone.add(run_id)
        return False

    def _is_gone(self, run_id: str) -> bool:
        """Whether the run has no folder. A run that is newer than the list is looked up once."""
        return run_id not in self._names and (run_id in self._gone or not self.there(run_id))

    def _refresh(self) -> None:
        """Reads the list of folders again if it is old. Only one thread reads it; other threads use the previous list
        meanwhile.
        """
        if time.monotonic() < self._read + _FRESH or not self._reading.acquire(blocking=False):
            return
        try:
            self._require()
            self._names = set(os.listdir(self._runs))
            self._gone -= self._names
            self._read = time.monotonic()
        finally:
            self._reading.release()

    def _require(self) -> None:
        """Raises FileNotFoundError if the folder of all runs lacks the file of the server. If this file is missing, the
        disk may not be mounted, and no run counts as removed.
        """
        if not (self._runs / FILE).exists():
            raise FileNotFoundError(errno.ENOENT, "the folder of all runs is missing at present", str(self._runs))
