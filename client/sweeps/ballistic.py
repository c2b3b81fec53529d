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
_COURSE = 60
"""Places along a curve that is drawn. Chosen: a chart has some hundred pixels."""
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
    scale: float = 1.0
    """The unit of x in that of the result, for a law of velocities."""
    covariance: tuple[tuple[float, ...], ...] = ()
    """Of ``limit``, ``factor`` and, where it is fitted, ``exponent``; empty without an ``error``."""


def stops(samples: Sequence[Sample], found: Bracket, threshold: float) -> bool:
    """Whether the result is a residual velocity: next to nothing on the side of the smaller velocities."""
    before, beyond = _sides(samples, found, threshold)
    return found.changes == 1 and max(y for _, y in before) <= _STOPPED * max(y for _, y in beyond)


def residual_velocity(samples: Sequence[Sample], found: Bracket, threshold: float, scale: float = 1.0) -> Fit | None:
    """v_r = a (v^p - v_bl^p)^(1/p) through the points beyond the limit (Lambert and Jonas, BRL R-1828, 1976; with
    p = 2 Recht and Ipson, J. Appl. Mech. 30, 1963, where a is the share of the masses).

    Velocities may count below zero: magnitudes are fitted. ``scale`` is the unit of x in that of the result. None for
    too few points, or without scipy.
    """
    x, y = zip(*_sides(samples, found, threshold)[1], strict=True)
    if len(x) < _FIXED:
        return None
    made = (_lambert_jonas if len(x) >= _FREE else _recht_ipson)([scale * v for v in x], y)
    return made and _in_unit(made, scale)


def _in_unit(fit: Fit, scale: float) -> Fit:
    """With the limit in the unit of x; a has none."""
    worth = [1.0 / scale, 1.0, 1.0]
    spread = tuple(tuple(v * worth[n] * worth[k] for k, v in enumerate(row)) for n, row in enumerate(fit.covariance))
    return msgspec.structs.replace(
        fit, scale=scale, limit=fit.limit / scale, error=fit.error and fit.error / scale, covariance=spread
    )


def _sides(
    samples: Sequence[Sample], found: Bracket, threshold: float
) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Magnitudes of key and result at the points before the bracket and beyond it, its ends among them."""
    known = sorted((abs(s.x), abs(s.f + threshold)) for s in samples if s.f is not None)
    low, high = sorted((abs(found.low.x), abs(found.high.x)))
    return [each for each in known if each[0] <= low], [each for each in known if each[0] >= high]


def _lambert_jonas(x: Sequence[float], y: Sequence[float]) -> Fit | None:
    bounds = [0.0, 0.1, _EXPONENT[0]], [x[1], 2.0, _EXPONENT[1]]
    return _fitted("Lambert and Jonas", _left, x, y, [0.98 * x[0], 1.0, 2.0], bounds)


def _recht_ipson(x: Sequence[float], y: Sequence[float]) -> Fit | None:
    return _fitted("Recht and Ipson", _left, x, y, [0.98 * x[0], 1.0], ([0.0, 0.1], [x[1], 2.0]), 2.0)


def _left(v: Any, limit: float, a: float, p: float = 2.0) -> Any:
    return a * (v**p - limit**p).clip(0.0) ** (1.0 / p)


def _straight(v: Any, root: float, a: float) -> Any:
    return a * (v - root)


def line(samples: Sequence[Sample], found: Bracket) -> Fit | None:
    """The line through the points nearest to where the threshold is passed; None without scipy, or two points."""
    centre = 0.5 * (found.low.x + found.high.x)
    known = sorted((s for s in samples if s.f is not None), key=lambda s: abs(s.x - centre))[:_NEAREST]
    x, y = zip(*sorted((s.x, s.f) for s in known), strict=True)
    assert found.low.f is not None
    assert found.high.f is not None
    slope = (found.high.f - found.low.f) / found.width
    return _fitted("line", _straight, x, y, [centre, slope])


def course(fit: Fit, low: float, high: float) -> list[tuple[float, float, float | None]]:
    """x, value and its standard error along the curve, from ``low`` to ``high``: magnitudes for velocities, distances
    from the threshold for a line. The error follows from the covariance by the derivatives at the constants; None
    next to the limit, where a law of velocities is so steep that the error is larger than the value.
    """
    import numpy as np

    x = np.unique(np.append(np.linspace(low, high, _COURSE), fit.limit))
    x = x[x >= fit.limit] if fit.law != "line" else x
    curve = _straight if fit.law == "line" else _left
    constants = [fit.limit, fit.factor, *([fit.exponent] if fit.exponent is not None else [])]
    y = fit.scale * curve(x, *constants)
    if not fit.covariance:
        return [(float(a), float(b), None) for a, b in zip(x, y, strict=True)]
    slopes = np.array([_slope(curve, x, constants, n) for n in range(len(fit.covariance))])
    error = fit.scale * np.sqrt(np.clip(np.sum(slopes * (np.array(fit.covariance) @ slopes), axis=0), 0.0, None))
    known = [None if fit.law != "line" and c >= b else float(c) for b, c in zip(y, error, strict=True)]
    return [(float(a), float(b), c) for a, b, c in zip(x, y, known, strict=True)]


def _slope(curve: Callable[..., Any], x: Any, constants: Sequence[float], n: int) -> Any:
    """The derivative of a curve by its constant ``n``."""
    step = 1e-6 * (abs(constants[n]) or 1.0)
    up, down = ([c + (k == n) * way * step for k, c in enumerate(constants)] for way in (1, -1))
    return (curve(x, *up) - curve(x, *down)) / (2.0 * step)


def _fitted(
    law: str, curve: Callable[..., Any], x: Sequence[float], y: Sequence[float], start: Sequence[float],
    bounds: tuple[Sequence[float], Sequence[float]] | None = None, exponent: float | None = None,
) -> Fit | None:  # fmt: skip
    """The constants by least squares, ``exponent`` where it is not one of them; None where that does not converge."""
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
    known = len(x) > len(values) and bool(np.isfinite(covariance).all())
    limit, factor, *more = map(float, values)
    return Fit(
        law=law, limit=limit, error=math.sqrt(abs(covariance[0][0])) if known else None, points=len(x), factor=factor,
        exponent=more[0] if more else exponent, covariance=tuple(map(tuple, covariance.tolist())) if known else (),
    )  # fmt: skip
