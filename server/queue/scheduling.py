"""Whose turn it is, and for what the others wait: pure functions over what waits and what runs.

The order: users whom the site gives a higher priority first, then by turns whoever has taken least for his share, and
of one user the higher priority, then the earlier run. The first run that does not fit has a reservation: others pass it
only where it starts no later for that. A run passes when it ends, by the limit that it is held to, before the large
one can start by the estimates of what runs (Lifka, The ANL/IBM SP scheduling system, 1995: "EASY"); or when it fits
beside it, in whichever order what runs may end.
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
"""Core-seconds that every run counts for in the order, where its estimate says less or nothing. Chosen."""


@dataclass(frozen=True)
class Need:
    """What a run that waits asks for."""

    run: str
    owner: str
    cores: int
    memory: float = 0.0
    """Bytes of all ranks, by the estimate; 0: not known."""
    seconds: float = 0.0
    """That it is expected to take; 0: not known."""
    limit: float = math.inf
    """s after which it is stopped for certain."""
    priority: int = 0
    """Among the runs of its owner."""
    sweep: str = ""


@dataclass(frozen=True)
class Busy:
    """What a run that has its cores holds, and the Unix time at which it is expected to end; 0: any moment."""

    cores: int
    memory: float = 0.0
    ends: float = 0.0


@dataclass(frozen=True)
class Room:
    """Cores, and bytes of memory."""

    cores: int
    memory: float = math.inf

    def fits(self, need: Need) -> bool:
        """True when the run can have what it asks for."""
        return need.cores <= self.cores and need.memory <= self.memory

    def less(self, *taken: Need | Busy) -> "Room":
        """What is left beside these."""
        return Room(self.cores - sum(one.cores for one in taken), self.memory - sum(one.memory for one in taken))


@dataclass
class Plan:
    """The runs that start now, in order, and for what each of the others waits."""

    start: list[str] = field(default_factory=list)
    why: dict[str, str] = field(default_factory=dict)


def in_state(runs: Iterable[Run], state: State) -> list[Run]:
    """The runs in ``state``, first come first."""
    return sorted((run for run in runs if run.state is state), key=lambda run: run.id)


def stranded(runs: Iterable[Run], looked_after: Set[str]) -> list[str]:
    """The runs that neither wait for their turn nor are looked after otherwise."""
    waits = {State.ACCEPTED, State.QUEUED}
    return [run.id for run in runs if run.state not in waits and run.id not in looked_after]


def ordered(needs: Iterable[Need], taken: Mapping[str, float], users: Mapping[str, Share]) -> list[Need]:
    """The queue, whose turn it is first; ``taken``: core-seconds of each owner so far, those of what runs included."""
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
    """What starts at the Unix time ``now``, out of ``room`` of which ``busy`` have a part; ``queue`` in its order.

    ``blocked`` says of a run, and of those that start before it, why it may not start whatever is free. Such a run
    holds nobody up, and one that needs more than there is neither.
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
    """Why a run can never start; a server may have been started again with less."""
    if need.cores > room.cores:
        return f"it needs {counted(need.cores, 'slot')}, and this server has {room.cores}: it cannot start here"
    if need.memory > room.memory:
        return f"it needs {size(need.memory)} of memory, and this server has {size(room.memory)}: it cannot start here"
    return ""


def _reason(need: Need, room: Room, free: Room, waits: int) -> str:
    if waits:
        return f"waiting for {counted(waits, 'run')} before it"
    if need.cores > free.cores:
        return f"waiting for {need.cores} of {room.cores} slots; {max(0, free.cores)} free"
    return f"waiting for {size(need.memory)} of {size(room.memory)} of memory; {size(max(0.0, free.memory))} free"


def _passes(need: Need, first: Need, busy: Sequence[Busy], free: Room, now: float) -> bool:
    """Whether ``need`` delays nothing for ``first``, which does not fit into what is ``free`` now."""
    return now + need.limit <= _earliest(first, busy, free, now) or _beside(need, first, busy, free)


def _earliest(first: Need, busy: Sequence[Busy], free: Room, now: float) -> float:
    """When ``first`` can start, Unix s: by the estimates of what runs; one that is overdue may end at any moment."""
    for one in sorted(busy, key=lambda one: one.ends):
        free = Room(free.cores + one.cores, free.memory + one.memory)
        if free.fits(first):
            return max(now, one.ends)
    return now


def _beside(need: Need, first: Need, busy: Sequence[Busy], free: Room) -> bool:
    """Whether ``first`` has its cores at the same moment with ``need`` as without, in whichever order others end.

    The cores that may come free are the sums over some of ``busy``: the least that lets ``first`` start must leave
    enough for ``need``. Where memory holds ``first`` up, nobody passes in this way.
    """
    if free.memory - first.memory < need.memory:
        return False
    sums = 1
    for one in busy:
        sums |= sums << one.cores
    lacking = max(0, first.cores - free.cores)
    least = lacking + ((sums >> lacking) & -(sums >> lacking)).bit_length() - 1
    return free.cores + least - first.cores >= need.cores
