"""Removal of the folders of runs and of uploaded files, by their age and by their size."""

import logging
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Set
from contextlib import suppress
from pathlib import Path

from sqlalchemy.exc import SQLAlchemyError

from conoid.cases import figures

from ..database.store import Store
from ..intake.uploads import Uploads
from ..runs import folder, pins
from ..runs.events import Run
from ..runs.retries import words
from ..settings import Settings
from . import removed_runs
from .disk_usage import DiskUsage, Left, copies, size
from .removed_runs import RemovedRuns

_log = logging.getLogger("conoid.server")
_PATIENCE = 5.0
"""Time in s between the start of the server and the first check of the folders (chosen value). ``_PATIENCE`` is also
the smallest time between two checks."""


class Removal:
    """Measures and removes folders in a thread of its own. All methods of this class may be called from any thread.
    Folders are measured only if the site has the table [retention] or the key quota.output_bytes.
    """

    def __init__(
        self, settings: Settings, store: Store, lines: RemovedRuns, is_open: Callable[[str], bool], sent: Uploads
    ) -> None:
        """Creates the object; ``start`` starts its thread. ``is_open``: function that returns whether a run may still
        change.
        """
        self._settings, self._store, self._lines, self._is_open, self._sent = settings, store, lines, is_open, sent
        self._rules = settings.site.retention
        asked = self._rules.oldest is not None or self._rules.bytes is not None
        self._weighs = asked or settings.site.quota.output_bytes is not None
        self.needed: Callable[[], Set[str]] = frozenset
        """Function that returns the hashes of uploaded files that must not be removed at present."""
        self._lock, self._asking = threading.Lock(), threading.Lock()
        self._asked_again = 0.0
        self._usage = DiskUsage()
        self._settled: set[str] = set()
        """Runs that have ended and whose final size is known."""
        self._kept: Counter[str] = Counter()
        self._leave = threading.Event()
        self._thread = threading.Thread(target=self._work, name="removal", daemon=True)

    def start(self) -> None:
        """Starts the thread that removes folders."""
        self._thread.start()

    def close(self) -> None:
        """Stops the thread that removes folders."""
        self._leave.set()
        if self._thread.is_alive():
            self._thread.join(_PATIENCE)

    def kept(self, owner: str) -> int:
        """Returns the number of bytes of an owner's runs and uploaded files when they were last measured."""
        return self._kept[owner]

    def kept_now(self, owner: str) -> int:
        """Returns the bytes of an owner's runs and uploaded files. If the settings of the site do not need sizes, the
        thread does not measure them; this method then measures them itself, at most every ``_PATIENCE`` s. Raises
        SQLAlchemyError.
        """
        with self._asking:
            if not self._weighs and time.monotonic() >= self._asked_again:
                with suppress(OSError):
                    self._weigh(*self._all())
                self._asked_again = time.monotonic() + _PATIENCE
        return self._kept[owner]

    def remove(self, run: Run, why: str) -> None:
        """Removes the folder of a run that has ended; before, it writes the record of the run to disk. Raises OSError
        if the folder cannot be removed.
        """
        path = self._settings.runs / run.id
        if not path.is_dir():
            raise FileNotFoundError(path)
        self._lines.add(removed_runs.of(run, path, why))
        folder.purge(self._settings.runs, run.id)
        with self._lock:
            self._usage.drop(run.id)
            self._kept = self._usage.by_owner()

    def look(self) -> None:
        """Checks all folders of runs and all uploaded files once, and removes those that the rules of the site select.
        Raises OSError or SQLAlchemyError.
        """
        for line in self._sent.purge(time.time(), self.needed()):
            _log.info("%s is removed: no run uses it, and it was not requested lately", line)
        if not self._weighs:
            return
        paths, known = self._all()
        self._weigh(paths, known)
        for run, why in self._due([known[path.name] for path in paths], time.time()):
            with suppress(FileNotFoundError):  # the owner may be removing the run at the same time
                self.remove(run, why)
                _log.info("run %s of %s is removed: %s", run.id, run.owner, why)

    def _all(self) -> tuple[list[Path], dict[str, Run]]:
        """Returns the folders of all runs in the database, and the runs by id."""
        known = {run.id: run for run in self._store.all()}
        return [path for path in folder.runs_in(self._settings.runs) if path.name in known], known

    def _weigh(self, paths: list[Path], known: dict[str, Run]) -> None:
        """Measures the folders that may have changed since the last time, and the uploaded files."""
        for path in paths:
            if path.name not in self._settled:
                weighed = size(path), copies(path)
                with self._lock:
                    self._usage.note(path.name, known[path.name].owner, *weighed)
                if known[path.name].state.final and not self._is_open(path.name):
                    self._settled.add(path.name)
        there = {path.name for path in paths}
        self._settled &= there
        sent = {owner: self._sent.weigh(owner) for owner in self._sent.owners()}
        with self._lock:
            self._usage.keep(there, sent)
            self._kept = self._usage.by_owner()

    def _due(self, runs: list[Run], now: float) -> Iterator[tuple[Run, str]]:
        """Yields the runs to be removed, oldest first, each with the rule that selects it."""
        left, most, oldest = Left(self._usage), self._rules.bytes, self._rules.oldest
        for run in sorted(runs, key=lambda run: run.finished):
            old = oldest is not None and now - run.finished > oldest
            large = most is not None and left.total > most
            if not run.state.final or not (old or large) or self._is_open(run.id):
                continue
            if pins.pinned(self._settings.runs / run.id):
                continue
            left.drop(run.id)
            yield run, f"older than {self._rules.age}" if old else f"all folders had more than {figures.size(most)}"

    def _work(self) -> None:
        rest = min(_PATIENCE, self._rules.rest)
        while not self._leave.wait(rest):
            rest = self._rules.rest
            try:
                self.look()
            except (OSError, SQLAlchemyError) as error:
                _log.error("the folders of runs are checked again in %g s: %s", rest, words(error))
            except Exception:
                _log.exception("the folders of runs are checked again in %g s", rest)


def restore(store: Store, lines: RemovedRuns) -> None:
    """Marks removed runs as removed in a new database that replaces a lost one. Raises SQLAlchemyError or OSError."""
    ended = store.ended()
    for run_id in lines:
        line = lines.get(run_id)
        if run_id not in ended and line is not None:
            store.add(line.run, None)
