"""The life of a run as a pure function: (run, event) -> (run, actions). No clock, no file, no process in here."""

from dataclasses import dataclass, replace
from typing import Literal

import msgspec

from conoid.cases.outcome import Outcome
from conoid.cases.run import Cause, ExitCode, State


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
class GraceOver:
    """It was asked to stop and did not."""


@dataclass(frozen=True)
class WorkerExited:
    """The worker has ended. ``code`` is None when nobody could collect it; negative: minus the signal."""

    code: int | None
    outcome: Outcome | None
    out_of_memory: bool = False
    traces: str = ""
    """What it left for people in place of an outcome."""
    reading: tuple[State, Cause, str] | None = None
    """What a batch system says of an end without an outcome."""


@dataclass(frozen=True)
class Found:
    """What a starting server sees of a run that an earlier one left open."""

    worker: Literal["none", "alive", "gone"]
    outcome: Outcome | None = None
    rebooted: bool = False


Event = (
    Admitted | Granted | LaunchFailed | WorkerStarts | WorkerWaits | WorkerRuns | CancelAsked | WallTimeOver | GraceOver
    | WorkerExited | Found
)  # fmt: skip

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
    """Ask the worker to stop at its next step; kill it when it does not."""


@dataclass(frozen=True)
class Kill:
    """End the worker's processes now."""


Action = Journal | WriteOutcome | Launch | Adopt | Stop | Kill
Next = tuple[Run, tuple[Action, ...]]

_SIGKILL = 9
"""Its number on every POSIX system; the state machine imports nothing of the system."""


def advance(run: Run, event: Event, now: float) -> Next:
    """The run after ``event`` at the Unix time ``now``, and what must be done, in order.

    An event that does not matter any more (a cancel of a finished run, a late timer) changes nothing. Every change of
    state obeys ``FOLLOWERS`` of conoid.cases.run.
    """
    if run.state.final:
        return run, ()
    match event:
        case Admitted() if run.state is State.ACCEPTED:
            return _enter(run, State.QUEUED)
        case Granted(batch=True) if run.state is State.QUEUED:
            return run, (Launch(),)
        case Granted() if run.state is State.QUEUED:
            started, actions = _enter(replace(run, started=now), State.STARTING)
            return started, (*actions, Launch())
        case LaunchFailed(message) if run.state in {State.QUEUED, State.STARTING}:
            return _end(run, now, Outcome(state=State.FAILED, cause=Cause.LAUNCH, message=message, ranks=run.ranks))
        case WorkerStarts(at) if run.state is State.QUEUED:
            return replace(run, state=State.STARTING, started=at, message=""), ()
        case WorkerWaits() if run.state in {State.STARTING, State.RUNNING}:
            return replace(run, state=State.QUEUED, started=0.0), ()
        case WorkerRuns() if run.state in {State.QUEUED, State.STARTING}:
            return replace(run, state=State.RUNNING, started=run.started or now), ()
        case CancelAsked(handed):
            return _cancel(run, now, handed)
        case WallTimeOver() if run.state in {State.STARTING, State.RUNNING}:
            return _stop(run, Cause.WALLTIME)
        case GraceOver() if run.state is State.STOPPING:
            return run, (Kill(),)
        case WorkerExited() if run.state is not State.ACCEPTED:
            return _exited(run, event, now)
        case Found():
            return _found(run, event, now)
        case _:
            return run, ()


def _enter(run: Run, state: State, message: str = "") -> Next:
    return replace(run, state=state, message=message), (Journal(state, message=message),)


def _end(run: Run, now: float, outcome: Outcome, *, written: bool = False) -> Next:
    """The final state that ``outcome`` gives; the file comes before the line that tells of it."""
    state, cause = State(outcome.state), Cause(outcome.cause) if outcome.cause else None
    ended = replace(run, state=state, cause=cause, message=outcome.message, finished=now)
    write = () if written else (WriteOutcome(outcome),)
    return ended, (*write, Journal(state, cause, outcome.message))


