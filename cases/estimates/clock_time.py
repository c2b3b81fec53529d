"""How long a case takes by the clock on its ranks and threads, from the core time of its stages.

An estimate with assumptions that are told with it: what threads share, and how efficient ranks and threads are. On few
cores they were measured; on many, threads were only projected (docs/performance/scaling.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from ..model.schema import Case
from .stages import AVERAGED, STATE, STRENGTH, TETS

SHARED = (TETS, AVERAGED, STRENGTH, STATE)
"""Stages whose passes the threads of a rank share. The others are taken to be done by one of them."""
_RANKS = 0.4
"""R ranks are as fast as R to this power: 66 % efficient for 2, 44 % for 4, 19 % for 16. By the clock 2 were 62 to 72 %
efficient, 4 were 54 %, 16 were 14 to 18 %, in scenes of 47,000 to 147,000 tets (docs/performance/scaling.md)."""
_THREAD = 0.15
"""What each further thread costs all of them: T threads are T / (1 + 0.15 (T - 1)) as fast as one in what they share,
87 % efficient for 2, 69 % for 4, 31 % for 16. Assumed: docs/performance/scaling.md, Threads, has what was projected."""


@dataclass(frozen=True)
class ClockTime:
    """s by the clock with a core for each thread, and what was assumed."""

    seconds: float
    breaking: float
    """That come on top where what may break breaks as far as it may."""
    shared: float
    """Share of the core time that the threads of a rank share."""
    ranks: float
    """Efficiency of the ranks, 1 of one."""
    threads: float
    """Efficiency of the threads in what they share."""


def clock_time(case: Case, costs: Mapping[str, float], breaking: float) -> ClockTime:
    """Of a case whose stages cost so many core-seconds, and its ``breaking`` so many besides."""
    ranks, threads = case.run.ranks, case.run.threads
    total = sum(costs.values())
    shared = sum(costs.get(stage, 0.0) for stage in SHARED)
    faster, each = ranks**_RANKS, 1.0 / (1.0 + _THREAD * (threads - 1))
    seconds = (total - shared + shared / (threads * each)) / faster
    return ClockTime(seconds, breaking / faster, shared / total if total > 0.0 else 0.0, faster / ranks, each)
