"""The queue of the supervisor: what each run needs, what each owner has used, and which runs start now."""

import math
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import msgspec

from conoid.cases.figures import number
from conoid.cases.run import State

from ..runs import folder
from ..runs.events import Run
from ..runs.folder import Submission
from ..settings import Settings
from . import scheduling
from .scheduling import Busy, Need, Room
from .usage import Took, Usage

_REST = 1.0
"""Largest time in s between two selections of the runs to start (chosen value). The selection is repeated because past
usage decreases with time, and because failed starts are tried again."""


@dataclass(frozen=True)
class Held:
    """Reasons outside of the queue for which a run waits."""

    now: Callable[[str], bool]
    """Function that returns whether the start of a run was put off to a later time."""
    sweep: Callable[[Need, Iterable[Need]], str]
    """Function that returns why a run waits for other runs of its sweep; empty if it does not wait. The second argument
    of the function is the list of runs that have cores."""


class Waitlist:
    """The queue of the supervisor. The class is used in the supervisor's thread; the methods ``why`` and ``used`` may
    be called from any thread.
    """

    def __init__(self, settings: Settings, queues: bool) -> None:
        """Creates an empty queue. ``queues``: whether the launcher is a batch system, which has a queue of its own and
        also allocates memory.
        """
        self._settings, self._queues = settings, queues
        self._rules, self._quota = settings.site.queue, settings.site.quota
        self.usage = Usage(self._rules.forgets)
        self._needs: dict[str, Need] = {}
        self._why: dict[str, str] = {}
        self._due = 0.0

    def changed(self) -> None:
        """Requests that the next call of ``turn`` selects runs."""
        self._due = 0.0

    def settled(self, before: Run | None, after: Run) -> None:
        """Records a change of a run; when the run releases its cores, adds its usage."""
        self._due = 0.0
        if before is not None and before.started and (after.state.final or not after.started):
            self.usage.add(Took(before.owner, before.cores, before.started, after.finished or time.time()))
        if after.state.final:
            self._needs.pop(after.id, None)
            self._why.pop(after.id, None)

    def why(self, run_id: str) -> str:
        """Returns why a run was not started at the last selection; empty for a run that does not wait."""
        return self._why.get(run_id, "")

    def used(self, owner: str, runs: Iterable[Run]) -> float:
        """Returns the core-seconds of an owner, reduced by their age, including those of the running runs in
        ``runs``.
        """
        now = time.time()
        own = (run.cores * (now - run.started) for run in runs if run.owner == owner and run.started)
        return self.usage.of(owner, now) + sum(own)

    def turn(self, runs: Sequence[Run], active: Iterable[str], held: Held) -> list[str]:
        """Returns the runs that start now, in order. ``runs``: all open runs; ``active``: runs that have cores or were
        submitted to a batch system.
        """
        if time.monotonic() < self._due:
            return []
        self._due = time.monotonic() + _REST
        has, now = set(active), time.time()
        queued = [run for run in runs if run.state is State.QUEUED and run.id not in has]
        working = [(run, self._need(run)) for run in runs if run.id in has]
        taken = self._taken(working, now)
        queue = scheduling.ordered([self._need(run) for run in queued], taken, self._rules.users)
        blocked = self._blocks(working, held)
        made = scheduling.plan(queue, [_busy(*one) for one in working], self._room(), now, blocked)
        self._why = made.why
        return made.start

    def _room(self) -> Room:
        memory = self._rules.memory or (None if self._queues else self._settings.caps.memory)
        return Room(self._settings.slots) if memory is None else Room(self._settings.slots, float(memory))

    def _taken(self, working: Iterable[tuple[Run, Need]], now: float) -> dict[str, float]:
        """Returns the core-seconds of each owner. A running run counts with its estimate, or with the core-seconds used
        so far if they are more.
        """
        taken = defaultdict(float, self.usage.all(now))
        for run, need in working:
            taken[run.owner] += run.cores * max(need.seconds, now - run.started if run.started else 0.0, 1.0)
        return taken

    def _blocks(self, working: Sequence[tuple[Run, Need]], held: Held) -> Callable[[Need, Sequence[Need]], str]:
        quota, has = self._quota, [need for _, need in working]
        running = Counter(need.owner for need in has)

        def blocked(need: Need, starts: Sequence[Need]) -> str:
            if held.now(need.run):
                return "tried again soon"
            own = running[need.owner] + sum(one.owner == need.owner for one in starts)
            if quota.running is not None and own >= quota.running:
                return f"{own} of your runs are running; this server allows {quota.running} at a time"
            used = self.usage.of(need.owner, time.time()) if quota.core_seconds is not None else 0.0
            if quota.core_seconds is not None and used >= quota.core_seconds:
                most = number(quota.core_seconds)
                return f"you have used {number(used)} core-seconds lately; this server allows {most}"
            return held.sweep(need, [*has, *starts]) if need.sweep else ""

        return blocked

    def _need(self, run: Run) -> Need:
        """Returns what a run needs, from the submission in its folder, which is read once. If the folder is damaged,
        only the number of cores is known.
        """
        if run.id not in self._needs:
            try:
                made = folder.submission(self._settings.runs / run.id)
            except (OSError, msgspec.MsgspecError):
                return Need(run.id, run.owner, run.cores)
            self._needs[run.id] = need_of(made, self._settings.grace, self._room().memory)
        return self._needs[run.id]


def need_of(made: Submission, grace: float, room: float = math.inf) -> Need:
    """Returns the cores, memory and time that a submission needs.

    ``grace``: time in s between the time limit of the run and the forced end. If parts can break, the memory is that of
    all their tets as separate fragments, unless this exceeds ``room``, bytes.
    """
    seconds = made.estimate.get("seconds", made.estimate.get("core_seconds", 0.0) / made.cores)
    limit = math.inf if made.wall_time is None else made.wall_time + 2.0 * grace
    whole = float(made.estimate.get("memory_bytes", 0.0))
    memory = max(whole, min(whole + made.estimate.get("dust_bytes", 0.0), room))
    return Need(
        made.id, made.owner, made.cores, memory, seconds, limit, made.priority, made.labels.get("sweep", "")
    )  # fmt: skip


def _busy(run: Run, need: Need) -> Busy:
    """Returns the cores and memory of a running run, and its expected end."""
    return Busy(run.cores, need.memory, run.started + need.seconds if run.started and need.seconds else 0.0)
