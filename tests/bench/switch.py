"""Cost of telemetry per step, measured within one run: telemetry is switched on and off every quarter of a second.

Two processes with the same work differ by more than the cost of telemetry, for example by the addresses of their
memory. Therefore both states of telemetry are compared within one process: each Progress message ends a block of steps
and begins the next block, with or without telemetry. Blocks come in pairs with a random order within a pair: a slow
drift and the properties of the process affect both blocks in the same way.
"""

import math
import random
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from conoid.cases import load, messages
from conoid.worker.output.journal import Journal
from conoid.worker.output.telemetry import Telemetry
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.run.compute import compute
from conoid.worker.run.signals import Signals

_WARM = 4
"""Number of blocks with telemetry before the first measured block."""
_HALF_WIDTH = 0.98
"""Half of 1.96, for the 95 % interval of a median. In a sorted sample of n values, the 95 % interval of the median lies
between the ranks n / 2 - d and n / 2 + d; d is this constant times sqrt(n)."""


@dataclass(frozen=True)
class Block:
    """Times per step between two Progress messages, s: CPU time of the solver thread, CPU time of all other threads,
    wall time."""

    live: bool
    cpu: float
    beside: float
    wall: float


@dataclass(frozen=True)
class Pairs:
    """Measured blocks of steps of a run, with a router in one state."""

    way: str
    blocks: list[Block]

    def median(self, live: bool, what: str) -> float:
        """Returns the median time per step, s, of the blocks with or without telemetry."""
        return float(statistics.median(getattr(block, what) for block in self.blocks if block.live is live))

    def ratio(self, what: str) -> tuple[float, float, float]:
        """Returns the ratio of each pair of blocks, with telemetry over without telemetry: the median, and its 95 %
        interval (sign test)."""
        pairs = zip(self.blocks[::2], self.blocks[1::2], strict=True)
        ratios = sorted((getattr(a, what) / getattr(b, what)) ** (1 if a.live else -1) for a, b in pairs)
        n = len(ratios)
        low = max(0, math.floor(n / 2 - _HALF_WIDTH * math.sqrt(n)))
        return statistics.median(ratios), ratios[low], ratios[n - 1 - low]


class End(Signals):
    """A stop that the switch requests, not a user."""

    def __init__(self) -> None:
        self.raised = False


class Switch:
    """A listener of the journal that sends messages to telemetry only in blocks with telemetry, and stores the cost of
    each block.
    """

    def __init__(self, telemetry: Telemetry, turns: Sequence[bool], ready: Callable[[], None], end: End) -> None:
        """The function ``ready`` is called once, after some blocks with telemetry; the exception ``end`` is raised
        after the last block.
        """
        self.blocks: list[Block] = []
        self._telemetry = telemetry
        self._turns = iter(turns)
        self._ready = ready
        self._end = end
        self._warm = _WARM
        self._live = True
        self._mark = (0.0, 0.0, 0.0, 0)

    def tell(self, message: messages.AnyMessage, blob: bytes = b"") -> None:
        """Handles a message from the solver."""
        if isinstance(message, messages.Progress):
            self._next_block(message.step)
        if self._live:
            self._telemetry.tell(message, blob)

    def _next_block(self, step: int) -> None:
        if self._warm:
            self._warm -= 1
            if not self._warm:
                self._ready()
        else:
            self._note(step)
        turn = True if self._warm else next(self._turns, None)
        self._live, self._end.raised = bool(turn), turn is None
        self._mark = _now(step)

    def _note(self, step: int) -> None:
        cpu, process, wall, steps = (new - old for new, old in zip(_now(step), self._mark, strict=True))
        if not self._end.raised:
            self.blocks.append(Block(self._live, cpu / steps, (process - cpu) / steps, wall / steps))


def _now(step: int) -> tuple[float, float, float, int]:
    return time.thread_time(), time.process_time(), time.perf_counter(), step


def turns(pairs: int, seed: int = 1) -> list[bool]:
    """Returns the order of the blocks: pairs of a block with and a block without telemetry, in random order."""
    coin = random.Random(seed)
    firsts = [True, False] * ((pairs + 1) // 2)
    coin.shuffle(firsts)
    return [live for first in firsts[:pairs] for live in (first, not first)]


def measure(way: str, endpoint: str, prefix: str, pairs: int, ready: Callable[[], None]) -> Pairs:
    """Runs a few elastic tets for many steps, with the router at ``endpoint``; ``ready`` applies ``way`` to the
    router."""
    overrides = ["run.end_time=10 s", "run.frames=0", "reference=[]"]
    case = load.parse_case(load.apply_overrides(load.read_data(load.shipped_path("free_spin")), overrides))
    telemetry, end = Telemetry(endpoint, prefix), End()
    switch = Switch(telemetry, turns(pairs), ready, end)
    with tempfile.TemporaryDirectory(prefix="conoid-bench-") as out:
        folder = Path(out)
        journal = Journal(folder, "run", switch)
        compute(case, folder, folder, SerialComm(), journal, end, time.monotonic(), False)
        journal.close()
    telemetry.close()
    return Pairs(way, switch.blocks)
