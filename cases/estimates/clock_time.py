"""Estimate of the wall time of a case on its ranks and threads, from the CPU time of each stage.

The result also contains its assumptions: the fraction of the CPU time that threads divide, and the parallel
efficiencies of ranks and threads. The constants were measured on few cores. The gain by threads on many cores is a
projection that was not measured (docs/performance/scaling.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from ..model.schema import Case
from .stages import AVERAGED, STATE, STRENGTH, TETS

SHARED = (TETS, AVERAGED, STRENGTH, STATE)
"""Stages whose loops are divided among the threads of a rank. All other parts of the program are assumed to run on one
thread."""
_RANKS = 0.4
"""Exponent p: R ranks are R^p times as fast as one rank. The parallel efficiency is then 66 % for 2 ranks, 44 % for 4
ranks and 19 % for 16 ranks. Measured wall times in scenes of 47,000 to 147,000 tets correspond to 62 to 72 % for 2
ranks, 54 % for 4 ranks, and 14 to 18 % for 16 ranks (docs/performance/scaling.md)."""
_THREAD = 0.15
"""Assumed loss k by each further thread: in loops that threads divide, T threads are T / (1 + k (T - 1)) times as fast
as one thread, k = 0.15. The parallel efficiency is then 87 % for 2 threads, 69 % for 4 threads and 31 % for 16 threads;
the section "Threads" of docs/performance/scaling.md has the projections."""


@dataclass(frozen=True)
class ClockTime:
    """Estimated wall time, s, on a machine with one core for each thread, and the assumptions of this estimate."""

    seconds: float
    breaking: float
    """Additional wall time, s, if all parts that can fracture break as far as they can."""
    shared: float
    """Fraction of the CPU time that is divided among the threads of a rank."""
    ranks: float
    """Parallel efficiency of the ranks, 1 for one rank."""
    threads: float
    """Parallel efficiency of the threads in the loops that they divide."""


def clock_time(case: Case, costs: Mapping[str, float], breaking: float) -> ClockTime:
    """Returns the wall time of a case. ``costs``: CPU time of each stage, s; ``breaking``: additional CPU time of
    fracture, s.
    """
    ranks, threads = case.run.ranks, case.run.threads
    total = sum(costs.values())
    shared = sum(costs.get(stage, 0.0) for stage in SHARED)
    faster, each = ranks**_RANKS, 1.0 / (1.0 + _THREAD * (threads - 1))
    seconds = (total - shared + shared / (threads * each)) / faster
    return ClockTime(seconds, breaking / faster, shared / total if total > 0.0 else 0.0, faster / ranks, each)
