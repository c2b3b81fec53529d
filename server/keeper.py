"""Looks after the folders of runs: how large they are, and which of those that have ended are removed, and when."""

import logging
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from sqlalchemy.exc import SQLAlchemyError

from conoid.cases.figures import size

from . import farewells, folder, pins
from .events import Run
from .farewells import Farewells
from .holds import words
from .settings import Settings
from .store import Store

_log = logging.getLogger("conoid.server")
_PATIENCE = 5.0
"""s after its start at which a server first looks at the folders, so that it answers before, and between two looks for
who asks. Chosen."""


class Keeper:
    """A thread where a site asks for it by [retention] or quota.output_bytes; its methods may be called from any."""

    def __init__(self, settings: Settings, store: Store, lines: Farewells, is_open: Callable[[str], bool]) -> None:
        """``is_open`` says whether a run has not ended for good."""
        self._settings, self._store, self._lines, self._is_open = settings, store, lines, is_open
        self._rules = settings.site.retention
        self._lock, self._asking = threading.Lock(), threading.Lock()
        self._asked_again = 0.0
        self._sizes: dict[str, int] = {}
        self._settled: set[str] = set()
        """Runs whose size was read after their end."""
        self._kept: Counter[str] = Counter()
        self._leave = threading.Event()
        self._thread = threading.Thread(target=self._work, name="keeper", daemon=True)

    def start(self) -> None:
        """Begins to look; does nothing where nobody has asked for it."""
        if self._rules.oldest is not None or self._rules.bytes is not None or self._settings.site.quota.output_bytes:
            self._thread.start()

    def close(self) -> None:
        """Looks no more."""
        self._leave.set()
        if self._thread.is_alive():
            self._thread.join(_PATIENCE)

    def kept(self, owner: str) -> int:
        """Bytes of the folders of an owner's runs, at the last look."""
        return self._kept[owner]

    def kept_now(self, owner: str) -> int:
        """The same; where no thread looks they are looked at now, at most every ``_PATIENCE`` s.

        Raises SQLAlchemyError.
        """
        with self._asking:
            if not self._thread.is_alive() and time.monotonic() >= self._asked_again:
                with suppress(OSError):
                    self._weigh(*self._all())
                self._asked_again = time.monotonic() + _PATIENCE
        return self._kept[owner]

    def remove(self, run: Run, why: str) -> None:
        """Removes the folder of a run that has ended; its line is on disk first. Raises OSError."""
        path = self._settings.runs / run.id
        if not path.is_dir():
            raise FileNotFoundError(path)
        self._lines.add(farewells.of(run, path, why))
        folder.purge(self._settings.runs, run.id)
        with self._lock:
            self._kept[run.owner] -= self._sizes.pop(run.id, 0)

    def look(self) -> None:
        """One look at all folders. Raises OSError, SQLAlchemyError."""
        paths, known = self._all()
        self._weigh(paths, known)
        for run, why in self._due([known[path.name] for path in paths], time.time()):
            with suppress(FileNotFoundError):  # its owner was faster
                self.remove(run, why)
                _log.info("run %s of %s is removed: %s", run.id, run.owner, why)

    def _all(self) -> tuple[list[Path], dict[str, Run]]:
        """The folders of all runs that the database knows, and these."""
        known = {run.id: run for run in self._store.all()}
        return [path for path in folder.runs_in(self._settings.runs) if path.name in known], known

    def _weigh(self, paths: list[Path], known: dict[str, Run]) -> None:
        """Reads the sizes of all folders but those that change no more."""
        for path in paths:
            if path.name not in self._settled:
                size = folder.size(path)
                with self._lock:
                    self._sizes[path.name] = size
                if known[path.name].state.final and not self._is_open(path.name):
                    self._settled.add(path.name)
        there = {path.name for path in paths}
        self._settled &= there
        with self._lock:
            self._sizes = {run_id: size for run_id, size in self._sizes.items() if run_id in there}
            self._kept = Counter()
            for run_id, size in self._sizes.items():
                self._kept[known[run_id].owner] += size

    def _due(self, runs: list[Run], now: float) -> Iterator[tuple[Run, str]]:
        """The runs to be removed, oldest first, and why."""
        total, most, oldest = sum(self._sizes.values()), self._rules.bytes, self._rules.oldest
        for run in sorted(runs, key=lambda run: run.finished):
            old = oldest is not None and now - run.finished > oldest
            large = most is not None and total > most
            if not run.state.final or not (old or large) or self._is_open(run.id):
                continue
            if pins.pinned(self._settings.runs / run.id):
                continue
            total -= self._sizes.get(run.id, 0)
            yield run, f"older than {self._rules.age}" if old else f"all runs had more than {size(most)}"

    def _work(self) -> None:
        rest = min(_PATIENCE, self._rules.rest)
        while not self._leave.wait(rest):
            rest = self._rules.rest
            try:
                self.look()
            except (OSError, SQLAlchemyError) as error:
                _log.error("folders are looked at again in %g s: %s", rest, words(error))
            except Exception:
                _log.exception("folders are looked at again in %g s", rest)


def restore(store: Store, lines: Farewells) -> None:
    """A database that was lost learns of the runs that have been removed. Raises SQLAlchemyError, OSError."""
    ended = store.ended()
    for run_id in lines:
        line = lines.get(run_id)
        if run_id not in ended and line is not None:
            store.add(line.run, None)
