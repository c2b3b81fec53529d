"""Queries of Slurm's accounting database, in a separate thread, so that the server never waits for the database."""

import logging
import queue
import threading
from typing import Protocol

from conoid.cases.site import slurm

_log = logging.getLogger("conoid.server")


class Taker(Protocol):
    """A run whose job has ended."""

    def took(self, found: dict[str, str]) -> None:
        """Stores the usage of the job, as the accounting database has reported it. Raises OSError if the answer cannot
        be stored.
        """


class Accounting:
    """Queries of the accounting database. All methods of this class may be called from any thread."""

    def __init__(self, place: str = "") -> None:
        """Creates the object without a thread; the thread starts with the first job. ``place``: the folder of Slurm's
        commands.
        """
        self._place = place
        self._waiting: queue.SimpleQueue[tuple[Taker, str]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="sacct", daemon=True)
        self._lock = threading.Lock()

    def note(self, run: Taker, job: str) -> None:
        """Adds a query about the job of a run; the thread stores the answer in the run."""
        self._waiting.put((run, job))
        with self._lock:
            if not self._thread.is_alive():
                self._thread.start()

    def _work(self) -> None:
        while True:
            run, job = self._waiting.get()
            try:
                if found := slurm.taken(self._place, job):
                    run.took(found)
            except Exception:
                _log.exception("the usage of job %s is not stored", job)
