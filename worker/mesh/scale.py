"""Conversion of coordinates into metres with a single rounding. A product with 0.001 would round twice, because 0.001
is not a binary fraction.
"""

from fractions import Fraction

from .model import Floats

_SPLITTER = 2.0**27 + 1.0
"""Factor that splits a float64 into two halves of 26 bits (Dekker 1971, Numer. Math. 18, 224)."""
_WHOLE = 2**53
"""Bound of integers that are exact as float64."""


def scaled(points: Floats, unit: float) -> Floats:
    """Return points in m from points in units of ``unit`` m. Each coordinate is multiplied by the decimal number of
    ``unit`` and rounded once.

    If the decimal number of ``unit`` is not a fraction of integers below 2^53, the product rounds twice.
    """
    exact = Fraction(repr(unit))
    n, d = exact.numerator, exact.denominator
    if max(n, d) >= _WHOLE:
        return points * unit
    if n == 1:
        return points / d
    if d == 1:
        return points * n
    high, low = _product(points, float(n))
    quotient = high / d
    back, more = _product(quotient, float(d))
    return quotient + (((high - back) - more) + low) / d


def _product(a: Floats, b: float) -> tuple[Floats, Floats]:
    """Return the rounded product and its exact rounding error (Dekker 1971)."""
    product, (a1, a2) = a * b, _halves(a)
    cut = _SPLITTER * b
    b1 = cut - (cut - b)
    b2 = b - b1
    return product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2


def _halves(a: Floats) -> tuple[Floats, Floats]:
    cut = _SPLITTER * a
    high = cut - (cut - a)
    return high, a - high
