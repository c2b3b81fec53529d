"""Supervision of one worker: its journal, its process and its limits."""

import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import msgspec

from conoid.cases.messages import Progress, Status
from conoid.cases.output import layout
from conoid.cases.run import State

from ..keeping import disk_usage
from ..launch import Phase, Worker
from . import ends, folder, journal, launcher_log
from .events import Event, GraceOver, OutputOver, WallTimeOver, WorkerExited, WorkerRuns, WorkerStarts, WorkerWaits

_FAREWELL = 10.0
"""Time in s within which a worker must exit after its last message. The launcher may hang if one of its helper
processes was killed."""
_PATIENCE = 1.0
"""Time in s between two checks of a worker in the queue of a batch system (chosen value); there may be a thousand such
workers."""
_WEIGHED = 5.0
"""Time in s between two measurements of the size of a run's folder; one takes milliseconds for some hundred files
(reason of the chosen value)."""

_progress = msgspec.json.Decoder(Progress)
_status = msgspec.json.Decoder(Status)


class Watch:
    """Checks a worker some tens of times a second, and returns its changes as events."""

    def __init__(self, run_folder: Path, worker: Worker, left: float | None, most: int | None = None) -> None:
        """Creates the watch of a worker. ``left``: remaining wall time of the run, s; ``most``: largest size of the
        run's folder, bytes.
        """
        self._most, self._weigh_at = most, time.monotonic() + _WEIGHED
        self.worker, self._folder = worker, run_folder
        self._tail = journal.Tail(run_folder / layout.JOURNAL)
        self._deadline = None if left is None else time.monotonic() + left
        self._kill_at, self._runs = float("inf"), False
        self._phase: Phase = "unknown"
        self._next, self._full = 0.0, False
        self.progress: Progress | None = None
        self.news = False
        """Whether the last check has found new lines in the journal."""

    def look(self) -> Iterator[Event]:
        """Yields the events since the last check of the worker. If the disk was full when the worker ended, the end
        counts as an error of the disk, also if the end is handled later. Raises OSError if files of the run cannot be
        read.
        """
        now = time.monotonic()
        if self._phase == self.worker.phase() == "waits" and now < self._next:
            return
        self._next = now + _PATIENCE
        exit_, unseen = self.worker.exited(), self._phase == "unknown"
        yield from self._turn()
        if self._read(now):
            yield WorkerRuns()
        if exit_ is not None:
            outcome = folder.outcome(self._folder)
            code = launcher_log.exit_code(self._folder) if exit_.code is None else exit_.code
            self._full = outcome is None and (self._full or launcher_log.disk_failed(self._folder))
            traces = self._traces(exit_.last_words)
            at = ends.when(self._folder) if unseen or outcome is not None else 0.0
            yield WorkerExited(code, outcome, exit_.out_of_memory, self._full, traces, exit_.reading, at)
        elif now >= self._kill_at:
            self._kill_at = now + 1.0
            self.worker.kill()
            yield GraceOver()
        elif self._deadline is not None and now >= self._deadline:
            self._deadline = None
            yield WallTimeOver()
        elif self._most is not None and now >= self._weigh_at:
            self._weigh_at = now + _WEIGHED
            if (size := disk_usage.size(self._folder)) > self._most:
                yield OutputOver(size, self._most)
                self._most = None

    def _turn(self) -> Iterator[Event]:
        """Yields an event if the worker has got its cores, or waits for cores again."""
        phase, before = self.worker.phase(), self._phase
        self._phase = phase
        if phase == "waits":
            self._runs = False
        if phase != before and phase != "unknown":
            yield WorkerWaits() if phase == "waits" else WorkerStarts(self.worker.began())

    def stop(self, grace: float) -> None:
        """Asks the worker to stop, and sets the time at which the server kills it."""
        self.worker.stop()
        self._kill_at = min(self._kill_at, time.monotonic() + grace)

    def _traces(self, last_words: str) -> str:
        wrong = folder.outcome_error(self._folder)
        return f"{layout.OUTCOME}: {wrong}" if wrong else f"its last words: {last_words}" if last_words else ""

    def _read(self, now: float) -> bool:
        """Reads the new lines of the journal. Returns whether one of them reports that the worker runs."""
        runs, self.news = False, False
        while lines := self._tail.read():
            self.news = True
            for line in lines:
                if line.type == "progress":
                    with suppress(msgspec.MsgspecError):
                        self.progress = _progress.decode(line.raw)
                    runs |= self._phase != "waits"
                elif line.type == "status":
                    with suppress(msgspec.MsgspecError):
                        runs |= _status.decode(line.raw).state == State.RUNNING
                elif line.type == "finished":
                    self._kill_at = min(self._kill_at, now + _FAREWELL)
        fresh, self._runs = runs and not self._runs, self._runs or runs
        return fresh
