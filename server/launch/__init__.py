"""How workers are started and ended: one protocol, one module a way of doing it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from conoid.cases.run import Cause, State

Phase = Literal["unknown", "waits", "runs"]
"""Of a worker: whether it waits for cores or has them. A batch system that cannot be reached says nothing new."""
Reading = tuple[State, Cause, str]
"""What an end means that the worker has left no outcome of: state, cause, message."""


class LaunchError(Exception):
    """The worker could not be started; the text is one line."""


class DamagedError(LaunchError):
    """What is to be run, or where, is not there any more as it was accepted."""


@dataclass(frozen=True)
class Access:
    """Where a worker publishes, and as whom (no user: the router asks for none)."""

    endpoint: str
    prefix: str
    user: str = ""
    password: str = ""


@dataclass(frozen=True)
class Job:
    """What is to be run."""

    run: str
    ranks: int
    case: Path
    folder: Path
    telemetry: Access | None
    profile: str = ""
    """Of the batch system; empty: the site's default."""
    wall_time: float | None = None
    """s that the run may take from its start."""
    group: str = ""
    """Runs that belong together, such as those of a sweep, and may be handed over as one; empty: it is alone."""
    threads: int = 1
    """Of each rank."""


@dataclass(frozen=True)
class Exit:
    """How a worker ended. ``code`` is None when this server is not its parent; negative: minus the signal."""

    code: int | None
    out_of_memory: bool
    last_words: str
    reading: Reading | None = None
    """Where somebody knows better than the code tells: a batch system."""


class Worker(Protocol):
    """A worker that was started, or handed to a batch system: all its ranks, as one. No method waits."""

    def phase(self) -> Phase:
        """What is known of it by now."""

    def began(self) -> float:
        """The Unix time at which it got its cores, s; 0 when it has none."""

    def note(self) -> str:
        """What people should know of it beyond its state: why it waits, who does not answer; empty for nothing."""

    def exited(self) -> Exit | None:
        """None while any of its processes lives."""

    def stop(self) -> None:
        """Asks it to stop at its next step."""

    def kill(self) -> None:
        """Ends all its processes now."""


@dataclass(frozen=True)
class Trace:
    """What is left of an earlier launch: the worker when it lives, whether there was one, whether it was before
    the machine's last start."""

    worker: Worker | None
    launched: bool
    rebooted: bool


class Launcher(Protocol):
    """A way to run workers."""

    queues: bool
    """True when workers wait for cores in a queue that is not the server's."""

    def start(self, job: Job) -> Worker:
        """Starts the ranks and records them in the run's folder. Raises LaunchError."""

    def find(self, run: str, folder: Path) -> Trace:
        """The worker that an earlier server started for the run."""

    def tidy(self) -> None:
        """Removes what killed workers may have left behind outside of their folders."""
