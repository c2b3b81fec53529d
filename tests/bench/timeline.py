"""Computes the end of a run with a core for each rank, from the work of every rank between two calls of its
communicator.

A message arrives after one latency plus its number of bytes over the bandwidth. A collective ends for all ranks when
the last rank has entered it, after two passes through a binary tree. Each call, and each message at both of its ends,
costs CPU time of the rank. The computation does not average over steps: a rank that is late in one step delays the
others in that step.
"""

from collections import defaultdict, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from conoid.client.studies.projection import Network

CALL = 3e-6
"""CPU time of a call of the communicator, from Python to MPI and back, s (chosen value: the time of a call of a kernel
from Python)."""
MESSAGE = 0.5e-6
"""CPU time of a message at each of its ends, s (chosen value: the time in which MPI posts a message in shared
memory)."""


@dataclass
class Call:
    """A call of the communicator; the fields are in the order of the parts of a call."""

    work: float
    """CPU time of the rank since the previous call, s."""
    enters: bool = False
    """Whether the rank enters a collective."""
    leaves: int = 0
    """Number of collectives for which the rank waits; the result of a collective has ``size`` bytes."""
    size: int = 0
    sends: list[tuple[int, int, int]] = field(default_factory=list)
    """Sent messages, each with receiver, tag and number of bytes."""
    receives: list[tuple[int, int]] = field(default_factory=list)
    """Received messages for which the rank waits, each with sender and tag."""


class DeadlockError(Exception):
    """Ranks wait for each other without end, because the calls do not belong to one run."""


@dataclass
class Timeline:
    """Times of all ranks up to their present calls."""

    calls: Sequence[Sequence[Call]]
    """Calls of the communicator by each rank."""
    network: Network
    now: list[float] = field(init=False)
    """Present time of each rank, s."""
    waited: list[float] = field(init=False)
    """Waiting time of each rank, s."""

    def __post_init__(self) -> None:
        ranks = len(self.calls)
        self.now, self.waited = [0.0] * ranks, [0.0] * ranks
        self._mail: dict[tuple[int, int, int], deque[float]] = defaultdict(deque)
        self._come: list[dict[int, float]] = []
        self._entered, self._left = [0] * ranks, [0] * ranks
        self._levels = (ranks - 1).bit_length()

    def run(self) -> float:
        """Returns the time of the last rank, s. Raises DeadlockError if ranks wait for each other without end."""
        under_way = {rank: self._steps(rank) for rank in range(len(self.calls))}
        while under_way:
            before = len(under_way), self._progress()
            for rank, steps in list(under_way.items()):
                if next(steps, None) is None:
                    del under_way[rank]
            if before == (len(under_way), self._progress()):
                raise DeadlockError(f"ranks {sorted(under_way)} wait for a message that no rank sends")
        return max(self.now)

    def _progress(self) -> tuple[float, int]:
        return sum(self.now), sum(map(len, self._mail.values())) + sum(map(len, self._come))

    def _steps(self, rank: int) -> Iterator[int]:
        """Processes the calls of a rank up to the first call for which the rank must wait."""
        for call in self.calls[rank]:
            self.now[rank] += call.work + CALL
            if call.enters:
                self._enter(rank)
            if call.leaves:
                while not self._all_there(rank):
                    yield rank
                self._leave(rank, call)
            for target, tag, size in call.sends:
                self.now[rank] += MESSAGE
                arrives = self.now[rank] + self.network.latency + size / self.network.bandwidth
                self._mail[rank, target, tag].append(arrives)
            for source, tag in call.receives:
                while not self._mail[source, rank, tag]:
                    yield rank
                self._wait(rank, self._mail[source, rank, tag].popleft())
                self.now[rank] += MESSAGE

    def _enter(self, rank: int) -> None:
        if self._entered[rank] == len(self._come):
            self._come.append({})
        self._come[self._entered[rank]][rank] = self.now[rank]
        self._entered[rank] += 1

    def _all_there(self, rank: int) -> bool:
        return len(self._come[self._left[rank]]) == len(self.calls)

    def _leave(self, rank: int, call: Call) -> None:
        last = max(self._come[self._left[rank]].values())
        self._left[rank] += 1
        passes = 2 * self._levels * call.leaves * self.network.latency
        self._wait(rank, last + passes + call.size / self.network.bandwidth)

    def _wait(self, rank: int, until: float) -> None:
        self.waited[rank] += max(0.0, until - self.now[rank])
        self.now[rank] = max(self.now[rank], until)
