"""CPU seconds per phase of the step, by the clock of this thread.

MPI polls while it waits: what a phase spends in calls that wait for other ranks counts as ``exchange``, whichever phase
it is in; the other phases are work.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from .parallel.comm import Comm

PHASES = ("elements", "exchange", "nodes", "contact", "fracture", "output")


class Timers:
    """Accumulates CPU time per phase."""

    def __init__(self, comm: Comm) -> None:
        self._comm = comm
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._reported = dict.fromkeys(PHASES, 0.0)
        self._inner = 0.0
        self._booked = 0.0
        """Of the waiting: what has been added to a phase."""

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Adds the CPU time of the block to a phase; a phase within it takes its own time out."""
        start, outside = time.thread_time(), self._inner
        waited = self._comm.waited - self._booked
        self._inner = 0.0
        try:
            yield
        finally:
            spent = time.thread_time() - start
            idle = self._comm.waited - self._booked - waited
            self._booked += idle
            self.seconds[name] += spent - self._inner - idle
            self.seconds["exchange"] += idle
            self._inner = outside + spent

    def since_last(self) -> dict[str, float]:
        """Seconds per phase since the last call."""
        delta = {name: self.seconds[name] - self._reported[name] for name in PHASES}
        self._reported = dict(self.seconds)
        return delta