def _cancel(run: Run, now: float, handed: bool) -> Next:
    if run.state is State.ACCEPTED or (run.state is State.QUEUED and not handed):
        message = "cancelled before it started"
        return _end(run, now, Outcome(state=State.CANCELLED, cause=Cause.CANCELLED, message=message, ranks=run.ranks))
    return (run, ()) if run.state is State.STOPPING else _stop(run, Cause.CANCELLED)


def _stop(run: Run, why: Cause) -> Next:
    """No Journal: the worker is the journal's writer now."""
    return replace(run, state=State.STOPPING, stopping_for=why), (Stop(),)


def _exited(run: Run, event: WorkerExited, now: float) -> Next:
    told = event.outcome if event.outcome is not None and _readable(event.outcome) else None
    outcome = told or _without_outcome(run, event)
    if run.stopping_for is Cause.WALLTIME and outcome.state == State.CANCELLED:
        message = "its wall time is used up"
        outcome = msgspec.structs.replace(outcome, state=State.TIMED_OUT, cause=Cause.WALLTIME, message=message)
    return _end(run, now, outcome, written=outcome is event.outcome)


def _readable(outcome: Outcome) -> bool:
    """True when the outcome tells a final state and a cause of the closed list."""
    return outcome.state in {state for state in State if state.final} and outcome.cause in {None, *Cause}


def _without_outcome(run: Run, event: WorkerExited) -> Outcome:
    """The end of a worker that could not write its own: the exit code is a hint, never a proof of success."""
    state, cause, message = _reading_of(run, event)
    said = f"; {event.traces}" if event.traces else ""
    return Outcome(state=state, cause=cause, message=f"{message}{said}", ranks=run.ranks)


def _reading_of(run: Run, event: WorkerExited) -> tuple[State, Cause, str]:
    killed = event.code in {-_SIGKILL, _SIGKILL, 128 + _SIGKILL}
    if run.stopping_for is not None:
        return State.CANCELLED, Cause.CANCELLED, "stopped on request, without results"
    if event.reading is not None:
        return event.reading
    if killed and event.out_of_memory:
        return State.FAILED, Cause.MEMORY, "the machine ran out of memory and ended the worker"
    if killed:
        return State.LOST, Cause.NODE, "the worker was killed from outside"
    if event.code == ExitCode.BAD_INPUT:
        return State.FAILED, Cause.INPUT, "the worker refused the case"
    if event.code == ExitCode.PHYSICS:
        return State.FAILED, Cause.DIVERGED, "the computation failed"
    if run.state in {State.QUEUED, State.STARTING}:
        return State.FAILED, Cause.LAUNCH, f"the worker ended with code {event.code} before its first step"
    return State.FAILED, Cause.SERVICE, f"the worker ended with code {event.code} and left no readable outcome"


def _found(run: Run, event: Found, now: float) -> Next:
    if run.state is State.ACCEPTED:
        return _enter(run, State.QUEUED)
    if event.worker == "alive":
        return run, (Adopt(),)
    if run.state is State.QUEUED:
        return run, ()
    if event.outcome is not None and _readable(event.outcome):
        return _exited(run, WorkerExited(None, event.outcome), now)
    if event.worker == "none" and run.state is State.STARTING:
        return _enter(replace(run, started=0.0), State.QUEUED, "the server was restarted before the launch")
    if run.stopping_for is not None:
        return _exited(run, WorkerExited(None, None), now)
    if event.rebooted:
        lost = Outcome(state=State.LOST, cause=Cause.NODE, message="the machine was restarted", ranks=run.ranks)
    else:
        message = "the worker ended without an outcome while no server was there to see it"
        lost = Outcome(state=State.LOST, cause=Cause.SERVICE, message=message, ranks=run.ranks)
    return _end(run, now, lost)
