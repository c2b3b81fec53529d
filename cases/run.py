"""States of a run, the order of the states, and the causes of the end."""

from enum import StrEnum


class State(StrEnum):
    """State of a run. The last members of the enumeration are final states."""

    ACCEPTED = "accepted"
    QUEUED = "queued"
    STARTING = "starting"
    RUNNING = "running"
    STOPPING = "stopping"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    TIMED_OUT = "timed_out"
    LOST = "lost"

    @property
    def final(self) -> bool:
        """Whether the state is final: the state of the run cannot change any more."""
        return self in FINAL


FINAL = frozenset({State.SUCCEEDED, State.FAILED, State.CANCELLED, State.TIMED_OUT, State.LOST})

FOLLOWERS: dict[State, frozenset[State]] = {
    State.ACCEPTED: frozenset({State.QUEUED, State.CANCELLED, State.FAILED, State.LOST}),
    State.QUEUED: frozenset({State.STARTING, State.RUNNING, State.STOPPING, *FINAL}),
    State.STARTING: frozenset({State.QUEUED, State.RUNNING, State.STOPPING, *FINAL}),
    State.RUNNING: frozenset({State.QUEUED, State.STARTING, State.STOPPING, *FINAL}),
    State.STOPPING: FINAL,
    **dict.fromkeys(FINAL, frozenset()),
}
"""States that may follow each state; none follows a final state. The job of a run that was interrupted waits in the
queue of the batch system again."""


class Cause(StrEnum):
    """Cause of the end of a run, from a closed list."""

    INPUT = "input"
    MESH = "mesh"
    DIVERGED = "diverged"
    ENERGY = "energy"
    MEMORY = "memory"
    WALLTIME = "walltime"
    STEPS = "steps"
    """Cause: ``run.max_steps`` was reached before ``run.end_time``."""
    PREEMPTED = "preempted"
    NODE = "node"
    LAUNCH = "launch"
    STORAGE = "storage"
    CANCELLED = "cancelled"
    SERVICE = "service"


class ExitCode:
    """Exit codes of ``python -m conoid.worker``. The exit code is additional information only: the outcome file gives
    the end of the run.
    """

    SUCCEEDED = 0
    CRASHED = 1
    BAD_INPUT = 2
    PHYSICS = 3
    INTERRUPTED = 4
    STORAGE = 5
    """A file could not be written: the disk is full or defective."""
