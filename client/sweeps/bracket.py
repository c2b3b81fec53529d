"""Bracketing: between which two points a result passes a threshold, and which points to look at next."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True)
class Sample:
    """A result less its threshold, ``f``, at ``x``; None where the run has not given one."""

    x: float
    f: float | None


@dataclass(frozen=True)
class Bracket:
    """The threshold is passed between the points ``low`` and ``high``, in the order of x."""

    low: Sample
    high: Sample
    changes: int = 1
    """How often it is passed between all points: more than once where the result is not monotonic, or scatters."""
    mixed: tuple[float, float] | None = None
    """From the first point beyond the threshold to the last one before it, where it is passed more than once."""

    @property
    def width(self) -> float:
        """Of x."""
        return self.high.x - self.low.x


def bracket(samples: Sequence[Sample]) -> Bracket | None:
    """The first passage, from the lowest x on; None where all points are on one side.

    A result that is exactly at the threshold at the low end belongs to the side before it: what is left of a projectile
    that was stopped is 0, and what bounces back is below.
    """
    known = sorted((sample for sample in samples if sample.f is not None), key=lambda sample: sample.x)
    beyond = _beyond(known)
    passes = [(a, b) for (a, one), (b, other) in pairwise(zip(known, beyond, strict=True)) if one != other]
    if not passes:
        return None
    low, high = passes[0]
    first = next(sample.x for sample, far in zip(known, beyond, strict=True) if far)
    last = next(sample.x for sample, far in reversed(list(zip(known, beyond, strict=True))) if not far)
    return Bracket(low, high, len(passes), (first, last) if len(passes) > 1 else None)


def _beyond(known: Sequence[Sample]) -> list[bool]:
    """Whether each point is on another side than the first one."""
    signs = [_sign(sample.f) for sample in known]
    first = signs[0] if signs else 0
    if first:
        return [sign != first for sign in signs]
    last = next((sign for sign in reversed(signs) if sign), 0)
    return [sign == last != 0 for sign in signs]


def _sign(value: float | None) -> int:
    return 0 if not value else 1 if value > 0.0 else -1


def between(low: float, high: float, taken: Sequence[float], many: int) -> list[float]:
    """So many points between two others that divide what the ``taken`` ones there leave as evenly as can be."""
    ends = sorted({low, high, *(x for x in taken if low < x < high)})
    gaps = list(pairwise(ends))
    counts = [0] * len(gaps)
    for _ in range(many):
        widest = max(range(len(gaps)), key=lambda n: (gaps[n][1] - gaps[n][0]) / (counts[n] + 1))
        counts[widest] += 1
    return [a + (b - a) * k / (n + 1) for (a, b), n in zip(gaps, counts, strict=True) for k in range(1, n + 1)]


def widest(low: float, high: float, taken: Sequence[float]) -> float:
    """The widest gap between two points, or between one and those ``taken`` there."""
    return max(b - a for a, b in pairwise(sorted({low, high, *(x for x in taken if low < x < high)})))
