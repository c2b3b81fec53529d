"""Launchers: the protocol by which workers are started and stopped; one module for each launcher."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from conoid.cases.run import Cause, State

Phase = Literal["unknown", "waits", "runs"]
"""State of a worker as its launcher reports it: waiting for cores, or running. A batch system that does not answer
changes nothing."""
Reading = tuple[State, Cause, str]
"""The end of a worker without an outcome: state, cause, message."""


class LaunchError(Exception):
    """The worker could not be started; the text is one line."""


class DamagedError(LaunchError):
    """The accepted case, or the folder, has changed or is missing."""


@dataclass(frozen=True)
class Access:
    """Zenoh address and credentials of a worker (no user: the router needs none)."""

    endpoint: str
    prefix: str
    user: str = ""
    password: str = ""


@dataclass(frozen=True)
class Job:
    """A run or job that a launcher has started."""

    run: str
    ranks: int
    case: Path
    folder: Path
    telemetry: Access | None
    profile: str = ""
    """Profile of the batch system; empty: the default of the site."""
    wall_time: float | None = None
    """Time limit from the start, s."""
    group: str = ""
    """Group of runs that may be handed over as one job array, such as a sweep; empty: none."""
    threads: int = 1
    """Threads of each rank."""


@dataclass(frozen=True)
class Exit:
    """End of a worker's processes. ``code``: the exit code; negative: minus the number of the signal; None where
    this server is not the parent."""

    code: int | None
    out_of_memory: bool
    last_words: str
    reading: Reading | None = None
    """The end as a batch system reports it, which comes before the exit code."""


class Worker(Protocol):
    """A started worker with all its ranks, or a job handed to a batch system. No method blocks."""

    def phase(self) -> Phase:
        """The state now."""

    def began(self) -> float:
        """Unix time at which it got its cores, s; 0 before that."""

    def note(self) -> str:
        """A remark for users: why it waits, or which service does not answer; empty for none."""

    def exited(self) -> Exit | None:
        """The end; None while any of its processes runs."""

    def stop(self) -> None:
        """Asks it to stop at its next step."""

    def kill(self) -> None:
        """Kills all its processes."""


@dataclass(frozen=True)
class Trace:
    """The trace of an earlier launch: the worker if it runs, whether there was one, whether that was before the last
    boot."""

    worker: Worker | None
    launched: bool
    rebooted: bool


class Launcher(Protocol):
    """A way to run workers."""

    queues: bool
    """True when workers wait for cores in the queue of a batch system."""

    def start(self, job: Job) -> Worker:
        """Starts the ranks and records them in the run's folder. Raises LaunchError."""

    def find(self, run: str, folder: Path) -> Trace:
        """The worker that an earlier server started for the run."""

    def tidy(self) -> None:
        """Removes what killed workers may have left outside of their folders, such as shared memory."""
