"""The database as an index over the folders of the runs; its rows may be older than the folders."""

import logging
import time
from collections.abc import Mapping

from sqlalchemy.exc import SQLAlchemyError

from ..database.store import Store
from .events import Run
from .retries import words

_log = logging.getLogger("conoid.server")
_REST = 5.0
"""s for which a database that failed is not used, so that the supervisor does not wait for it again. Chosen."""


class Index:
    """Used in the supervisor's thread."""

    def __init__(self, store: Store) -> None:
        """Starts with all runs saved."""
        self._store, self._rests_until = store, 0.0
        self.unsaved: set[str] = set()
        """Runs that changed after they were saved."""

    def save(self, run: Run) -> bool:
        """False, with a line in the log, when the run is not in the database yet."""
        self.unsaved.add(run.id)
        if time.monotonic() < self._rests_until:
            return False
        try:
            self._store.save(run)
        except (SQLAlchemyError, OSError) as error:
            self._rests_until = time.monotonic() + _REST
            _log.error("run %s is not in the database yet: %s", run.id, words(error))
            return False
        self.unsaved.discard(run.id)
        return True

    def add(self, run: Run, key: str | None, labels: Mapping[str, str]) -> None:
        """Writes changed runs. Rows that cannot be written keep their old values. Raises SQLAlchemyError."""
        try:
            self._store.add(run, key, labels)
        except SQLAlchemyError:
            if self._store.get(run.id) is None:
                raise
            self.unsaved.add(run.id)
