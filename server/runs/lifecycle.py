"""The state machine of a run as a function without side effects: (run, event) -> (run, actions). The state machine uses
no clock, no file and no process.
"""

from dataclasses import replace

import msgspec

from conoid.cases.figures import size
from conoid.cases.outcome import Outcome
from conoid.cases.run import Cause, ExitCode, State

from .events import (
    Action,
    Admitted,
    Adopt,
    Broken,
    CancelAsked,
    Event,
    Found,
    GraceOver,
    Granted,
    Journal,
    Kill,
    Launch,
    LaunchFailed,
    LaunchPutOff,
    OutputOver,
    Run,
    Stop,
    WallTimeOver,
    WorkerExited,
    WorkerRuns,
    WorkerStarts,
    WorkerWaits,
    WriteOutcome,
)

Next = tuple[Run, tuple[Action, ...]]

_SIGKILL, _SIGTERM = 9, 15
"""Numbers of the signals KILL and TERM, which are the same on every POSIX system; so this module imports no module of
the operating system."""


def advance(run: Run, event: Event, now: float) -> Next:
    """Returns the run after ``event`` at the Unix time ``now``, s, and the actions to perform, in order.

    An event that has no meaning in the present state, such as a cancel of a run that has ended, changes nothing. Every
    change of state obeys ``FOLLOWERS`` of conoid.cases.run.
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
        case LaunchFailed() | LaunchPutOff() if run.state is State.STOPPING:
            return _exited(run, WorkerExited(None, None), now)
        case LaunchFailed(message, cause) if run.state in {State.QUEUED, State.STARTING}:
            return _end(
                run,
                now,
                Outcome(state=State.FAILED, cause=cause, message=message, ranks=run.ranks, threads=run.threads),
            )
        case LaunchPutOff(message) if run.state is State.STARTING:
            return _enter(replace(run, started=0.0), State.QUEUED, message)
        case Broken():
            return _broken(run, event, now)
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
        case OutputOver() if run.state in {State.STARTING, State.RUNNING}:
            return _stop(replace(run, message=_too_large(event)), Cause.STORAGE)
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
    """Ends the run with the state of ``outcome``. The actions write the outcome before the last line of the journal.
    ``written``: whether the worker has already written the outcome.
    """
    state, cause = State(outcome.state), Cause(outcome.cause) if outcome.cause else None
    ended = replace(run, state=state, cause=cause, message=outcome.message, finished=now)
    write = () if written else (WriteOutcome(outcome),)
    return ended, (*write, Journal(state, cause, outcome.message))


def _broken(run: Run, event: Broken, now: float) -> Next:
    """Ends a run whose folder cannot be used as lost, or as cancelled if its owner has requested a cancel. A worker
    that may still run is killed before.
    """
    asked = run.stopping_for is Cause.CANCELLED
    state, cause = (State.CANCELLED, Cause.CANCELLED) if asked else (State.LOST, Cause.STORAGE)
    message = f"stopped on request, without results: {event.message}" if asked else event.message
    outcome = Outcome(state=state, cause=cause, message=message, ranks=run.ranks, threads=run.threads)
    ended, actions = _end(run, now, outcome)
    return ended, (Kill(), *actions) if event.writable else (Kill(),)


def _too_large(event: OutputOver) -> str:
    return (
        f"the files of the run have {size(event.size)}; this server allows {size(event.most)} for a run: reduce "
        "run.frames, run.snapshots or run.fields"
    )


def _cancel(run: Run, now: float, handed: bool) -> Next:
    if run.state is State.ACCEPTED or (run.state is State.QUEUED and not handed):
        message = "cancelled before it started"
        return _end(
            run,
            now,
            Outcome(
                state=State.CANCELLED, cause=Cause.CANCELLED, message=message, ranks=run.ranks, threads=run.threads
            ),
        )
    return (run, ()) if run.state is State.STOPPING else _stop(run, Cause.CANCELLED)


def _stop(run: Run, why: Cause) -> Next:
    """Changes the state without a line in the journal, because at present the worker writes the journal."""
    return replace(run, state=State.STOPPING, stopping_for=why), (Stop(why),)


def _exited(run: Run, event: WorkerExited, now: float) -> Next:
    readable = event.outcome if event.outcome is not None and _readable(event.outcome) else None
    outcome = readable or _without_outcome(run, event)
    cause = event.reading[1] if event.reading is not None and run.stopping_for is None else None
    asked = Cause.CANCELLED in {run.stopping_for, cause}
    if outcome.state == State.CANCELLED and not asked:
        outcome = _renamed(run, event, outcome)
    return _end(run, _at(run, event, now), outcome, written=outcome is event.outcome)


def _at(run: Run, event: WorkerExited | Found, now: float) -> float:
    """Returns the Unix time of the end of the run, s. If no server was running then, it is the time that the files of
    the run give.
    """
    return max(event.at, run.started) if event.at else now


def _renamed(run: Run, event: WorkerExited, outcome: Outcome) -> Outcome:
    """Returns the outcome of a run that was stopped, with the cause of the stop. A worker records that it was stopped,
    but not why. Without a request for a cancel, the stop does not count as a cancel.
    """
    if run.stopping_for is Cause.STORAGE:
        state, message = State.FAILED, run.message or "the files of the run are larger than this server allows"
        return msgspec.structs.replace(outcome, state=state, cause=Cause.STORAGE, message=message)
    if event.reading is not None:
        state, cause, message = event.reading
        return msgspec.structs.replace(outcome, state=state, cause=cause, message=message)
    if run.stopping_for is Cause.WALLTIME:
        state, message = State.TIMED_OUT, "the run has reached its limit of wall time"
        return msgspec.structs.replace(outcome, state=state, cause=Cause.WALLTIME, message=message)
    message = "the worker was asked to stop from outside, not by its owner"
    return msgspec.structs.replace(outcome, state=State.FAILED, cause=Cause.PREEMPTED, message=message)


def _readable(outcome: Outcome) -> bool:
    """Whether the outcome has a final state and a known cause."""
    return outcome.state in {state for state in State if state.final} and outcome.cause in {None, *Cause}


def _without_outcome(run: Run, event: WorkerExited) -> Outcome:
    """Returns the outcome of a run whose worker has written none. The exit code suggests a cause, but never proves
    success.
    """
    state, cause, message = _reading_of(run, event)
    traces = f"; {event.traces}" if event.traces else ""
    return Outcome(state=state, cause=cause, message=f"{message}{traces}", ranks=run.ranks, threads=run.threads)


def _reading_of(run: Run, event: WorkerExited) -> tuple[State, Cause, str]:
    killed = event.code in {-_SIGKILL, _SIGKILL, 128 + _SIGKILL}
    full = State.FAILED, Cause.STORAGE, "the worker could not write its files"
    stored = event.code != ExitCode.STORAGE and not event.disk_failed
    if run.stopping_for is not None:
        return (State.CANCELLED, Cause.CANCELLED, "stopped on request, without results") if stored else full
    if event.reading is not None:
        return event.reading
    if killed and event.out_of_memory:
        return State.FAILED, Cause.MEMORY, "the machine ran out of memory and ended the worker"
    if killed:
        return State.LOST, Cause.NODE, f"the worker was killed from outside, by signal {_SIGKILL}"
    if event.code == ExitCode.BAD_INPUT:
        return State.FAILED, Cause.INPUT, "the worker refused the case"
    if not stored:
        return full
    if event.code in {-_SIGTERM, 128 + _SIGTERM}:
        return State.FAILED, Cause.PREEMPTED, "the worker was ended from outside"
    if event.code == ExitCode.PHYSICS:
        return State.FAILED, Cause.DIVERGED, "the computation failed"
    if event.code is None:
        return State.LOST, Cause.SERVICE, "the worker ended without an outcome, and its exit code is not known"
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
        return _exited(run, WorkerExited(None, event.outcome, at=event.at), now)
    if event.worker == "none" and run.state is State.STARTING:
        return _enter(replace(run, started=0.0), State.QUEUED, "the server was restarted before the launch")
    if run.stopping_for is not None:
        return _exited(run, WorkerExited(None, None, at=event.at), now)
    if event.code is not None or event.disk_failed:
        return _exited(run, WorkerExited(event.code, None, disk_failed=event.disk_failed, at=event.at), now)
    if event.rebooted:
        lost = Outcome(
            state=State.LOST,
            cause=Cause.NODE,
            message="the machine was restarted",
            ranks=run.ranks,
            threads=run.threads,
        )
    else:
        message = "the worker ended without an outcome while no server was running"
        lost = Outcome(state=State.LOST, cause=Cause.SERVICE, message=message, ranks=run.ranks, threads=run.threads)
    return _end(run, _at(run, event, now), lost)
