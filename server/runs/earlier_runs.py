"""Runs that an earlier server has left in the folder of runs. The folder of each run is read once; if this fails, it is
read again later.
"""

import logging
from collections.abc import Callable
from functools import partial
from pathlib import Path

from sqlalchemy.exc import SQLAlchemyError

from ..database.store import Store
from ..launch import Launcher
from . import folder, pins, recovery
from .events import Run
from .index import Index
from .recovery import Left
from .retries import words

_log = logging.getLogger("conoid.server")


class EarlierRuns:
    """Reads the runs of an earlier server. The class is used only in the supervisor's thread."""

    def __init__(
        self, runs: Path, store: Store, index: Index, launcher: Launcher, found: Callable[[Left], None]
    ) -> None:
        """Creates the reader of earlier runs. ``found``: function that is called with each run that was read, ended or
        open.
        """
        self._runs, self._store, self._index, self._launcher, self._found = runs, store, index, launcher, found
        self._failed: dict[Path, str] = {}

    def all(self) -> None:
        """Reads every run that is not known to have ended. A folder without a readable submission counts as a run, too.
        Raises OSError or SQLAlchemyError.
        """
        ended, known, last = self._store.ended(), self._store.open(), ""
        emptied = set(known)
        for path in folder.scan(self._runs):
            last = path.name
            emptied.discard(path.name)
            if path.name not in ended:
                self._take_up(path, partial(known.get, path.name))
        for run_id in sorted(emptied):
            if (self._runs / run_id).is_dir():
                self._take_up(self._runs / run_id, partial(known.get, run_id))
        if last:
            folder.begin_after(last)
        if self._store.unlabelled:
            for run in self._store.all():
                self._store.relabel(run, pins.labels(self._runs / run.id))

    def again(self) -> None:
        """Reads the runs that could not be read before."""
        for path in tuple(self._failed):
            self.take_up(path)

    def take_up(self, path: Path) -> None:
        """Reads a run. If this fails, logs the error once, and reads the run again later."""
        self._take_up(path, lambda: self._store.get(path.name))

    def _take_up(self, path: Path, known_of: Callable[[], Run | None]) -> None:
        """Reads a run. The database is written only if its state is older than that in the folder; a thousand unchanged
        runs then cause no writes.
        """
        reason = self._failed.pop(path, "")
        try:
            known = known_of()
            left = recovery.look(path, known, self._launcher)
            if left.run != known:
                self._index.add(left.run, left.key, pins.labels(path))
        except (OSError, ValueError, SQLAlchemyError) as error:
            self._failed[path] = words(error)
            if reason != words(error):
                _log.error("run %s of an earlier server cannot be read: %s", path.name, words(error))
            return
        self._found(left)
