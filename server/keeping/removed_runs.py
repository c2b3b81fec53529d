"""The file purged.jsonl: it has one line for each run whose folder was removed, with the outcome of the run."""

import io
import os
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.outcome import known
from conoid.cases.reading import whole
from conoid.cases.run import Cause, State

from .. import durable
from ..runs import folder
from ..runs.events import Run
from . import disk_usage

FILE = "purged.jsonl"


class RemovedRun(msgspec.Struct, kw_only=True, frozen=True):
    """The record of a removed run. Times are Unix times in s."""

    id: str
    owner: str
    name: str
    ranks: int
    submitted: float
    started: float
    finished: float
    state: str
    cause: str | None
    message: str
    removed: float
    why: str
    """The user or the rule of the site by which the run was removed."""
    steps: int | None = None
    """Number of the last step; None if unknown."""
    time: float | None = None
    digest: str = ""
    bytes: int = 0
    threads: int = 1

    @property
    def run(self) -> Run:
        """Returns the record of a removed run in the form of a row of the table of runs."""
        cause = Cause(self.cause) if self.cause else None
        return Run(
            self.id, self.owner, self.name, self.ranks, self.submitted, State(self.state), cause, self.message,
            self.started, self.finished, threads=self.threads,
        )  # fmt: skip


_record = msgspec.json.Decoder(RemovedRun)


def of(run: Run, path: Path, why: str) -> RemovedRun:
    """Returns the record of a run that has ended."""
    ended = folder.outcome(path)
    results: dict[str, Any] = (
        {} if ended is None else {"steps": ended.steps, "time": known(ended.time), "digest": ended.digest}
    )
    return RemovedRun(
        id=run.id, owner=run.owner, name=run.name, ranks=run.ranks, threads=run.threads, submitted=run.submitted,
        started=run.started, finished=run.finished, state=run.state.value,
        cause=run.cause.value if run.cause else None, message=run.message, removed=time.time(), why=why,
        bytes=disk_usage.size(path), **results,
    )  # fmt: skip


class RemovedRuns:
    """The records of all removed runs. All methods of this class may be called from any thread. In memory it has only
    the position of each line in the file.
    """

    def __init__(self, runs: Path) -> None:
        """Reads purged.jsonl once; an incomplete last line is ignored. Raises OSError if the file cannot be read."""
        self._path, self._lock = runs / FILE, threading.Lock()
        self._at: dict[str, int] = {}
        self._end = 0
        if self._path.exists():
            with io.BufferedReader(whole.opened(self._path)) as file:
                for raw in file:
                    self._note(raw, self._end)
                    self._end += len(raw)

    def _note(self, raw: bytes, place: int) -> None:
        with suppress(msgspec.MsgspecError):
            self._at[_record.decode(raw).id] = place

    def __iter__(self) -> Iterator[str]:
        """Ids of all removed runs."""
        return iter(tuple(self._at))

    def add(self, line: RemovedRun) -> None:
        """Appends a record; flushes the record to disk before it returns. A second record of a run replaces the first
        one. Raises OSError if the record cannot be written.
        """
        with self._lock, whole.appended(self._path, 0o600) as file:
            end = os.fstat(file.fileno()).st_size
            begin = b"" if not end or _last(self._path, end) == b"\n" else b"\n"
            try:
                file.write(begin + msgspec.json.encode(line) + b"\n")
                os.fsync(file.fileno())
            except OSError:
                os.ftruncate(file.fileno(), end)
                raise
            self._at[line.id] = end + len(begin)
        durable.sync_folder(self._path.parent)

    def get(self, run_id: str) -> RemovedRun | None:
        """Returns the record of a removed run; None if there is none. Raises OSError if the file cannot be read."""
        place = self._at.get(run_id)
        if place is None:
            return None
        with io.BufferedReader(whole.opened(self._path)) as file:
            file.seek(place)
            return _record.decode(file.readline())


def _last(path: Path, end: int) -> bytes:
    with whole.opened(path) as file:
        file.seek(end - 1)
        return file.read(1)
