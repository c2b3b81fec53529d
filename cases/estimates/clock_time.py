"""Estimate of the wall time of a case on its ranks and threads, from the core time of its stages.

The returned estimate contains its assumptions: the share of the threads, and the efficiency of ranks and threads. The
constants were measured on few cores; for many cores the gain by threads was only projected
(docs/performance/scaling.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from ..model.schema import Case
from .stages import AVERAGED, STATE, STRENGTH, TETS

SHARED = (TETS, AVERAGED, STRENGTH, STATE)
"""Stages whose loops are divided among the threads of a rank. All other parts of the program are assumed to run on one
thread."""
_RANKS = 0.4
"""Exponent p of the speed of R ranks, R^p: 66 % efficient for 2 ranks, 44 % for 4, 19 % for 16. Measured wall times
correspond to efficiencies of 62 to 72 % for 2 ranks, 54 % for 4, 14 to 18 % for 16, in scenes of 47,000 to 147,000 tets
(docs/performance/scaling.md)."""
_THREAD = 0.15
"""Cost of each further thread for all threads, assumed: T threads are T / (1 + 0.15 (T - 1)) times as fast as one
thread in shared loops. The efficiency is 87 % for 2 threads, 69 % for 4, 31 % for 16; docs/performance/scaling.md,
Threads, has the projections."""


@dataclass(frozen=True)
class ClockTime:
    """Wall time, s, with one core for each thread, and the assumptions of the estimate."""

    seconds: float
    breaking: float
    """Additional wall time, s, if all material that can break breaks as far as it can."""
    shared: float
    """Share of the core time that is divided among the threads of a rank."""
    ranks: float
    """Parallel efficiency of the ranks, 1 for one rank."""
    threads: float
    """Parallel efficiency of the threads in shared loops."""


def clock_time(case: Case, costs: Mapping[str, float], breaking: float) -> ClockTime:
    """Returns the wall time of a case from the core time of its stages, and from the additional core time ``breaking``
    of fracture.
    """
    ranks, threads = case.run.ranks, case.run.threads
    total = sum(costs.values())
    shared = sum(costs.get(stage, 0.0) for stage in SHARED)
    faster, each = ranks**_RANKS, 1.0 / (1.0 + _THREAD * (threads - 1))
    seconds = (total - shared + shared / (threads * each)) / faster
    return ClockTime(seconds, breaking / faster, shared / total if total > 0.0 else 0.0, faster / ranks, each)
