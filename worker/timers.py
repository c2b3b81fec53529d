"""CPU seconds per phase of the step, by the clock of this thread: waits of other processes do not count."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

PHASES = ("elements", "exchange", "nodes", "output")


class Timers:
    """Accumulates CPU time per phase."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._reported = dict.fromkeys(PHASES, 0.0)

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Adds the CPU time of the block to a phase."""
        start = time.thread_time()
        try:
            yield
        finally:
            self.seconds[name] += time.thread_time() - start

    def since_last(self) -> dict[str, float]:
        """Seconds per phase since the last call."""
        delta = {name: self.seconds[name] - self._reported[name] for name in PHASES}
        self._reported = dict(self.seconds)
        return delta
