"""What an earlier server has left of a run, from the run's folder and from the machine."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from conoid.cases.run import State

from . import folder
from .launch import Launcher, Worker
from .lifecycle import Found, Run

_STOPPABLE = {State.QUEUED, State.STARTING, State.RUNNING, State.STOPPING}


@dataclass(frozen=True)
class Left:
    """A run as its folder tells it, the idempotency key that made it, and what became of its worker."""

    run: Run
    key: str | None
    found: Found
    worker: Worker | None


def look(path: Path, known: Run | None, launcher: Launcher) -> Left:
    """``known`` is the database's word on the run: only it remembers that a stop was asked for.

    Raises OSError, and ValueError when the folder's files are not what they should be.
    """
    run = folder.run(path)
    if known is not None and known.stopping_for is not None and run.state in _STOPPABLE:
        run = replace(run, state=State.STOPPING, stopping_for=known.stopping_for)
    elif run.state is State.STOPPING and launcher.queues:
        run = replace(run, state=State.RUNNING)  # its job was interrupted, and nobody has asked for its end
    trace = launcher.find(run.id, path)
    fate: Literal["none", "alive", "gone"] = "gone" if trace.launched else "none"
    if trace.worker is not None:
        fate = "alive"
    found = Found(fate, folder.outcome(path), trace.rebooted)
    return Left(run, folder.submission(path).idempotency_key, found, trace.worker)
