"""Time of a run on P ranks with a core for each thread: projected from CPU seconds and messages, rank by rank,
report by report.

::

    T_P = sum over windows ( max over ranks (work) + max over ranks (messages * latency + bytes / bandwidth)
                             + collectives * 2 ceil(log2 P) * latency + bytes put into them by all / bandwidth )

A window is the time between two reports of the worker; work is the CPU time of a rank without waiting. The projection
assumes that ranks wait for each other once in each window, and that messages do not overlap with work. For a run whose
tasks were timed one after the other (``--use project`` of the worker), work is the projected time of a rank with the
given number of threads.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from conoid.cases.messages import AnyMessage, Counts, Load
from conoid.cases.outcome import Outcome, Sharing, from_json
from conoid.cases.output import layout

from ..journal import from_line

Seconds = dict[str, list[float]]
"""CPU time by phase, one number per rank, s."""
_BANDWIDTH = re.compile(r"([\d.]+(?:e[+-]?\d+)?) ?([kMGT]?)B/s")


@dataclass(frozen=True)
class Network:
    """Cost of messages."""

    latency: float
    """Latency, s per message."""
    bandwidth: float
    """Bandwidth of a rank, bytes/s."""


class Phase(msgspec.Struct, frozen=True):
    """Time of a phase, s."""

    total: float
    """Time of all ranks."""
    imbalance: float
    """Sum over windows of largest minus mean over ranks."""


class Projection(msgspec.Struct, frozen=True, kw_only=True):
    """A run and its projection to a core for each thread; times in s, communication per step."""

    ranks: int
    steps: int
    windows: int
    wall: float
    """Wall time of the run, from the first step."""
    work: float
    """CPU time of all ranks without waiting."""
    longest: float
    """Sum over windows of the largest work of a rank."""
    longest_coarse: float
    """Sum of the largest work of a rank over windows of twice the length."""
    messages: float
    """Time of messages between two ranks."""
    collectives: float
    """Time of collectives."""
    phases: dict[str, Phase]
    messages_sent: float
    """Messages of a rank to other ranks."""
    bytes_sent: float
    """Bytes in these messages, per rank."""
    collectives_made: float
    bytes_shared: float
    """Bytes in these messages, by all ranks, per shared node."""
    rebalances: int
    digest: str
    threads: int = 1
    """Threads of each rank."""
    by_tasks: bool = False
    """True if ``work`` is computed from tasks that were timed one after the other; otherwise it is measured with so
    many threads."""
    helped: float = 0.0
    """Working time of all threads of each rank except the first thread."""
    serial: dict[str, float] = {}
    """Serial wall time by phase, of the rank with the largest sum over all phases."""
    parallel: dict[str, float] = {}
    """Parallel wall time by phase (in regions, which threads share), of the same rank."""
    sharing: Sharing | None = None

    @property
    def cores(self) -> int:
        """Number of cores: one for each thread."""
        return self.ranks * self.threads

    @property
    def name(self) -> str:
        """Name of the layout: ``4``, or ``4x4`` with several threads; with a star if ``by_tasks``."""
        threads = f"x{self.threads}" if self.threads > 1 or self.by_tasks else ""
        return f"{self.ranks}{threads}{'*' if self.by_tasks else ''}"

    @property
    def time(self) -> float:
        """The projected time T_P."""
        return self.longest + self.messages + self.collectives

    @property
    def coarse(self) -> float:
        """T_P from windows twice as long: the sensitivity to the windows."""
        return self.time - self.longest + self.longest_coarse

    @property
    def worst(self) -> float:
        """T_P if ranks waited for each other after every phase of a window."""
        imbalance = sum(phase.imbalance for phase in self.phases.values())
        return self.work / self.ranks + imbalance + self.messages + self.collectives

    @property
    def imbalance(self) -> float:
        """Largest work over the mean, averaged over the run by time."""
        return self.longest * self.ranks / self.work


def bandwidth(text: str) -> float:
    """Reads bytes/s from a text such as ``5 GB/s``. Raises ValueError."""
    match = _BANDWIDTH.fullmatch(text.strip())
    if match is None or not float(match[1]) > 0.0:
        raise ValueError(f"{text!r} is no bandwidth; write it like '5 GB/s'")
    return float(match[1]) * 1000.0 ** " kMGT".index(match[2] or " ")


def read(folder: Path, network: Network, threads: int | None = None) -> Projection:
    """Returns the projection of a run that has ended; see ``project``."""
    lines = (folder / layout.JOURNAL).read_bytes().splitlines()
    return project(map(from_line, lines), from_json((folder / layout.OUTCOME).read_bytes()), network, threads)


def project(
    journal: Iterable[AnyMessage], outcome: Outcome, network: Network, threads: int | None = None
) -> Projection:
    """Returns the projection of a run's messages and outcome; with ``threads`` by its tasks, None: as measured."""
    loads: list[Load] = []
    shared_steps = shared = 0
    for message in journal:
        if isinstance(message, Counts):
            shared = message.shared
        elif isinstance(message, Load):
            loads.append(message)
            shared_steps += shared * message.steps
    works = [_work(load) if threads is None else load.projected[threads] for load in loads]
    busy = [_busy(work) for work in works]
    ranks, steps = outcome.ranks, outcome.steps or 1
    sent = sum(sum(load.bytes) for load in loads)
    return Projection(
        ranks=ranks, steps=outcome.steps or 0, windows=len(loads), wall=outcome.elapsed - outcome.setup,
        work=sum(map(sum, busy)), longest=sum(map(max, busy)),
        longest_coarse=sum(max(map(sum, zip(*busy[i : i + 2], strict=True))) for i in range(0, len(busy), 2)),
        messages=sum(_messages(load, network) for load in loads),
        collectives=sum(_collectives(load, network) for load in loads),
        phases={name: _phase([work[name] for work in works]) for name in (works[0] if works else ())},
        messages_sent=sum(sum(load.messages) for load in loads) / ranks / steps, bytes_sent=sent / ranks / steps,
        collectives_made=sum(max(load.collectives) for load in loads) / steps,
        bytes_shared=sent / shared_steps if shared_steps else 0.0, rebalances=outcome.rebalances or 0,
        digest=outcome.digest, threads=outcome.threads if threads is None else threads, by_tasks=threads is not None,
        helped=sum(outcome.helped), serial=_of_one(outcome, outcome.serial),
        parallel=_of_one(outcome, outcome.parallel), sharing=outcome.sharing,
    )  # fmt: skip


