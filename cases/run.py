"""States of a run, their order, and the causes of its end."""

from enum import StrEnum


class State(StrEnum):
    """State of a run. The later members are final."""

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
        """Whether the state cannot change any more."""
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
"""The states that may follow each state; none for a final one. An interrupted job of a batch system waits again."""


class Cause(StrEnum):
    """Cause of the end of a run: a closed list."""

    INPUT = "input"
    MESH = "mesh"
    DIVERGED = "diverged"
    ENERGY = "energy"
    MEMORY = "memory"
    WALLTIME = "walltime"
    STEPS = "steps"
    """``run.max_steps`` was reached before ``run.end_time``."""
    PREEMPTED = "preempted"
    NODE = "node"
    LAUNCH = "launch"
    STORAGE = "storage"
    CANCELLED = "cancelled"
    SERVICE = "service"


class ExitCode:
    """Exit codes of ``python -m conoid.worker``. The outcome file is decisive; the exit code is only additional
    information."""

    SUCCEEDED = 0
    CRASHED = 1
    BAD_INPUT = 2
    PHYSICS = 3
    INTERRUPTED = 4
    STORAGE = 5
    """A file could not be written: the disk is full or defective."""
