"""The runs in the database. The folders of the runs are the originals: a row of the database may be older than its
folder.
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
"""Time in s for which a database that has failed is not used, so that the supervisor does not wait for it again (chosen
value)."""


class Index:
    """Writes changed runs into the database. The class is used only in the supervisor's thread."""

    def __init__(self, store: Store) -> None:
        """Creates the object; no run is unsaved."""
        self._store, self._rests_until = store, 0.0
        self.unsaved: set[str] = set()
        """Runs whose last change is not in the database yet."""

    def save(self, run: Run) -> bool:
        """Writes the state of a run to the database. Returns False and logs an error if this fails."""
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
        """Adds a run to the database; if it is already there, updates its row. If the update fails, the row is written
        again later. Raises SQLAlchemyError if the run is then not in the database.
        """
        try:
            self._store.add(run, key, labels)
        except SQLAlchemyError:
            if self._store.get(run.id) is None:
                raise
            self.unsaved.add(run.id)
