"""The state of a run after a restart of the server, from its folder and from the processes of the machine."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import msgspec

from conoid.cases.messages import Status
from conoid.cases.outcome import Outcome
from conoid.cases.output import layout
from conoid.cases.run import State

from ..launch import Launcher, Trace, Worker
from . import ends, folder, journal, launcher_log
from .events import Found, Run
from .folder import Submission

_STOPPABLE = {State.QUEUED, State.STARTING, State.RUNNING, State.STOPPING}


@dataclass(frozen=True)
class Left:
    """A run that an earlier server has left, with its idempotency key and its worker if it still runs."""

    run: Run
    key: str | None
    found: Found
    worker: Worker | None


def look(path: Path, known: Run | None, launcher: Launcher) -> Left:
    """Returns the run in the folder ``path``. ``known``: the row of the run in the database, which replaces damaged
    files. Raises OSError; raises ValueError if neither the folder nor the database contains the owner of the run.
    """
    made = _submission(path)
    if made is None and known is None:
        raise ValueError(f"{layout.SUBMISSION} cannot be read, and the database does not contain the run")
    accepted = folder.first(made) if made is not None else _as_accepted(known)
    statuses = _statuses(path)
    trace = launcher.find(accepted.id, path)
    run = _mended(folder.replay(accepted, statuses), bool(statuses), known, path, trace, launcher.queues)
    code, full = launcher_log.exit_code(path), launcher_log.disk_failed(path)
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
    """Returns the outcome of the run; None if it is missing or cannot be read."""
    try:
        return folder.outcome(path)
    except PermissionError:
        return None


def _statuses(path: Path) -> list[Status]:
    """Returns the Status messages of the journal; empty if the journal cannot be read."""
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
    """Returns whether the run has no worker yet, a worker that is alive, or a worker that has ended. A process record
    that cannot be read still proves that a worker was started.
    """
    if trace.worker is not None:
        return "alive"
    return "gone" if trace.launched or folder.there(path / layout.WORKER) else "none"


def _mended(run: Run, journal_there: bool, known: Run | None, path: Path, trace: Trace, queues: bool) -> Run:
    """Returns the run with a corrected state, if its journal is missing or older than its processes. A run that was
    started is never started twice. ``queues``: whether the launcher is a batch system, in whose queue the run may still
    wait for cores.
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
    """Returns the state of a waiting job whose journal reports a stop. A job that has no outcome and was not requested
    to stop was interrupted and will continue; after a request to stop, it has ended.
    """
    why = folder.stop_asked(path) or (known.stopping_for if known is not None else None)
    if why is None and queues and run.state is State.STOPPING:
        return replace(run, state=State.RUNNING)
    if why is None or run.state not in _STOPPABLE:
        return run
    return replace(run, state=State.STOPPING, stopping_for=why)
