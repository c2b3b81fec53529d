"""Scheduling: which waiting runs start now, and why each of the other runs waits. This module has only functions
without side effects.

Order of the queue: first by the priority of the user, then by the user's past usage of cores relative to the share of
the user (less usage first), then by the priority of the run, then by time of submission. Free cores and memory are
reserved for the first run of the queue for which they are not enough. A later run may start before this run only if it
does not delay it. The later run causes no delay if its time limit ends before the estimated start of the reserved run,
or if both runs fit together for every order in which the running runs end (Lifka, The ANL/IBM SP scheduling system,
1995: "EASY").
"""

import heapq
import math
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field

from conoid.cases.figures import counted, size
from conoid.cases.run import State
from conoid.cases.site.policy import Share

from ..runs.events import Run

_LEAST = 1.0
"""Smallest number of core-seconds that a run counts in the order of the queue, also if its estimate is missing (chosen
value)."""


@dataclass(frozen=True)
class Need:
    """Cores, memory and time that a waiting run needs."""

    run: str
    owner: str
    cores: int
    memory: float = 0.0
    """Estimated memory of all ranks, bytes; 0: unknown."""
    seconds: float = 0.0
    """Expected duration of the run, s; 0: unknown."""
    limit: float = math.inf
    """Time after the start at which the run is stopped in any case, s."""
    priority: int = 0
    """Priority among the runs of its owner."""
    sweep: str = ""


@dataclass(frozen=True)
class Busy:
    """Cores and memory of a running run, and the Unix time of its expected end, s. If the expected end is 0, it is
    unknown: the run may end at any moment.
    """

    cores: int
    memory: float = 0.0
    ends: float = 0.0


@dataclass(frozen=True)
class Room:
    """Numbers of free cores and free bytes of memory."""

    cores: int
    memory: float = math.inf

    def fits(self, need: Need) -> bool:
        """True if the requested cores and memory are free."""
        return need.cores <= self.cores and need.memory <= self.memory

    def less(self, *taken: Need | Busy) -> "Room":
        """Returns the free cores and memory that remain after the start of the given runs."""
        return Room(self.cores - sum(one.cores for one in taken), self.memory - sum(one.memory for one in taken))


@dataclass
class Plan:
    """Runs that start now, in order, and the reason why each of the other runs waits."""

    start: list[str] = field(default_factory=list)
    why: dict[str, str] = field(default_factory=dict)


def in_state(runs: Iterable[Run], state: State) -> list[Run]:
    """Returns the runs in the state ``state``, oldest first."""
    return sorted((run for run in runs if run.state is state), key=lambda run: run.id)


def stranded(runs: Iterable[Run], looked_after: Set[str]) -> list[str]:
    """Returns the open runs that are neither in the queue nor supervised, which is an error of the server."""
    waits = {State.ACCEPTED, State.QUEUED}
    return [run.id for run in runs if run.state not in waits and run.id not in looked_after]


def ordered(needs: Iterable[Need], taken: Mapping[str, float], users: Mapping[str, Share]) -> list[Need]:
    """Returns the waiting runs in the order in which they should start. ``taken``: core-seconds that each owner has
    used, including the running runs.
    """
    of_owner: dict[str, list[Need]] = {}
    for need in sorted(needs, key=lambda need: (-need.priority, need.run)):
        of_owner.setdefault(need.owner, []).append(need)
    heap = [_place(users, name, taken.get(name, 0.0), own[0]) for name, own in of_owner.items()]
    heapq.heapify(heap)
    found: list[Need] = []
    while heap:
        _, used, _, name = heapq.heappop(heap)
        need = of_owner[name].pop(0)
        found.append(need)
        if of_owner[name]:
            share = users.get(name, Share()).share
            cost = max(_LEAST, need.cores * need.seconds)
            heapq.heappush(heap, _place(users, name, used * share + cost, of_owner[name][0]))
    return found


def _place(users: Mapping[str, Share], name: str, taken: float, first: Need) -> tuple[int, float, str, str]:
    user = users.get(name, Share())
    return -user.priority, taken / user.share, first.run, name


def plan(
    queue: Sequence[Need],
    busy: Sequence[Busy],
    room: Room,
    now: float,
    blocked: Callable[[Need, Sequence[Need]], str],
) -> Plan:
    """Plans the starts at the Unix time ``now``, s.

    ``busy``: the runs that use cores and memory of ``room``; ``queue``: the waiting runs in order; ``blocked``:
    function that returns why a run may not start if the given runs start before it. A run that is blocked, or that
    needs more than ``room``, delays no other run.
    """
    made, starts, holds, first = Plan(), list[Need](), list(busy), None
    waits = 0
    for need in queue:
        free = room.less(*holds)
        if why := blocked(need, starts) or _beyond(need, room):
            made.why[need.run] = why
        elif free.fits(need) and (first is None or _passes(need, first, holds, free, now)):
            starts.append(need)
            holds.append(Busy(need.cores, need.memory, now + need.seconds if need.seconds else 0.0))
        else:
            made.why[need.run] = _reason(need, room, free, waits)
            first, waits = first or need, waits + 1
    made.start = [need.run for need in starts]
    return made


def _beyond(need: Need, room: Room) -> str:
    """Returns why a run can never start on this server, for example because the server was restarted with fewer cores;
    empty if it can start.
    """
    if need.cores > room.cores:
        return f"the run needs {counted(need.cores, 'slot')}, this server has {room.cores}: it cannot start here"
    if need.memory > room.memory:
        return f"the run needs {size(need.memory)} of memory, this server has {size(room.memory)}: it cannot start here"
    return ""


def _reason(need: Need, room: Room, free: Room, waits: int) -> str:
    if waits:
        return f"waiting for {counted(waits, 'run')} before it"
    if need.cores > free.cores:
        return f"waiting for {need.cores} of {room.cores} slots; {max(0, free.cores)} free"
    return f"waiting for {size(need.memory)} of {size(room.memory)} of memory; {size(max(0.0, free.memory))} free"


def _passes(need: Need, first: Need, busy: Sequence[Busy], free: Room, now: float) -> bool:
    """Whether the run ``need`` can start without delaying ``first``, the first run for which ``free`` is not enough."""
    return now + need.limit <= _earliest(first, busy, free, now) or _beside(need, first, busy, free)


def _earliest(first: Need, busy: Sequence[Busy], free: Room, now: float) -> float:
    """Returns the estimated Unix time at which ``first`` can start, s. A running run that has exceeded its expected end
    may end at any moment.
    """
    for one in sorted(busy, key=lambda one: one.ends):
        free = Room(free.cores + one.cores, free.memory + one.memory)
        if free.fits(first):
            return max(now, one.ends)
    return now


def _beside(need: Need, first: Need, busy: Sequence[Busy], free: Room) -> bool:
    """Whether ``first`` can start at the same time with and without ``need``, for every order in which the running runs
    end.

    The numbers of cores that may become free are the sums over all subsets of ``busy``. The smallest of these numbers
    with which ``first`` can start must leave enough cores for ``need``. If ``first`` is waiting for memory, the result
    is False.
    """
    if free.memory - first.memory < need.memory:
        return False
    sums = 1
    for one in busy:
        sums |= sums << one.cores
    lacking = max(0, first.cores - free.cores)
    least = lacking + ((sums >> lacking) & -(sums >> lacking)).bit_length() - 1
    return free.cores + least - first.cores >= need.cores
