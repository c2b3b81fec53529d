"""CPU seconds per phase of the step, by the clock of this thread.

MPI polls while it waits: what a phase spends in calls that wait for other ranks counts as ``exchange``, whichever phase
it is in; the other phases are work. Kernels are loaded at their first call: that counts in no phase.
"""

from .jit import cpu_time
from .parallel.comm import Comm

PHASES = ("elements", "exchange", "nodes", "contact", "fracture", "output", "balance", "rest")
"""``rest`` is what lies between the others."""


def worked(comm: Comm) -> float:
    """CPU time of this thread so far, but for its waiting and for the loading of kernels, s."""
    return cpu_time() - comm.waited


class Timers:
    """Accumulates CPU time per phase."""

    def __init__(self, comm: Comm) -> None:
        self._comm = comm
        self.begin()
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._reported = dict.fromkeys(PHASES, 0.0)
        self._inner = 0.0
        self._booked = self._told = 0.0
        """Of the waiting: what has been added to ``exchange``, and how much of it has been reported."""

    def begin(self) -> None:
        """Counts ``rest`` from here on."""
        self._asked = cpu_time()

    def phase(self, name: str) -> "_Phase":
        """Adds the CPU time of the block to a phase; a phase within it takes its own time out."""
        return _Phase(self, name)

    def enter(self) -> tuple[float, float, float]:
        """CPU time and waiting so far, and the time of phases so far that lie within the one that goes on."""
        outside, self._inner = self._inner, 0.0
        return cpu_time(), self._comm.waited - self._booked, outside

    def leave(self, name: str, start: float, waited: float, outside: float) -> None:
        """The phase that has been entered ends."""
        spent = cpu_time() - start
        idle = self._comm.waited - self._booked - waited
        self._booked += idle
        self.seconds[name] += spent - self._inner - idle
        self.seconds["exchange"] += idle
        self._inner = outside + spent

    def since_last(self) -> tuple[dict[str, float], float]:
        """Seconds per phase since the last call, and how many of ``exchange`` were waiting; asked between phases."""
        spent = cpu_time() - self._asked
        self.begin()
        self.seconds["rest"] += spent - (sum(self.seconds.values()) - sum(self._reported.values()))
        delta = {name: self.seconds[name] - self._reported[name] for name in PHASES}
        waiting = self._booked - self._told
        self._reported, self._told = dict(self.seconds), self._booked
        return delta, waiting


class _Phase:
    """A block of the step; there are two dozen in every step, too many for generators."""

    __slots__ = ("_entered", "_name", "_timers")

    def __init__(self, timers: Timers, name: str) -> None:
        self._timers, self._name = timers, name

    def __enter__(self) -> None:
        self._entered = self._timers.enter()

    def __exit__(self, *_: object) -> None:
        self._timers.leave(self._name, *self._entered)
