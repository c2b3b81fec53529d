"""The database is an index over the folders of the runs; a row of the database may be older than the folder of its
run.
"""

import logging
import time
from collections.abc import Mapping

from sqlalchemy.exc import SQLAlchemyError

from ..database.store import Store
from .events import Run
from .retries import words

_log = logging.getLogger("conoid.server")
_REST = 5.0
"""Time in s for which a failed database is not used (chosen value), so that the supervisor does not wait for the
database again."""


class Index:
    """Writes changed runs into the database. The class is used only in the supervisor's thread."""

    def __init__(self, store: Store) -> None:
        """Creates the index with no unsaved run."""
        self._store, self._rests_until = store, 0.0
        self.unsaved: set[str] = set()
        """Runs whose latest change is not in the database yet."""

    def save(self, run: Run) -> bool:
        """Adds a run to the database. Returns False, and logs an error, if the run cannot be added."""
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
        """Adds a run to the database, or updates its row. A row of the database that cannot be updated keeps its old
        values until the next try. Raises SQLAlchemyError if the run is not in the database.
        """
        try:
            self._store.add(run, key, labels)
        except SQLAlchemyError:
            if self._store.get(run.id) is None:
                raise
            self.unsaved.add(run.id)
