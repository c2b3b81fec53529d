"""Convergence with the mesh: observed order, Richardson extrapolation, grid convergence index. The module works on
plain numbers.

Sources: Celik, Ghia, Roache and Freitas, J. Fluids Eng. 130 (2008) 078001 (the procedure of ASME V&V 20-2009,
section 2); Eca and Hoekstra, J. Comput. Phys. 262 (2014) 104, for the weighted least squares and the safety factors.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

FORMAL = 2.0
"""Order of linear tets and of the leapfrog scheme in smooth motion. An extrapolation uses at most this order."""
SAFETY, CAUTION = 1.25, 3.0
"""Safety factors of V&V 20: with an observed order from at least three meshes, and without an observed order."""
SLOWEST = 0.5
"""Order below which Eca and Hoekstra do not trust an extrapolation."""
_ORDERS = (0.01, 12.0)
"""Range in which the observed order is searched (chosen value: relative differences below 0.01 are not significant)."""
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
_SCAN, _HALVINGS = 240, 80
"""Number of orders that are tried, and number of golden-section steps around the best order (chosen values: the error
of the order is 1e-12)."""


class Trend(StrEnum):
    """Behaviour of a quantity as the element size decreases."""

    CONVERGES = "converges"
    SETTLED = "settled"
    OSCILLATES = "oscillates"
    SCATTERS = "within scatter"
    DIVERGES = "does not converge"
    UNKNOWN = "too few meshes"


@dataclass(frozen=True)
class Limit:
    """Limit of a quantity that is computed on several meshes, with its uncertainty."""

    trend: Trend
    value: float
    """Value extrapolated to the element size 0 if the quantity converges; otherwise the value on the finest mesh."""
    uncertainty: float
    """Absolute uncertainty of the value on the finest mesh at 95 %: the grid convergence index times the value."""
    order: float = math.nan
    """Observed order; NaN if there is none."""


@dataclass(frozen=True)
class Fit:
    """Curve f(h) = ``value`` + ``slope`` h^``order``, and the standard deviation of the values from the curve."""

    value: float
    slope: float
    order: float
    deviation: float


def observed_order(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Returns the observed order of three meshes, the finest mesh first; NaN if there is no order.

    p ln r21 = ln|e32 / e21| + ln((r21^p - s) / (r32^p - s)), where s is the sign of e32 / e21 (Celik and others, eq.
    3).
    """
    fine, coarse = values[1] - values[0], values[2] - values[1]
    if fine == 0.0 or coarse == 0.0:
        return math.nan
    ratio, sign = coarse / fine, math.copysign(1.0, coarse / fine)
    r21, r32 = sizes[1] / sizes[0], sizes[2] / sizes[1]

    def missed(p: float) -> float:
        spread = math.log((float(r21**p) - sign) / (float(r32**p) - sign))
        return abs(math.log(abs(ratio)) + spread) - p * math.log(r21)

    low, high = _ORDERS
    if missed(low) * missed(high) > 0.0:
        return math.nan
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if missed(low) * missed(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def extrapolated(fine: float, coarse: float, ratio: float, order: float) -> float:
    """Returns the value extrapolated from two meshes; ``ratio``: ratio of their element sizes, above 1."""
    return fine + (fine - coarse) / (float(ratio**order) - 1.0)


def grid_convergence_index(fine: float, coarse: float, ratio: float, order: float, safety: float = SAFETY) -> float:
    """Returns the relative uncertainty of the value on the fine mesh, at 95 % (Celik and others, eq. 7)."""
    return safety * abs((fine - coarse) / fine) / (float(ratio**order) - 1.0)


def fitted(sizes: Sequence[float], values: Sequence[float], order: float | None = None) -> Fit:
    """Returns the curve through three or more meshes, found by least squares with the weights 1 / h. ``order``
    prescribes the order of the curve.
    """
    if order is not None:
        return _line(sizes, values, order)
    grid = [_ORDERS[0] * (_ORDERS[1] / _ORDERS[0]) ** (k / _SCAN) for k in range(_SCAN + 1)]
    best = min(range(len(grid)), key=lambda k: _line(sizes, values, grid[k]).deviation)
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, _SCAN)]
    for _ in range(_HALVINGS):
        a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        nearer = _line(sizes, values, a).deviation < _line(sizes, values, b).deviation
        low, high = (low, b) if nearer else (a, high)
    return _line(sizes, values, 0.5 * (low + high))


