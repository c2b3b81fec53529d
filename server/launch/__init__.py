"""Launchers: the interface with which the server starts and stops workers. Each launcher has its own module."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from conoid.cases.run import Cause, State

Phase = Literal["unknown", "waits", "runs"]
"""State of a worker as its launcher reports it: it waits for cores, it runs, or the state is unknown. The state is
unknown while a batch system does not answer; the server then changes nothing."""
Reading = tuple[State, Cause, str]
"""End of a worker that has written no outcome: state, cause, message."""


class LaunchError(Exception):
    """Error: the worker could not be started. The text of this error is one line."""


class DamagedError(LaunchError):
    """Error: the accepted case, or the folder of the run, has changed or is missing."""


@dataclass(frozen=True)
class Access:
    """Address and credentials with which a worker publishes on Zenoh. The user name is empty for a router without
    access control.
    """

    endpoint: str
    prefix: str
    user: str = ""
    password: str = ""


@dataclass(frozen=True)
class Job:
    """The data that a launcher needs to start a run."""

    run: str
    ranks: int
    case: Path
    folder: Path
    telemetry: Access | None
    profile: str = ""
    """Profile of the batch system; empty: the default profile of the site."""
    wall_time: float | None = None
    """Time limit of the run from its start, s."""
    group: str = ""
    """Name of a group of runs, such as a sweep, that may be submitted as one job array; empty: no group."""
    threads: int = 1
    """Number of threads of each rank."""


@dataclass(frozen=True)
class Exit:
    """End of a worker's processes. ``code``: the exit code, or the negative number of the signal that ended it; None if
    this server is not the parent process of the worker.
    """

    code: int | None
    out_of_memory: bool
    last_words: str
    reading: Reading | None = None
    """State, cause and message of the end, as a batch system reports it. The data of the batch system have priority
    over the exit code."""


class Worker(Protocol):
    """A worker that was started, with all its ranks, or a job that was submitted to a batch system. No method waits."""

    def phase(self) -> Phase:
        """Returns the present state."""

    def began(self) -> float:
        """Returns the Unix time at which the worker got its cores, s; 0 if it is still waiting for cores."""

    def note(self) -> str:
        """Returns a remark for the user, for example why the worker waits; empty if there is none."""

    def exited(self) -> Exit | None:
        """Returns the end of the worker; None while any process of the worker runs."""

    def stop(self) -> None:
        """Asks the worker to stop after its current time step."""

    def kill(self) -> None:
        """Kills all processes of the worker."""


@dataclass(frozen=True)
class Trace:
    """The traces of an earlier launch of a run that a launcher has found. The worker if it still runs; whether there
    was a launch; whether the machine has been booted since the launch.
    """

    worker: Worker | None
    launched: bool
    rebooted: bool


class Launcher(Protocol):
    """Protocol of a launcher: starts workers and finds workers of an earlier server."""

    queues: bool
    """True if workers wait for cores in the queue of a batch system."""

    def start(self, job: Job) -> Worker:
        """Starts the ranks of a worker and records them in the run's folder. Raises LaunchError if the worker cannot be
        started.
        """

    def find(self, run: str, folder: Path) -> Trace:
        """Returns the worker that an earlier server started for the run."""

    def tidy(self) -> None:
        """Removes what killed workers may have left outside of the folders of their runs, such as shared memory."""
