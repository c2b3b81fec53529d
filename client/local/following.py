"""Following a run in a folder of this machine by its journal, without a server (``conoid watch FOLDER``). Slurm is
asked about the job of the run.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.messages import AnyMessage, Status
from conoid.cases.outcome import from_json
from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.run import Cause, State
from conoid.cases.site import batch, slurm, slurm_call

from ..journal import from_line
from ..remote.link import Link

_PAUSE = 0.5
"""Pause between two readings of the journal, s (chosen value: a run sends a message four times a second)."""
_ASK_EVERY = 10.0
"""Time without a message after which Slurm is asked, s (chosen value: a few hundred users who follow runs cause one
request in 30 ms)."""
_AT_WORK = {State.STARTING, State.RUNNING}
"""States of a run in which a worker writes into the folder."""


@dataclass(frozen=True)
class Titled:
    """Id and title of a run, for the head of the display."""

    title: str


class _File:
    name, trouble = "journal", ""

    def get(self, timeout: float) -> AnyMessage | None:
        """Returns None: this subscription has no messages."""
        return None

    def close(self) -> None:
        """Does nothing."""


class FolderRun:
    """A run in a folder of this machine; its journal gives the messages."""

    def __init__(self, folder: Path, place: str = "") -> None:
        """``folder``: folder of the run; ``place``: folder of the Slurm commands, empty if they are in PATH."""
        self.folder, self._place = folder.resolve(), place
        self.id = self.folder.name
        self._asked, self._reported = time.monotonic(), ""

    def status(self) -> Titled:
        """Returns the id of the run and the title of the case, if the case exists already."""
        try:
            case = msgspec.json.decode(whole.read(self.folder / layout.RESOLVED_CASE), type=dict[str, Any])
        except (OSError, msgspec.MsgspecError):
            return Titled("")
        return Titled(str(case.get("title") or case.get("name", "")))

    def link(self) -> Link:
        """Returns a subscription without messages, because the messages come from the journal."""
        return _File()

    def messages(
        self, *, link: Link | None = None, pause: Callable[[float], None] = time.sleep
    ) -> Iterator[AnyMessage]:
        """Yields every message of the journal once and in order, until the end of the run."""
        offset, state = 0, State.QUEUED
        while True:
            end = self._outcome()  # The outcome is written last; when it exists, the journal is complete.
            raw, offset = self._read(offset)
            for line in raw:
                try:
                    message = from_line(line)
                except msgspec.DecodeError:  # A killed worker may leave an incomplete line.
                    continue
                yield message
                if isinstance(message, Status):
                    state = State(message.state)
                    if state.final:
                        return
            if end is not None:
                yield end
                return
            if not raw:
                for status in self._ask(state):
                    yield status
                    if State(status.state).final:
                        return
                pause(_PAUSE)
            else:
                self._asked = time.monotonic()

    def _read(self, offset: int) -> tuple[list[bytes], int]:
        """Returns the complete lines of the journal from the byte ``offset`` on, and the offset of the line after
        them.
        """
        try:
            with (self.folder / layout.JOURNAL).open("rb") as file:
                file.seek(offset)
                data = file.read()
        except FileNotFoundError:
            return [], offset
        lines = data[: data.rfind(b"\n") + 1]
        return lines.splitlines(), offset + len(lines)

    def _job(self) -> batch.Job | None:
        try:
            return batch.read_job(self.folder)
        except (OSError, msgspec.MsgspecError):
            return None

    def _pending(self, state: State, message: str) -> Iterator[Status]:
        """Yields the reason why a queued run waits, if the reason has changed."""
        if state is State.QUEUED and message != self._reported:
            self._reported = message
            yield self._status(state, message)

    def _outcome(self) -> Status | None:
        try:
            end = from_json(whole.read(self.folder / layout.OUTCOME))
        except (OSError, msgspec.MsgspecError):
            return None
        return self._status(end.state, end.message, end.cause)

    def _status(self, state: str, message: str, cause: str | None = None) -> Status:
        return Status(run=self.id, wall=time.time(), state=state, cause=cause, message=message)

    def _ask(self, state: State) -> Iterator[Status]:
        """Yields the state that Slurm reports for a job, if the run has sent no message for some time. Without a job,
        it yields whether the worker still exists. ``state``: last state in the journal.
        """
        if time.monotonic() - self._asked <= _ASK_EVERY:
            return
        self._asked = time.monotonic()
        job = self._job()
        if job is None:
            if state in _AT_WORK and not slurm.held(self.folder) and self._outcome() is None:
                yield self._status(
                    State.LOST,
                    "no worker writes into the folder of the run, and no worker has written an outcome",
                    Cause.NODE,
                )
            return
        try:
            entries = slurm.jobs(self._place, job.name)
        except slurm_call.SlurmError as error:
            yield from self._pending(state, f"Slurm does not answer: {error}")
            return
        for entry in entries[:1]:
            if entry.state in slurm.PENDING:
                yield from self._pending(State.QUEUED, f"Slurm job {entry.job} is pending: {entry.reason}")
            elif entry.state in slurm.FINAL and not slurm.held(self.folder):
                message = f"Slurm job {entry.job} ended as {entry.state} and wrote no outcome"
                yield self._outcome() or self._status(State.LOST, message, Cause.NODE)
