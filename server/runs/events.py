"""The state of a run in the server, the events that change it, and the actions that follow. Data only; the rules are
in ``lifecycle``."""

from dataclasses import dataclass
from typing import Literal

from conoid.cases.outcome import Outcome
from conoid.cases.run import Cause, State


@dataclass(frozen=True)
class Run:
    """State of a run in the server. Times are Unix s, 0 while unknown."""

    id: str
    owner: str
    name: str
    ranks: int
    submitted: float
    state: State = State.ACCEPTED
    cause: Cause | None = None
    message: str = ""
    started: float = 0.0
    finished: float = 0.0
    stopping_for: Cause | None = None
    """Reason of the requested stop."""
    threads: int = 1
    """Threads of each rank."""
    title: str = ""
    """Title of the case."""

    @property
    def cores(self) -> int:
        """Cores that the run takes."""
        return self.ranks * self.threads


# Events ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Admitted:
    """The run is on disk and may be queued."""


@dataclass(frozen=True)
class Granted:
    """Enough slots are free. ``batch``: the run was handed over and waits in the queue of a batch system."""

    batch: bool = False


@dataclass(frozen=True)
class WorkerStarts:
    """A batch system has started the worker, at the Unix time ``at``."""

    at: float


@dataclass(frozen=True)
class WorkerWaits:
    """A batch system has stopped the worker; it continues from its checkpoint when it gets cores again."""


@dataclass(frozen=True)
class LaunchFailed:
    """The worker cannot be started and will not be tried again."""

    message: str
    cause: Cause = Cause.LAUNCH


@dataclass(frozen=True)
class LaunchPutOff:
    """The worker could not be started now: a full disk, no free descriptor. The run stays in the queue."""

    message: str


@dataclass(frozen=True)
class Broken:
    """The run's folder is missing (``writable`` is False), or no longer has a readable case."""

    message: str
    writable: bool = False


@dataclass(frozen=True)
class WorkerRuns:
    """The worker has reported that it runs."""


@dataclass(frozen=True)
class CancelAsked:
    """The owner has asked for a cancel. ``handed``: a worker runs, or a batch system has the run."""

    handed: bool = False


@dataclass(frozen=True)
class WallTimeOver:
    """The run has reached its limit of wall time."""


@dataclass(frozen=True)
class OutputOver:
    """The run's folder has reached its limit of bytes."""


@dataclass(frozen=True)
class GraceOver:
    """The worker did not stop within the grace period."""


@dataclass(frozen=True)
class WorkerExited:
    """The worker's processes have ended. ``code``: the exit code; negative: minus the number of the signal; None
    where no process could collect it."""

    code: int | None
    outcome: Outcome | None
    out_of_memory: bool = False
    disk_failed: bool = False
    """Whether the worker's disk is full, or it reported an error of its disk."""
    traces: str = ""
    """Message of a worker that wrote no outcome."""
    reading: tuple[State, Cause, str] | None = None
    """The end as a batch system reports it, where there is no outcome."""
    at: float = 0.0
    """Unix time of the end by the run's files, s; 0 where they do not show it: now."""


@dataclass(frozen=True)
class Found:
    """A starting server has found an open run of an earlier server."""

    worker: Literal["none", "alive", "gone"]
    outcome: Outcome | None = None
    rebooted: bool = False
    code: int | None = None
    """The end as its launcher reports it, where it could."""
    disk_failed: bool = False
    at: float = 0.0
    """Unix time of the last sign of the run in its files, s; 0 where there is none."""


Event = (
    Admitted
    | Granted
    | LaunchFailed
    | LaunchPutOff
    | Broken
    | WorkerStarts
    | WorkerWaits
    | WorkerRuns
    | CancelAsked
    | WallTimeOver
    | OutputOver
    | GraceOver
    | WorkerExited
    | Found
)

ONCE = (LaunchFailed, LaunchPutOff, Broken, Found)
"""Events that are not sent a second time."""

# Actions --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Journal:
    """Appends a Status line to the journal and publishes it. Only while no worker writes."""

    state: State
    cause: Cause | None = None
    message: str = ""


@dataclass(frozen=True)
class WriteOutcome:
    """Writes outcome.json."""

    outcome: Outcome


@dataclass(frozen=True)
class Launch:
    """Starts the worker."""


@dataclass(frozen=True)
class Adopt:
    """Watches a worker that an earlier server started."""


@dataclass(frozen=True)
class Stop:
    """Asks the worker to stop at its next step, and kills it when it does not. ``why`` is kept in the run's folder."""

    why: Cause


@dataclass(frozen=True)
class Kill:
    """Kills the worker's processes now."""


Action = Journal | WriteOutcome | Launch | Adopt | Stop | Kill
