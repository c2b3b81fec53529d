"""Estimate of the wall time of a case on its ranks and threads, from the core time of its stages.

The assumptions are part of the answer: the share of the threads, and the efficiency of ranks and threads. The constants
were measured on few cores; for many cores the gain by threads was only projected (docs/performance/scaling.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from ..model.schema import Case
from .stages import AVERAGED, STATE, STRENGTH, TETS

SHARED = (TETS, AVERAGED, STRENGTH, STATE)
"""Stages whose passes the threads of a rank share. All other parts of the program are assumed to run on one thread."""
_RANKS = 0.4
"""Exponent of the speed of R ranks, R^p: 66 % efficient for 2, 44 % for 4, 19 % for 16. Measured wall time: 2 ranks
62 to 72 % efficient, 4 54 %, 16 14 to 18 %, in scenes of 47,000 to 147,000 tets (docs/performance/scaling.md)."""
_THREAD = 0.15
"""Cost of each further thread for all of them: T threads are T / (1 + 0.15 (T - 1)) as fast as one in shared passes,
87 % efficient for 2, 69 % for 4, 31 % for 16. Assumed; docs/performance/scaling.md, Threads, has the projections."""


@dataclass(frozen=True)
class ClockTime:
    """Wall time, s, with one core for each thread, and the assumptions."""

    seconds: float
    breaking: float
    """Additional wall time, s, if everything that can break breaks as far as it can."""
    shared: float
    """Share of the core time that the threads of a rank share."""
    ranks: float
    """Efficiency of the ranks, 1 for one rank."""
    threads: float
    """Efficiency of the threads in shared passes."""


def clock_time(case: Case, costs: Mapping[str, float], breaking: float) -> ClockTime:
    """Returns the wall time of a case whose stages cost so many core seconds, and its ``breaking`` so many in
    addition."""
    ranks, threads = case.run.ranks, case.run.threads
    total = sum(costs.values())
    shared = sum(costs.get(stage, 0.0) for stage in SHARED)
    faster, each = ranks**_RANKS, 1.0 / (1.0 + _THREAD * (threads - 1))
    seconds = (total - shared + shared / (threads * each)) / faster
    return ClockTime(seconds, breaking / faster, shared / total if total > 0.0 else 0.0, faster / ranks, each)
