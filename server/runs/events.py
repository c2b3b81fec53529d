"""The state of a run in the server, the events that change it, and the actions that follow from a change. This module
has only data; the module ``lifecycle`` has the rules.
"""

from dataclasses import dataclass
from typing import Literal

from conoid.cases.outcome import Outcome
from conoid.cases.run import Cause, State


@dataclass(frozen=True)
class Run:
    """State of a run in the server. Times are Unix times in s; an unknown time is 0."""

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
    """Reason of a stop that was requested; None if none was requested."""
    threads: int = 1
    """Number of threads of each rank."""
    title: str = ""
    """Title of the case."""

    @property
    def cores(self) -> int:
        """Number of cores that the run uses: ranks times threads."""
        return self.ranks * self.threads


# Events ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Admitted:
    """Event: the run is on disk and may be queued."""


@dataclass(frozen=True)
class Granted:
    """Event: enough cores are free for the run. ``batch``: whether the run was only submitted to a batch system and
    waits in its queue.
    """

    batch: bool = False


@dataclass(frozen=True)
class WorkerStarts:
    """Event: a batch system has started the worker at the Unix time ``at``, s."""

    at: float


@dataclass(frozen=True)
class WorkerWaits:
    """Event: a batch system has taken the cores from the worker. The worker will continue from its last checkpoint when
    the batch system starts it again.
    """


@dataclass(frozen=True)
class LaunchFailed:
    """Event: the worker cannot be started, and no further attempt will be made."""

    message: str
    cause: Cause = Cause.LAUNCH


@dataclass(frozen=True)
class LaunchPutOff:
    """Event: the worker cannot be started at present, for example because the disk is full. The run stays in the
    queue.
    """

    message: str


@dataclass(frozen=True)
class Broken:
    """Event: the run's folder is missing (``writable`` is False), or no longer has a readable case."""

    message: str
    writable: bool = False


@dataclass(frozen=True)
class WorkerRuns:
    """Event: the worker has reported that it runs."""


@dataclass(frozen=True)
class CancelAsked:
    """Event: the owner has requested a cancel. ``handed``: whether a worker runs or a job was submitted to a batch
    system.
    """

    handed: bool = False


@dataclass(frozen=True)
class WallTimeOver:
    """Event: the run has exceeded its limit of wall time."""


@dataclass(frozen=True)
class OutputOver:
    """Event: the folder of the run has exceeded its largest size."""

    size: int
    """Size of the folder, bytes."""
    most: int
    """Largest size, bytes."""


@dataclass(frozen=True)
class GraceOver:
    """Event: the worker did not stop within the grace period after the request."""


@dataclass(frozen=True)
class WorkerExited:
    """Event: the worker's processes have ended. ``code``: the exit code, or the negative number of the signal; None if
    unknown.
    """

    code: int | None
    outcome: Outcome | None
    out_of_memory: bool = False
    disk_failed: bool = False
    """Whether the disk of the worker was full, or the worker has reported an error of its disk."""
    traces: str = ""
    """Text about the end of a worker that has written no outcome, from its log."""
    reading: tuple[State, Cause, str] | None = None
    """State, cause and message of the end as a batch system reports them, for a run without an outcome."""
    at: float = 0.0
    """Unix time of the end according to the files of the run, s; 0: unknown, so that the present time is used."""


@dataclass(frozen=True)
class Found:
    """Event: a new server has found an open run of an earlier server."""

    worker: Literal["none", "alive", "gone"]
    outcome: Outcome | None = None
    rebooted: bool = False
    code: int | None = None
    """Exit code from the log of the launcher; None if unknown."""
    disk_failed: bool = False
    at: float = 0.0
    """Unix time at which the run has last written something, s; 0 if unknown."""


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
"""Events that occur only once for a run. If handling such an event fails, it is stored and handled again later."""

# Actions --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Journal:
    """Action: append a Status line to the journal, and publish it. The action ``Journal`` is used only while no worker
    writes the journal.
    """

    state: State
    cause: Cause | None = None
    message: str = ""


@dataclass(frozen=True)
class WriteOutcome:
    """Action: write outcome.json."""

    outcome: Outcome


@dataclass(frozen=True)
class Launch:
    """Action: start the worker."""


@dataclass(frozen=True)
class Adopt:
    """Action: supervise a worker that an earlier server has started."""


@dataclass(frozen=True)
class Stop:
    """Action: ask the worker to stop at its next step, and kill the worker if it does not stop. ``why``: the reason,
    which is stored in the run's folder.
    """

    why: Cause


@dataclass(frozen=True)
class Kill:
    """Action: kill the worker's processes now."""


Action = Journal | WriteOutcome | Launch | Adopt | Stop | Kill
