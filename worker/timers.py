"""CPU seconds per phase of the step, by the clock of this thread.

MPI polls while it waits: what a phase spends in calls that wait for other ranks counts as ``exchange``, whichever phase
it is in; the other phases are work. Kernels are loaded at their first call: that counts in no phase.
"""

from collections.abc import Iterator
from contextlib import contextmanager

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

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Adds the CPU time of the block to a phase; a phase within it takes its own time out."""
        start, outside = cpu_time(), self._inner
        waited = self._comm.waited - self._booked
        self._inner = 0.0
        try:
            yield
        finally:
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