def _line(sizes: Sequence[float], values: Sequence[float], order: float) -> Fit:
    """Fits a straight line in h^order by weighted least squares."""
    weights = [1.0 / h for h in sizes]
    total = math.fsum(weights)
    x = [(h / max(sizes)) ** order for h in sizes]
    x_mean = math.fsum(w * a for w, a in zip(weights, x, strict=True)) / total
    f_mean = math.fsum(w * f for w, f in zip(weights, values, strict=True)) / total
    across = math.fsum(w * (a - x_mean) * (f - f_mean) for w, a, f in zip(weights, x, values, strict=True))
    along = math.fsum(w * (a - x_mean) ** 2 for w, a in zip(weights, x, strict=True))
    slope = across / along
    value = f_mean - slope * x_mean
    missed = math.fsum(w * (value + slope * a - f) ** 2 for w, a, f in zip(weights, x, values, strict=True))
    free = max(len(sizes) - 3, 1)
    deviation = math.sqrt(missed / total * len(sizes) / free)
    return Fit(value, slope / max(sizes) ** order, order, deviation)


def limit(sizes: Sequence[float], values: Sequence[float], floor: float = 0.0, formal: float = FORMAL) -> Limit:
    """Returns the limit of values on meshes with the element sizes ``sizes``. Differences of values up to ``floor`` are
    negligible.

    Monotone values with an order of at least 0.5 converge. The uncertainty of such values is 1.25 times the sum of the
    distance from the limit and the deviation of the curve. If the values do not converge, the uncertainty is three
    times their range.
    """
    order = sorted(range(len(sizes)), key=lambda k: sizes[k])
    sizes, values = [sizes[k] for k in order], [values[k] for k in order]
    if len(values) < 2 or not all(map(math.isfinite, values)):
        return Limit(Trend.UNKNOWN, values[0] if values else math.nan, math.nan)
    spread = max(values) - min(values)
    if spread <= floor:
        return Limit(Trend.SETTLED, values[0], max(spread, floor))
    if len(values) < 3:
        return Limit(Trend.UNKNOWN, values[0], CAUTION * spread)
    steps = [coarse - fine for fine, coarse in pairwise(values)]
    if all(step * steps[0] > 0.0 for step in steps):
        return _monotone(sizes, values, formal)
    shrinking = all(abs(fine) < abs(coarse) for fine, coarse in pairwise(steps))
    return Limit(Trend.OSCILLATES if shrinking else Trend.DIVERGES, values[0], CAUTION * spread)


def _monotone(sizes: Sequence[float], values: Sequence[float], formal: float) -> Limit:
    """Returns the limit of monotone values. If the observed order is above the formal order, it is reported, and the
    formal order is used for the extrapolation. If the observed order is above twice the formal order, the meshes are
    too coarse or too similar, and the safety factor is ``CAUTION``.
    """
    free = fitted(sizes, values)
    if free.order < SLOWEST:
        return Limit(Trend.DIVERGES, values[0], CAUTION * (max(values) - min(values)), free.order)
    used = free if free.order <= formal else fitted(sizes, values, formal)
    beside = abs(used.value + used.slope * sizes[0] ** used.order - values[0])
    spread = used.deviation if len(values) > 3 or used is not free else 0.0
    far = (SAFETY if free.order <= 2.0 * formal else CAUTION) * abs(used.value - values[0])
    return Limit(Trend.CONVERGES, used.value, far + spread + beside, free.order)
