"""What an earlier server has left of a run, from the run's folder and from the machine."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import msgspec

from conoid.cases import layout
from conoid.cases.messages import Status
from conoid.cases.outcome import Outcome
from conoid.cases.run import State

from . import ends, farewell, folder, journal
from .events import Found, Run
from .folder import Submission
from .launch import Launcher, Trace, Worker

_STOPPABLE = {State.QUEUED, State.STARTING, State.RUNNING, State.STOPPING}


@dataclass(frozen=True)
class Left:
    """A run as its folder tells it, the idempotency key that made it, and what became of its worker."""

    run: Run
    key: str | None
    found: Found
    worker: Worker | None


def look(path: Path, known: Run | None, launcher: Launcher) -> Left:
    """``known`` is the database's word on the run, which fills in what a damaged folder does not tell any more.

    Raises OSError, and ValueError when neither folder nor database say whose run it is.
    """
    made = _submission(path)
    if made is None and known is None:
        raise ValueError(f"{layout.SUBMISSION} cannot be read, and the database does not know the run")
    accepted = folder.first(made) if made is not None else _as_accepted(known)
    told = _told(path)
    trace = launcher.find(accepted.id, path)
    run = _mended(folder.replay(accepted, told), bool(told), known, path, trace, launcher.queues)
    code, full = farewell.exit_code(path), farewell.disk_failed(path)
    found = Found(_fate(path, trace), _outcome(path), trace.rebooted, code, full, ends.when(path))
    return Left(
        _stopping(run, known, path, launcher.queues), made.idempotency_key if made else None, found, trace.worker
    )


def _submission(path: Path) -> Submission | None:
    try:
        return folder.submission(path)
    except (*folder.DAMAGED, msgspec.MsgspecError):
        return None


def _outcome(path: Path) -> Outcome | None:
    """None where it is locked away, as everything beside it."""
    try:
        return folder.outcome(path)
    except PermissionError:
        return None


def _told(path: Path) -> list[Status]:
    """What the journal tells; nothing where it cannot be read."""
    try:
        return journal.statuses(path / layout.JOURNAL)
    except folder.DAMAGED:
        return []


def _as_accepted(known: Run | None) -> Run:
    assert known is not None
    return Run(
        known.id, known.owner, known.name, known.ranks, known.submitted, threads=known.threads, title=known.title
    )


def _fate(path: Path, trace: Trace) -> Literal["none", "alive", "gone"]:
    """A record that cannot be read is the record of a launch all the same."""
    if trace.worker is not None:
        return "alive"
    return "gone" if trace.launched or folder.there(path / layout.WORKER) else "none"


def _mended(run: Run, journal_there: bool, known: Run | None, path: Path, trace: Trace, queues: bool) -> Run:
    """A run whose journal is gone, or says less than the machine: what has been launched is never launched twice. One
    that a batch system ``queues`` may still wait for its cores.
    """
    if not journal_there and known is not None:
        run = replace(known, message="") if known.state is not State.STOPPING else replace(run, state=State.STARTING)
    launched = trace.worker is not None or (not journal_there and _launched(path, trace))
    if launched and not queues and run.state in {State.ACCEPTED, State.QUEUED}:
        return replace(run, state=State.STARTING)
    return run


def _launched(path: Path, trace: Trace) -> bool:
    return trace.launched or folder.there(path / layout.WORKER) or folder.there(path / layout.OUTCOME)


def _stopping(run: Run, known: Run | None, path: Path, queues: bool) -> Run:
    """A job in a queue that says by itself that it stops was interrupted, and goes on, unless somebody has asked."""
    why = folder.stop_asked(path) or (known.stopping_for if known is not None else None)
    if why is None and queues and run.state is State.STOPPING:
        return replace(run, state=State.RUNNING)
    if why is None or run.state not in _STOPPABLE:
        return run
    return replace(run, state=State.STOPPING, stopping_for=why)
