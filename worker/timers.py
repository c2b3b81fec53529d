"""CPU seconds per phase of the step, by the clock of this thread.

MPI polls while it waits, so a rank that is early spends its time in ``exchange``; the other phases are work.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager

PHASES = ("elements", "exchange", "nodes", "contact", "fracture", "output")


class Timers:
    """Accumulates CPU time per phase."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._reported = dict.fromkeys(PHASES, 0.0)
        self._inner = 0.0

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Adds the CPU time of the block to a phase; a phase within it takes its own time out."""
        start, outside = time.thread_time(), self._inner
        self._inner = 0.0
        try:
            yield
        finally:
            spent = time.thread_time() - start
            self.seconds[name] += spent - self._inner
            self._inner = outside + spent

    def since_last(self) -> dict[str, float]:
        """Seconds per phase since the last call."""
        delta = {name: self.seconds[name] - self._reported[name] for name in PHASES}
        self._reported = dict(self.seconds)
        return delta
