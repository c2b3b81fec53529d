"""State of a run, computed from the messages read so far, without input or output."""

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from conoid.cases.messages import AnyMessage, Counts, Finished, Frame, Load, Log, Progress, Snapshot, Started, Status
from conoid.cases.run import Cause, ExitCode, State

DESCHEDULED = "descheduled"
"""Name of the wall time in which a rank used no CPU time: the operating system did not schedule it, or it slept."""
PHASE_GROUPS = ("compute", "contact", "exchange", "output", "wait", DESCHEDULED)
_IDLE = "exchange", "wait", DESCHEDULED
_LOG_TAIL = 200
"""Number of log messages that are kept for display (chosen value: they fill several screens)."""


@dataclass
class Live:
    """The newest message of each kind, and the last messages of the log. ``seq``: number of the last message."""

    run: str
    title: str = ""
    link: str = ""
    """Transport of the messages: Zenoh or SSE."""
    state: State = State.ACCEPTED
    cause: str | None = None
    message: str = ""
    reason: str = ""
    """Reason why the run waited at the last request to the server."""
    away: float = 0.0
    """Unix time, s, at which the server stopped answering; 0 while the server answers."""
    seq: int = 0
    wall: float = 0.0
    """Unix time of the last message, s."""
    changed: float = 0.0
    """Unix time of the last change of state, s."""
    began: float | None = None
    """Unix time at which the worker began to run, s."""
    started: Started | None = None
    progress: Progress | None = None
    load: Load | None = None
    phases: dict[str, list[float]] = field(default_factory=dict)
    """Seconds that each rank spent in each of PHASE_GROUPS between the last two Load messages."""
    helped: list[float] = field(default_factory=list)
    """Fraction of the time between the last two Load messages in which the further threads of each rank were busy;
    empty if ranks have one thread."""
    loaded: float = 0.0
    """Unix time of the last Load message, s; before the first Load message, the time of the message Started."""
    counts: Counts | None = None
    finished: Finished | None = None
    frames: int = 0
    snapshot: Snapshot | None = None
    """The newest snapshot of the fragments."""
    log: deque[Log] = field(default_factory=lambda: deque(maxlen=_LOG_TAIL))

    def take(self, message: AnyMessage) -> None:
        """Updates the state with a message."""
        self.seq, self.wall, self.away = message.seq, message.wall, 0.0
        match message:
            case Status():
                self._status(message)
            case Started():
                self.started, self.loaded = message, message.wall
            case Progress():
                self.progress = message
            case Load():
                self._load(message)
            case Counts():
                self.counts = message
            case Frame():
                self.frames += 1
            case Snapshot():
                self.snapshot = message
            case Log():
                self.log.append(message)
            case Finished():
                self.finished = message

    def _status(self, message: Status) -> None:
        if message.state != self.state or not self.changed:
            self.changed = message.wall
        self.state, self.cause, self.message = State(message.state), message.cause, message.message
        if self.state is State.RUNNING and self.began is None:
            self.began = message.wall

    def _load(self, message: Load) -> None:
        interval = message.wall - self.loaded if self.loaded else 0.0
        self.load, self.loaded = message, message.wall
        self.phases = grouped(message.phases, interval, message.waiting)
        others = (message.threads - 1) * interval
        self.helped = [seconds / others for seconds in message.helped] if others > 0.0 else []

    @property
    def explanation(self) -> str:
        """Message of the state of the run; for a queued run, the reason why it waits."""
        return self.message or (self.reason if self.state is State.QUEUED else "")

    @property
    def fraction(self) -> float:
        """Completed fraction of the simulated time, 0 to 1."""
        if self.state is State.SUCCEEDED:
            return 1.0
        if self.progress is None or self.progress.end_time <= 0:
            return 0.0
        return min(1.0, max(0.0, self.progress.t / self.progress.end_time))

    @property
    def elapsed(self) -> float:
        """Wall time since the worker began, s: until now while the worker runs, until the last message after its
        end.
        """
        if self.began is None:
            return 0.0
        return max(0.0, (self.wall if self.state.final else time.time()) - self.began)

    @property
    def busy(self) -> list[float]:
        """Fraction of the time between the last two Load messages in which each rank computed. Message exchange,
        waiting and descheduled time are not included.
        """
        totals = [sum(seconds) for seconds in zip(*self.phases.values(), strict=True)]
        idle = [sum(self.phases[name][rank] for name in _IDLE if name in self.phases) for rank in range(len(totals))]
        return [1.0 - lost / total if total > 0 else 0.0 for lost, total in zip(idle, totals, strict=True)]


def grouped(
    phases: dict[str, list[float]], interval: float = 0.0, waiting: Sequence[float] = ()
) -> dict[str, list[float]]:
    """Sums the phases of the worker into PHASE_GROUPS, in the same way as the page: ``elements``, ``nodes`` and others
    are compute. ``waiting``: part of the exchange in which a rank waits for other ranks. In the rest of the
    ``interval`` between two Load messages, s, the rank had no core or slept.
    """
    sums: dict[str, list[float]] = {}
    for name, seconds in phases.items():
        group = name if name in PHASE_GROUPS else "compute"
        before = sums.get(group, [0.0] * len(seconds))
        sums[group] = [a + b for a, b in zip(before, seconds, strict=True)]
    if waiting and "exchange" in sums:
        sums["wait"] = [min(pair) for pair in zip(waiting, sums["exchange"], strict=True)]
        sums["exchange"] = [a - b for a, b in zip(sums["exchange"], sums["wait"], strict=True)]
    if sums and interval > 0:
        sums[DESCHEDULED] = [max(0.0, interval - sum(spent)) for spent in zip(*sums.values(), strict=True)]
    return {group: sums[group] for group in PHASE_GROUPS if group in sums}


def exit_code(state: State, cause: str | None) -> int:
    """Returns the exit code of ``watch`` and ``run``: 0 succeeded, 2 bad input, 4 cancelled, 1 anything else."""
    if state is State.SUCCEEDED:
        return ExitCode.SUCCEEDED
    if state is State.CANCELLED:
        return ExitCode.INTERRUPTED
    if cause in {Cause.INPUT, Cause.MESH}:
        return ExitCode.BAD_INPUT
    return ExitCode.CRASHED