def _of_one(outcome: Outcome, seconds: Seconds) -> dict[str, float]:
    """Returns serial and parallel times of the rank with the largest serial time."""
    totals = _busy(outcome.serial) if outcome.serial else []
    return {name: each[totals.index(max(totals))] for name, each in seconds.items()} if totals else {}


def _work(load: Load) -> Seconds:
    """Returns the phases without waiting, which is in ``exchange``."""
    packing = [spent - idle for spent, idle in zip(load.phases["exchange"], load.waiting, strict=True)]
    return {**load.phases, "exchange": packing}


def _busy(work: Seconds) -> list[float]:
    return [sum(spent) for spent in zip(*work.values(), strict=True)]


def _phase(windows: list[list[float]]) -> Phase:
    return Phase(sum(map(sum, windows)), sum(max(spent) - sum(spent) / len(spent) for spent in windows))


def _messages(load: Load, network: Network) -> float:
    pairs = zip(load.messages, load.bytes, strict=True)
    return max(number * network.latency + size / network.bandwidth for number, size in pairs)


def _collectives(load: Load, network: Network) -> float:
    """Returns the time of a collective: up a binary tree and down again; the bytes of all ranks pass through every
    rank.
    """
    levels = (len(load.collectives) - 1).bit_length()
    if not levels:
        return 0.0
    return max(load.collectives) * 2 * levels * network.latency + sum(load.collective_bytes) / network.bandwidth
