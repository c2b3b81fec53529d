"""A run as the server knows it, what may happen to it, and what is done about it. No more than their shapes."""

from dataclasses import dataclass
from typing import Literal

from conoid.cases.outcome import Outcome
from conoid.cases.run import Cause, State


@dataclass(frozen=True)
class Run:
    """What the server knows of a run. Times are Unix s, 0 when they have not come yet."""

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
    """Why a stop was asked for."""
    threads: int = 1
    """Of each rank."""
    title: str = ""
    """Of the case."""

    @property
    def cores(self) -> int:
        """That it takes while it runs."""
        return self.ranks * self.threads


# Events ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Admitted:
    """The run is on disk and may wait for its turn."""


@dataclass(frozen=True)
class Granted:
    """Enough slots are free. ``batch``: it goes on waiting, in the queue of a batch system."""

    batch: bool = False


@dataclass(frozen=True)
class WorkerStarts:
    """A batch system has given the worker its cores, at the Unix time ``at``."""

    at: float


@dataclass(frozen=True)
class WorkerWaits:
    """A batch system has taken the cores away; the worker goes on from its checkpoint when it gets some again."""


@dataclass(frozen=True)
class LaunchFailed:
    """The worker could not be started."""

    message: str
    cause: Cause = Cause.LAUNCH


@dataclass(frozen=True)
class LaunchPutOff:
    """The worker could not be started now: a full disk, no descriptor left. The run waits for its turn again."""

    message: str


@dataclass(frozen=True)
class Broken:
    """The run's folder is gone (``writable`` is False then), or does not tell any more what is to be run."""

    message: str
    writable: bool = False


@dataclass(frozen=True)
class WorkerRuns:
    """The worker says that it runs."""


@dataclass(frozen=True)
class CancelAsked:
    """Its owner wants it to stop. ``handed``: a worker lives, or a batch system has the run."""

    handed: bool = False


@dataclass(frozen=True)
class WallTimeOver:
    """It has run as long as it may."""


@dataclass(frozen=True)
class OutputOver:
    """Its folder is larger than one may be."""


@dataclass(frozen=True)
class GraceOver:
    """It was asked to stop and did not."""


@dataclass(frozen=True)
class WorkerExited:
    """The worker has ended. ``code`` is None when nobody could collect it; negative: minus the signal."""

    code: int | None
    outcome: Outcome | None
    out_of_memory: bool = False
    disk_failed: bool = False
    """Its disk is full, or it complained of it."""
    traces: str = ""
    """What it left for people in place of an outcome."""
    reading: tuple[State, Cause, str] | None = None
    """What a batch system says of an end without an outcome."""
    at: float = 0.0
    """When that was by its files, Unix s; 0 where nobody knows better than that it is now."""


@dataclass(frozen=True)
class Found:
    """What a starting server sees of a run that an earlier one left open."""

    worker: Literal["none", "alive", "gone"]
    outcome: Outcome | None = None
    rebooted: bool = False
    code: int | None = None
    """What its launcher says of its end, where it could."""
    disk_failed: bool = False
    at: float = 0.0
    """When it was last heard of by its files, Unix s; 0 where they do not tell."""


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
"""Events that nobody would say again."""

# Actions --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Journal:
    """Append a Status line to the journal and publish it. Only while no worker writes."""

    state: State
    cause: Cause | None = None
    message: str = ""


@dataclass(frozen=True)
class WriteOutcome:
    """Write outcome.json."""

    outcome: Outcome


@dataclass(frozen=True)
class Launch:
    """Start the worker."""


@dataclass(frozen=True)
class Adopt:
    """Watch a worker that an earlier server started."""


@dataclass(frozen=True)
class Stop:
    """Ask the worker to stop at its next step; kill it when it does not. The run's folder remembers ``why``."""

    why: Cause


@dataclass(frozen=True)
class Kill:
    """End the worker's processes now."""


Action = Journal | WriteOutcome | Launch | Adopt | Stop | Kill
