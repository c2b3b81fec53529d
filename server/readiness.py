"""Whether the database and the folder of the runs take what the server would write."""

import shutil
import threading
import time

from sqlalchemy.exc import SQLAlchemyError

from . import durable
from .settings import Settings
from .store import Store

_FRESH = 1.0
"""s for which an answer holds: who asks needs no token, and each look writes to the disk. Chosen."""


class Readiness:
    """May be asked from any thread."""

    def __init__(self, settings: Settings, store: Store) -> None:
        """Looks at nothing yet."""
        self._settings, self._store = settings, store
        self._lock = threading.Lock()
        self._until = 0.0
        self._checks: dict[str, bool] = {}

    def checks(self) -> dict[str, bool]:
        """What can be used now: ``database``, ``runs`` (takes files), ``disk`` (as much is free as is kept)."""
        with self._lock:
            if time.monotonic() >= self._until:
                self._checks = {"database": self._database(), "runs": self._runs(), "disk": self._disk()}
                self._until = time.monotonic() + _FRESH
            return dict(self._checks)

    def _database(self) -> bool:
        try:
            self._store.probe()
        except SQLAlchemyError:
            return False
        return True

    def _runs(self) -> bool:
        try:
            durable.probe(self._settings.runs)
        except OSError:
            return False
        return True

    def _disk(self) -> bool:
        try:
            return shutil.disk_usage(self._settings.runs).free >= self._settings.caps.free_disk
        except OSError:
            return False
