"""States of a run, their order, and the causes of its end."""

from enum import StrEnum


class State(StrEnum):
    """Where a run is. The later members are final."""

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
        """True when nothing can happen to the run any more."""
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
"""Which states may follow a state; a final one has none. A job of a batch system that is interrupted waits again."""


class Cause(StrEnum):
    """Why a run ended as it did: a closed list."""

    INPUT = "input"
    MESH = "mesh"
    DIVERGED = "diverged"
    ENERGY = "energy"
    MEMORY = "memory"
    WALLTIME = "walltime"
    STEPS = "steps"
    """``run.max_steps`` is used up before ``run.end_time``."""
    PREEMPTED = "preempted"
    NODE = "node"
    LAUNCH = "launch"
    STORAGE = "storage"
    CANCELLED = "cancelled"
    SERVICE = "service"


class ExitCode:
    """Exit codes of ``python -m conoid.worker``; the outcome file decides, the code is a hint."""

    SUCCEEDED = 0
    CRASHED = 1
    BAD_INPUT = 2
    PHYSICS = 3
    INTERRUPTED = 4
    STORAGE = 5
    """A file could not be written: the disk is full, or fails."""
