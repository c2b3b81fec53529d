"""The state machine of a run alone, without a clock, a file or a process."""

from dataclasses import replace
from itertools import product

import pytest

from conoid.cases.outcome import Outcome
from conoid.cases.run import FOLLOWERS, Cause, ExitCode, State
from conoid.server.runs.events import (
    Admitted,
    Adopt,
    CancelAsked,
    Event,
    Found,
    GraceOver,
    Granted,
    Journal,
    Kill,
    Launch,
    LaunchFailed,
    Run,
    Stop,
    WallTimeOver,
    WorkerExited,
    WorkerRuns,
    WorkerStarts,
    WorkerWaits,
    WriteOutcome,
)
from conoid.server.runs.lifecycle import advance

RUN = Run("a", "ann", "bar", 2, submitted=1.0)
DONE = Outcome(state="succeeded", steps=7)
STOPPED = Outcome(state="cancelled", cause="cancelled")
EVENTS: list[Event] = [
    Admitted(),
    Granted(),
    Granted(batch=True),
    LaunchFailed("no mpiexec"),
    WorkerStarts(4.0),
    WorkerWaits(),
    WorkerRuns(),
    CancelAsked(),
    CancelAsked(handed=True),
    WallTimeOver(),
    GraceOver(),
    WorkerExited(0, DONE),
    WorkerExited(4, STOPPED),
    WorkerExited(1, None),
    WorkerExited(None, None, reading=(State.TIMED_OUT, Cause.WALLTIME, "job 7 has reached its time limit")),
    WorkerExited(0, Outcome(state="running")),
    Found("none"),
    Found("alive"),
    Found("gone"),
    Found("gone", DONE),
    Found("gone", rebooted=True),
]


@pytest.mark.parametrize(("state", "event"), list(product(State, EVENTS)), ids=str)
def test_every_step_obeys_the_order_of_states(state: State, event: Event) -> None:
    for why in (None, Cause.CANCELLED, Cause.WALLTIME):
        before = replace(RUN, state=state, stopping_for=why)
        after, actions = advance(before, event, 5.0)
        assert after.state is state or after.state in FOLLOWERS[state]
        if state.final:
            assert (after, actions) == (before, ())
        if after.state.final and not state.final:
            assert after.finished == 5.0
            assert isinstance(actions[-1], Journal)
            assert actions[-1].state is after.state
        if after.state is State.STOPPING:
            assert not any(isinstance(action, Journal) for action in actions), "the worker writes the journal now"


def test_the_straight_way() -> None:
    run, actions = advance(RUN, Admitted(), 1.0)
    assert actions == (Journal(State.QUEUED),)
    run, actions = advance(run, Granted(), 2.0)
    assert actions == (Journal(State.STARTING), Launch())
    assert run.started == 2.0
    run, actions = advance(run, WorkerRuns(), 3.0)
    assert (run.state, actions) == (State.RUNNING, ())
    run, actions = advance(run, WorkerExited(0, DONE), 4.0)
    assert (run.state, run.cause, run.finished) == (State.SUCCEEDED, None, 4.0)
    assert actions == (Journal(State.SUCCEEDED),)


def test_the_way_through_a_batch_system() -> None:
    """The Slurm job writes the journal itself. The wall time counts from the start of the Slurm job, and a Slurm job
    may wait several times.
    """
    run, actions = advance(replace(RUN, state=State.QUEUED), Granted(batch=True), 2.0)
    assert (run.state, run.started, actions) == (State.QUEUED, 0.0, (Launch(),))
    run, actions = advance(run, WorkerStarts(50.0), 51.0)
    assert (run.state, run.started, actions) == (State.STARTING, 50.0, ())
    run, actions = advance(run, WorkerRuns(), 52.0)
    assert (run.state, run.started, actions) == (State.RUNNING, 50.0, ())
    run, actions = advance(run, WorkerWaits(), 60.0)
    assert (run.state, run.started, actions) == (State.QUEUED, 0.0, ())
    run, actions = advance(run, CancelAsked(handed=True), 70.0)
    assert (run.state, actions) == (State.STOPPING, (Stop(Cause.CANCELLED),))
    run, actions = advance(run, WorkerExited(None, None), 71.0)
    assert (run.state, run.cause) == (State.CANCELLED, Cause.CANCELLED)


@pytest.mark.parametrize("before", [State.QUEUED, State.STARTING, State.RUNNING])
def test_a_batch_system_gives_a_state_that_the_folder_lacks(before: State) -> None:
    reading = (State.TIMED_OUT, Cause.WALLTIME, "job 7 has reached its time limit")
    run, _ = advance(replace(RUN, state=before), WorkerExited(15, None, reading=reading), 5.0)
    assert (run.state, run.cause, run.message) == reading
    run, _ = advance(replace(RUN, state=before), WorkerExited(15, DONE, reading=reading), 5.0)
    assert run.state is State.SUCCEEDED


def test_cancel_before_the_start_needs_no_worker() -> None:
    run, actions = advance(replace(RUN, state=State.QUEUED), CancelAsked(), 2.0)
    assert (run.state, run.cause) == (State.CANCELLED, Cause.CANCELLED)
    assert isinstance(actions[0], WriteOutcome)
    assert isinstance(actions[1], Journal)


