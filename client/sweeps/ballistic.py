"""The curve through the points of an adaptive sweep: residual over impact velocity, or a line; with scipy."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from .bracket import Bracket, Sample

_FREE, _FIXED = 4, 3
"""Points from which on the exponent is fitted, too, and from which on the other two constants are: one more than these,
for an error."""
_NEAREST = 4
"""Points through which a line is drawn. Chosen: so near to the root that the curve between them is one."""
_EXPONENT = 1.0, 6.0
"""Bounds of p. Chosen: energies that add up make 2, long rods at high speed have up to 5 (Lambert and Jonas 1976)."""
_STOPPED = 0.2
"""Of the largest residual velocity: what is left before the limit is less. Chosen: a rebound has a few per cent."""


class Fit(msgspec.Struct, kw_only=True, frozen=True):
    """A curve and where it begins, or passes the threshold: ``limit`` with its standard ``error``, in the unit of x."""

    law: str
    limit: float
    error: float | None
    """None where there are no more points than constants."""
    points: int
    factor: float
    """a of the law, or the slope of the line."""
    exponent: float | None = None
    """p of the law."""


def stops(samples: Sequence[Sample], found: Bracket, threshold: float) -> bool:
    """Whether the result is a residual velocity: next to nothing on the side of the smaller velocities."""
    before, beyond = _sides(samples, found, threshold)
    return found.changes == 1 and max(y for _, y in before) <= _STOPPED * max(y for _, y in beyond)


def residual_velocity(samples: Sequence[Sample], found: Bracket, threshold: float) -> Fit | None:
    """v_r = a (v^p - v_bl^p)^(1/p) through the points beyond the limit (Lambert and Jonas, BRL R-1828, 1976; with
    p = 2 Recht and Ipson, J. Appl. Mech. 30, 1963, where a is the share of the masses).

    Velocities may count below zero: magnitudes are fitted. None for too few points, or without scipy.
    """
    x, y = zip(*_sides(samples, found, threshold)[1], strict=True)
    return None if len(x) < _FIXED else _lambert_jonas(x, y) if len(x) >= _FREE else _recht_ipson(x, y)


def _sides(
    samples: Sequence[Sample], found: Bracket, threshold: float
) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Magnitudes of key and result at the points before the bracket and beyond it, its ends among them."""
    known = sorted((abs(s.x), abs(s.f + threshold)) for s in samples if s.f is not None)
    low, high = sorted((abs(found.low.x), abs(found.high.x)))
    return [each for each in known if each[0] <= low], [each for each in known if each[0] >= high]


def _lambert_jonas(x: Sequence[float], y: Sequence[float]) -> Fit | None:
    def curve(v: Any, limit: float, a: float, p: float) -> Any:
        return a * (v**p - limit**p).clip(0.0) ** (1.0 / p)

    bounds = [0.0, 0.1, _EXPONENT[0]], [x[1], 2.0, _EXPONENT[1]]
    made = _fitted(curve, x, y, [0.98 * x[0], 1.0, 2.0], bounds)
    if made is None:
        return None
    (limit, a, p), errors = made
    return Fit(law="Lambert and Jonas", limit=limit, error=errors[0], points=len(x), factor=a, exponent=p)


def _recht_ipson(x: Sequence[float], y: Sequence[float]) -> Fit | None:
    def curve(v: Any, limit: float, a: float) -> Any:
        return a * (v**2 - limit**2).clip(0.0) ** 0.5

    made = _fitted(curve, x, y, [0.98 * x[0], 1.0], ([0.0, 0.1], [x[1], 2.0]))
    if made is None:
        return None
    (limit, a), errors = made
    return Fit(law="Recht and Ipson", limit=limit, error=errors[0], points=len(x), factor=a, exponent=2.0)


def line(samples: Sequence[Sample], found: Bracket) -> Fit | None:
    """The line through the points nearest to where the threshold is passed; None without scipy, or two points."""
    centre = 0.5 * (found.low.x + found.high.x)
    known = sorted((s for s in samples if s.f is not None), key=lambda s: abs(s.x - centre))[:_NEAREST]
    x, y = zip(*sorted((s.x, s.f) for s in known), strict=True)
    assert found.low.f is not None
    assert found.high.f is not None
    slope = (found.high.f - found.low.f) / found.width
    made = _fitted(lambda v, root, a: a * (v - root), x, y, [centre, slope])
    if made is None:
        return None
    (root, a), errors = made
    return Fit(law="line", limit=root, error=errors[0], points=len(x), factor=a)


def _fitted(
    curve: Callable[..., Any], x: Sequence[float], y: Sequence[float], start: Sequence[float],
    bounds: tuple[Sequence[float], Sequence[float]] | None = None,
) -> tuple[list[float], list[float | None]] | None:  # fmt: skip
    """Constants and their standard errors by least squares; None where that does not converge."""
    try:
        import numpy as np
        from scipy.optimize import OptimizeWarning, curve_fit
    except ImportError:
        return None
    import warnings

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", OptimizeWarning)
            limits: dict[str, Any] = {} if bounds is None else {"bounds": bounds}
            values, covariance = curve_fit(curve, np.array(x), np.array(y), p0=start, maxfev=20_000, **limits)
    except (RuntimeError, ValueError):
        return None
    spread = [math.sqrt(abs(v)) for v in np.diag(covariance)]
    enough = len(x) > len(values)
    return [float(v) for v in values], [s if enough and math.isfinite(s) else None for s in spread]
