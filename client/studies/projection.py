"""Projected time of a run on P ranks with a core for each thread, computed from the CPU times and the messages of each
rank in each interval between two reports.

::

    T_P = sum over windows ( max over ranks (work) + max over ranks (messages * latency + bytes / bandwidth)
                             + collectives * 2 ceil(log2 P) * latency + bytes put into them by all / bandwidth )

A window is the interval between two reports of the worker. Work is the CPU time of a rank without waiting. The
projection assumes that ranks wait for each other once in each window, and that messages do not overlap with work. If
the tasks of a run were timed one after the other (``--use project`` of the worker), work is the projected time of a
rank with the given number of threads.
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
"""CPU time in s by phase; each phase has one number for each rank."""
_BANDWIDTH = re.compile(r"([\d.]+(?:e[+-]?\d+)?) ?([kMGT]?)B/s")


@dataclass(frozen=True)
class Network:
    """Cost of messages between ranks."""

    latency: float
    """Latency of a message, s."""
    bandwidth: float
    """Bandwidth of the messages of one rank, bytes/s."""


class Phase(msgspec.Struct, frozen=True):
    """Time of one phase of the step, s."""

    total: float
    """Time of the phase, sum over all ranks, s."""
    imbalance: float
    """Imbalance of the phase, s: largest time of a rank minus the mean, summed over all windows."""


class Projection(msgspec.Struct, frozen=True, kw_only=True):
    """Measured times of a run, and its projection to a core for each thread. Times are in s; communication is per
    step.
    """

    ranks: int
    steps: int
    windows: int
    wall: float
    """Wall time of the run, s, from the first step."""
    work: float
    """CPU time of all ranks without waiting, s."""
    longest: float
    """Largest work of a rank in each window, summed over the windows, s."""
    longest_coarse: float
    """Largest work of a rank in windows of twice the length, summed over these windows, s."""
    messages: float
    """Projected time of messages between pairs of ranks, s."""
    collectives: float
    """Projected time of collective operations, s."""
    phases: dict[str, Phase]
    messages_sent: float
    """Number of messages that a rank sends to other ranks in a step."""
    bytes_sent: float
    """Number of bytes that a rank sends to other ranks in a step."""
    collectives_made: float
    bytes_shared: float
    """Bytes that all ranks send in a step, for each shared node."""
    rebalances: int
    digest: str
    threads: int = 1
    """Number of threads of each rank."""
    by_tasks: bool = False
    """True if ``work`` is computed from tasks that were timed one after the other; False if it was measured with
    ``threads`` threads."""
    helped: float = 0.0
    """Working time of all threads of each rank except the first thread, s."""
    serial: dict[str, float] = {}
    """Wall time of serial code by phase, s, for the rank with the largest sum over all phases."""
    parallel: dict[str, float] = {}
    """Wall time of parallel regions by phase, s, for the rank with the largest serial time."""
    sharing: Sharing | None = None

    @property
    def cores(self) -> int:
        """Number of cores of the projection: one core for each thread."""
        return self.ranks * self.threads

    @property
    def name(self) -> str:
        """Name of the layout: ``4``, or ``4x4`` with several threads; a star is appended if ``by_tasks``."""
        threads = f"x{self.threads}" if self.threads > 1 or self.by_tasks else ""
        return f"{self.ranks}{threads}{'*' if self.by_tasks else ''}"

    @property
    def time(self) -> float:
        """Projected time T_P of the run, s."""
        return self.longest + self.messages + self.collectives

    @property
    def coarse(self) -> float:
        """Projected time T_P from windows of twice the length, s; it shows the sensitivity to the length of the
        windows.
        """
        return self.time - self.longest + self.longest_coarse

    @property
    def worst(self) -> float:
        """Projected time T_P, s, if ranks waited for each other after every phase of a window."""
        imbalance = sum(phase.imbalance for phase in self.phases.values())
        return self.work / self.ranks + imbalance + self.messages + self.collectives

    @property
    def imbalance(self) -> float:
        """Largest work of a rank relative to the mean, averaged over the time of the run."""
        return self.longest * self.ranks / self.work


def bandwidth(text: str) -> float:
    """Returns the bandwidth, bytes/s, of a text such as ``5 GB/s``. Raises ValueError."""
    match = _BANDWIDTH.fullmatch(text.strip())
    if match is None or not float(match[1]) > 0.0:
        raise ValueError(f"{text!r} is not a bandwidth; write a value such as '5 GB/s'")
    return float(match[1]) * 1000.0 ** " kMGT".index(match[2] or " ")


def read(folder: Path, network: Network, threads: int | None = None) -> Projection:
    """Returns the projection of the finished run in ``folder``."""
    lines = (folder / layout.JOURNAL).read_bytes().splitlines()
    return project(map(from_line, lines), from_json((folder / layout.OUTCOME).read_bytes()), network, threads)


def project(
    journal: Iterable[AnyMessage], outcome: Outcome, network: Network, threads: int | None = None
) -> Projection:
    """Returns the projection for the messages and the outcome of a run. With ``threads`` the tasks of the run are
    projected to this number of threads; with None the measured times are used.
    """
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
    """Returns the serial and parallel times of the rank with the largest serial time."""
    totals = _busy(outcome.serial) if outcome.serial else []
    return {name: each[totals.index(max(totals))] for name, each in seconds.items()} if totals else {}


def _work(load: Load) -> Seconds:
    """Returns the times of the phases without waiting; the phase ``exchange`` contains waiting."""
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
    """Returns the time of the collective operations: up a binary tree and down again, with the bytes of all ranks
    through every rank.
    """
    levels = (len(load.collectives) - 1).bit_length()
    if not levels:
        return 0.0
    return max(load.collectives) * 2 * levels * network.latency + sum(load.collective_bytes) / network.bandwidth
