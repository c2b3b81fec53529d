"""Bracketing: the interval in which a result crosses a threshold, and the points to compute next."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True)
class Sample:
    """A result at ``x``. ``f`` is the result minus the threshold; None for a run without a result."""

    x: float
    f: float | None


@dataclass(frozen=True)
class Bracket:
    """Interval between two neighbouring points, sorted by x, in which the result crosses the threshold."""

    low: Sample
    high: Sample
    changes: int = 1
    """Number of crossings of the threshold between all points. More than 1 crossing means that the result is not
    monotonic or scatters."""
    mixed: tuple[float, float] | None = None
    """Interval of x with all crossings if there are several: from the first point beyond the threshold to the last
    point before the threshold."""

    @property
    def width(self) -> float:
        """Width of the bracket in x."""
        return self.high.x - self.low.x


def bracket(samples: Sequence[Sample]) -> Bracket | None:
    """Returns the bracket of the crossing with the smallest x; None if all points are on the same side of the
    threshold.

    A result at the low end that equals the threshold counts as before the threshold: the residual velocity of a
    stopped projectile is 0, and that of a rebounding projectile is negative.
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
    """Returns True for each point that is on the other side of the threshold than the first point."""
    signs = [_sign(sample.f) for sample in known]
    first = signs[0] if signs else 0
    if first:
        return [sign != first for sign in signs]
    last = next((sign for sign in reversed(signs) if sign), 0)
    return [sign == last != 0 for sign in signs]


def _sign(value: float | None) -> int:
    return 0 if not value else 1 if value > 0.0 else -1


def between(low: float, high: float, taken: Sequence[float], many: int) -> list[float]:
    """Returns ``many`` new points between ``low`` and ``high``. The new points and the points ``taken`` together divide
    the interval as evenly as possible.
    """
    ends = sorted({low, high, *(x for x in taken if low < x < high)})
    gaps = list(pairwise(ends))
    counts = [0] * len(gaps)
    for _ in range(many):
        widest = max(range(len(gaps)), key=lambda n: (gaps[n][1] - gaps[n][0]) / (counts[n] + 1))
        counts[widest] += 1
    return [a + (b - a) * k / (n + 1) for (a, b), n in zip(gaps, counts, strict=True) for k in range(1, n + 1)]


def widest(low: float, high: float, taken: Sequence[float]) -> float:
    """Returns the widest gap between neighbouring points of ``low``, ``high`` and ``taken``."""
    return max(b - a for a, b in pairwise(sorted({low, high, *(x for x in taken if low < x < high)})))
