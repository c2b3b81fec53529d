"""Asks the accounting database what jobs have taken, in a thread of its own: nobody waits for it."""

import logging
import queue
import threading
from typing import Protocol

from conoid.cases import slurm

_log = logging.getLogger("conoid.server")


class Taker(Protocol):
    """A run whose job has ended."""

    def took(self, found: dict[str, str]) -> None:
        """What the database says of it. Raises OSError."""


class Clerk:
    """May be used from any thread."""

    def __init__(self, place: str = "") -> None:
        """``place``: the folder of Slurm's commands. The thread starts with the first job."""
        self._place = place
        self._waiting: queue.SimpleQueue[tuple[Taker, str]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="sacct", daemon=True)
        self._lock = threading.Lock()

    def note(self, run: Taker, job: str) -> None:
        """Asks when it can, and writes down what is answered."""
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
                _log.exception("what job %s took is not written down", job)
