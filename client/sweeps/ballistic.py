"""Curve through the points of an adaptive sweep: residual velocity over impact velocity, or a straight line. The fit
uses scipy.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from .bracket import Bracket, Sample

_FREE, FEWEST = 4, 3
"""Smallest number of points for a fit with a free exponent, and for a fit with a fixed exponent. Each number is one
more than the number of constants, so that the error can be estimated."""
_NEAREST = 4
"""Number of points for the fit of a line (chosen value: between the points nearest to the root the curve is nearly
straight)."""
_EXPONENT = 1.0, 6.0
"""Bounds of the exponent p; chosen values: an energy balance has p = 2, long rods at high speed have up to 5 (Lambert
and Jonas 1976)."""
_COURSE = 60
"""Number of points of a curve in a chart (chosen value: a chart is a few hundred pixels wide)."""
_AT_END = 1e-6
"""Relative distance of a constant from an end of its range below which the constant counts as being at this end (chosen
value: larger than the tolerance of the least squares)."""
_STOPPED = 0.2
"""Largest residual velocity below the ballistic limit, relative to the largest residual velocity (chosen value: a
rebound has a few per cent)."""


class Fit(msgspec.Struct, kw_only=True, frozen=True):
    """A fitted curve. ``limit`` is the velocity at which the curve begins, or the x at which a line crosses the
    threshold. ``error`` is the standard error of the limit. ``limit`` and ``error`` have the unit of x.
    """

    law: str
    limit: float
    error: float | None
    """Standard error of ``limit``; None if there are not more points than constants."""
    points: int
    factor: float
    """Constant a of the law, or slope of the line."""
    exponent: float | None = None
    """Exponent p of the law; None for a line."""
    scale: float = 1.0
    """Value of the unit of x in the unit of the result, for a law of velocities."""
    covariance: tuple[tuple[float, ...], ...] = ()
    """Covariance of ``limit``, ``factor`` and, if fitted, ``exponent``; empty if ``error`` is None."""


def stops(samples: Sequence[Sample], found: Bracket, threshold: float) -> bool:
    """Returns True if the result is a residual velocity: it is nearly zero at impact velocities below the bracket."""
    before, beyond = _sides(samples, found, threshold)
    return found.changes == 1 and max(y for _, y in before) <= _STOPPED * max(y for _, y in beyond)


def beyond(samples: Sequence[Sample], found: Bracket, threshold: float) -> int:
    """Returns the number of points from the upper end of the bracket on, to which a law of velocities is fitted."""
    return len(_sides(samples, found, threshold)[1])


def residual_velocity(samples: Sequence[Sample], found: Bracket, threshold: float, scale: float = 1.0) -> Fit | None:
    """Fits v_r = a (v^p - v_bl^p)^(1/p) to the points above the limit (Lambert and Jonas, BRL R-1828, 1976). With p = 2
    this is the law of Recht and Ipson (J. Appl. Mech. 30, 1963), in which a is the mass of the projectile over the sum
    of the masses of projectile and plug.

    v is the impact velocity, v_r the residual velocity, v_bl the ballistic limit. Velocities may be negative,
    because magnitudes are fitted. ``scale``: value of the unit of x in the unit of the result. Returns None for too
    few points, without scipy, and if a fitted constant lies at an end of its range, because such points do not
    follow the law.
    """
    x, y = zip(*_sides(samples, found, threshold)[1], strict=True)
    if len(x) < FEWEST:
        return None
    made = (_lambert_jonas if len(x) >= _FREE else _recht_ipson)([scale * v for v in x], y)
    return made and _in_unit(made, scale)


def _in_unit(fit: Fit, scale: float) -> Fit:
    """Returns the fit with ``limit``, ``error`` and covariance in the unit of x. The factor a has no unit."""
    worth = [1.0 / scale, 1.0, 1.0]
    spread = tuple(tuple(v * worth[n] * worth[k] for k, v in enumerate(row)) for n, row in enumerate(fit.covariance))
    return msgspec.structs.replace(
        fit, scale=scale, limit=fit.limit / scale, error=fit.error and fit.error / scale, covariance=spread
    )


def _sides(
    samples: Sequence[Sample], found: Bracket, threshold: float
) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Returns the magnitudes of key and result: first for the points up to the lower end of the bracket, then for
    the points from its upper end on.
    """
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
    """Fits a straight line to the points nearest to the bracket. Returns None if the fit fails or scipy is not
    installed.
    """
    centre = 0.5 * (found.low.x + found.high.x)
    known = sorted((s for s in samples if s.f is not None), key=lambda s: abs(s.x - centre))[:_NEAREST]
    x, y = zip(*sorted((s.x, s.f) for s in known), strict=True)
    assert found.low.f is not None
    assert found.high.f is not None
    slope = (found.high.f - found.low.f) / found.width
    return _fitted("line", _straight, x, y, [centre, slope])


def course(fit: Fit, low: float, high: float) -> list[tuple[float, float, float | None]]:
    """Returns x, value and standard error of the value along the curve from ``low`` to ``high``.

    For a law of velocities the values are magnitudes, for a line distances from the threshold. The standard error is
    computed from the covariance and from the derivatives with respect to the constants. A law of velocities is steep
    near its limit; where the standard error exceeds the value, None is returned for the error.
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
    """Returns the derivative of a curve with respect to its constant number ``n``, by central differences."""
    step = 1e-6 * (abs(constants[n]) or 1.0)
    up, down = ([c + (k == n) * way * step for k, c in enumerate(constants)] for way in (1, -1))
    return (curve(x, *up) - curve(x, *down)) / (2.0 * step)


def _fitted(
    law: str, curve: Callable[..., Any], x: Sequence[float], y: Sequence[float], start: Sequence[float],
    bounds: tuple[Sequence[float], Sequence[float]] | None = None, exponent: float | None = None,
) -> Fit | None:  # fmt: skip
    """Fits the constants of a curve by least squares. ``exponent``: exponent of a law whose exponent is fixed.
    Returns None if the fit does not converge.
    """
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
    if bounds is not None and _at_end(values, bounds):
        return None
    known = len(x) > len(values) and bool(np.isfinite(covariance).all())
    limit, factor, *more = map(float, values)
    return Fit(
        law=law, limit=limit, error=math.sqrt(abs(covariance[0][0])) if known else None, points=len(x), factor=factor,
        exponent=more[0] if more else exponent, covariance=tuple(map(tuple, covariance.tolist())) if known else (),
    )  # fmt: skip


def _at_end(values: Any, bounds: tuple[Sequence[float], Sequence[float]]) -> bool:
    """True if a fitted constant lies at an end of its range."""
    return any(
        math.isclose(v, end, rel_tol=_AT_END, abs_tol=_AT_END)
        for ends in bounds
        for v, end in zip(values, ends, strict=True)
    )
