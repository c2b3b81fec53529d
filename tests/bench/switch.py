"""What telemetry costs a step, within one run: it is switched on and off every quarter of a second.

Two processes that do the same differ by more than telemetry costs (where their memory happens to lie decides), so the
comparison is made inside one: each Progress message ends a block and begins the next, with telemetry or without. Blocks
come in pairs, in a random order within the pair; what drifts slowly or lies in the process is the same for both.
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
"""Blocks with telemetry before the first that counts."""
_HALF_WIDTH = 0.98
"""Half of 1.96: the ranks of a sample of n between which the median lies at 95 % are n / 2 -+ this times sqrt(n)."""


@dataclass(frozen=True)
class Block:
    """Seconds a step between two Progress messages: CPU of the solver's thread, CPU of all others, wall time."""

    told: bool
    cpu: float
    beside: float
    wall: float


@dataclass(frozen=True)
class Pairs:
    """A run with a router in some state."""

    way: str
    blocks: list[Block]

    def median(self, told: bool, what: str) -> float:
        """s a step in the blocks with, or without telemetry."""
        return float(statistics.median(getattr(block, what) for block in self.blocks if block.told is told))

    def ratio(self, what: str) -> tuple[float, float, float]:
        """With over without, a pair at a time: the median, and the interval that holds it at 95 % (sign test)."""
        pairs = zip(self.blocks[::2], self.blocks[1::2], strict=True)
        ratios = sorted((getattr(a, what) / getattr(b, what)) ** (1 if a.told else -1) for a, b in pairs)
        n = len(ratios)
        low = max(0, math.floor(n / 2 - _HALF_WIDTH * math.sqrt(n)))
        return statistics.median(ratios), ratios[low], ratios[n - 1 - low]


class End(Signals):
    """A request to stop that comes from the switch, not from outside."""

    def __init__(self) -> None:
        self.raised = False


class Switch:
    """A journal's listener that passes messages on in every block whose turn it is, and notes what each block cost."""

    def __init__(self, telemetry: Telemetry, turns: Sequence[bool], ready: Callable[[], None], end: End) -> None:
        """``ready`` is called once, when telemetry has run for a while; ``end`` is raised after the last turn."""
        self.blocks: list[Block] = []
        self._telemetry = telemetry
        self._turns = iter(turns)
        self._ready = ready
        self._end = end
        self._warm = _WARM
        self._told = True
        self._mark = (0.0, 0.0, 0.0, 0)

    def tell(self, message: messages.AnyMessage, blob: bytes = b"") -> None:
        """Takes a message from the solver."""
        if isinstance(message, messages.Progress):
            self._next_block(message.step)
        if self._told:
            self._telemetry.tell(message, blob)

    def _next_block(self, step: int) -> None:
        if self._warm:
            self._warm -= 1
            if not self._warm:
                self._ready()
        else:
            self._note(step)
        turn = True if self._warm else next(self._turns, None)
        self._told, self._end.raised = bool(turn), turn is None
        self._mark = _now(step)

    def _note(self, step: int) -> None:
        cpu, process, wall, steps = (new - old for new, old in zip(_now(step), self._mark, strict=True))
        if not self._end.raised:
            self.blocks.append(Block(self._told, cpu / steps, (process - cpu) / steps, wall / steps))


def _now(step: int) -> tuple[float, float, float, int]:
    return time.thread_time(), time.process_time(), time.perf_counter(), step


def turns(pairs: int, seed: int = 1) -> list[bool]:
    """One with and one without telemetry in each pair, whichever first."""
    coin = random.Random(seed)
    firsts = [True, False] * ((pairs + 1) // 2)
    coin.shuffle(firsts)
    return [told for first in firsts[:pairs] for told in (first, not first)]


def measure(way: str, endpoint: str, prefix: str, pairs: int, ready: Callable[[], None]) -> Pairs:
    """A long flight of a few elastic tets, to the router at ``endpoint``; ``ready`` does to it what ``way`` says."""
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