def test_cancel_stops_once_then_kills() -> None:
    run, actions = advance(replace(RUN, state=State.RUNNING), CancelAsked(), 2.0)
    assert (run.state, actions) == (State.STOPPING, (Stop(Cause.CANCELLED),))
    assert advance(run, CancelAsked(), 3.0) == (run, ())
    assert advance(run, GraceOver(), 4.0) == (run, (Kill(),))
    run, actions = advance(run, WorkerExited(-9, None), 5.0)
    assert run.state is State.CANCELLED
    assert isinstance(actions[0], WriteOutcome)


@pytest.mark.parametrize("ended", [WorkerExited(ExitCode.STORAGE, None), WorkerExited(-9, None, disk_failed=True)])
def test_a_run_ended_by_a_full_disk_is_not_cancelled(ended: WorkerExited) -> None:
    run = replace(RUN, state=State.STOPPING, stopping_for=Cause.CANCELLED)
    after, _ = advance(run, ended, 5.0)
    assert (after.state, after.cause) == (State.FAILED, Cause.STORAGE)


def test_a_run_that_ends_well_while_it_is_stopped_has_succeeded() -> None:
    run = replace(RUN, state=State.STOPPING, stopping_for=Cause.CANCELLED)
    assert advance(run, WorkerExited(0, DONE), 5.0)[0].state is State.SUCCEEDED


@pytest.mark.parametrize("outcome", [STOPPED, None])
def test_wall_time(outcome: Outcome | None) -> None:
    run, actions = advance(replace(RUN, state=State.RUNNING), WallTimeOver(), 2.0)
    assert (run.state, actions) == (State.STOPPING, (Stop(Cause.WALLTIME),))
    run, actions = advance(run, WorkerExited(4, outcome), 5.0)
    assert (run.state, run.cause) == (State.TIMED_OUT, Cause.WALLTIME)
    assert isinstance(actions[0], WriteOutcome)
    assert (actions[0].outcome.state, actions[0].outcome.cause) == ("timed_out", "walltime")
    assert actions[0].outcome.message == "the run has reached its limit of wall time"


@pytest.mark.parametrize(
    ("code", "starved", "before", "state", "cause"),
    [
        (0, False, State.RUNNING, State.FAILED, Cause.SERVICE),
        (1, False, State.STARTING, State.FAILED, Cause.LAUNCH),
        (1, False, State.RUNNING, State.FAILED, Cause.SERVICE),
        (2, False, State.STARTING, State.FAILED, Cause.INPUT),
        (3, False, State.RUNNING, State.FAILED, Cause.DIVERGED),
        (9, True, State.RUNNING, State.FAILED, Cause.MEMORY),
        (137, True, State.RUNNING, State.FAILED, Cause.MEMORY),
        (-9, False, State.RUNNING, State.LOST, Cause.NODE),
        (None, False, State.RUNNING, State.LOST, Cause.SERVICE),
        (None, False, State.STARTING, State.LOST, Cause.SERVICE),
    ],
)
def test_an_end_without_outcome_is_never_a_success(
    code: int | None, starved: bool, before: State, state: State, cause: Cause
) -> None:
    run, actions = advance(replace(RUN, state=before), WorkerExited(code, None, starved, traces="its last words"), 5.0)
    assert (run.state, run.cause) == (state, cause)
    assert "its last words" in run.message
    assert isinstance(actions[0], WriteOutcome)
    assert actions[0].outcome.state == state


@pytest.mark.parametrize(
    ("before", "event", "state", "cause", "first"),
    [
        (State.ACCEPTED, Found("none"), State.QUEUED, None, Journal(State.QUEUED)),
        (State.QUEUED, Found("none"), State.QUEUED, None, None),
        (State.QUEUED, Found("alive"), State.QUEUED, None, Adopt()),
        (State.STARTING, Found("none"), State.QUEUED, None, Journal),
        (State.STARTING, Found("alive"), State.STARTING, None, Adopt()),
        (State.RUNNING, Found("alive"), State.RUNNING, None, Adopt()),
        (State.RUNNING, Found("alive", DONE), State.RUNNING, None, Adopt()),
        (State.STOPPING, Found("alive"), State.STOPPING, None, Adopt()),
        (State.RUNNING, Found("gone", DONE), State.SUCCEEDED, None, Journal(State.SUCCEEDED)),
        (State.RUNNING, Found("gone"), State.LOST, Cause.SERVICE, WriteOutcome),
        (State.STARTING, Found("gone"), State.LOST, Cause.SERVICE, WriteOutcome),
        (State.RUNNING, Found("gone", rebooted=True), State.LOST, Cause.NODE, WriteOutcome),
    ],
)
def test_a_run_of_an_earlier_server_gets_its_state(
    before: State, event: Found, state: State, cause: Cause | None, first: object
) -> None:
    run, actions = advance(replace(RUN, state=before), event, 5.0)
    assert (run.state, run.cause) == (state, cause)
    if first is None:
        assert actions == ()
    elif isinstance(first, type):
        assert isinstance(actions[0], first)
    else:
        assert actions[0] == first
