"""Conversion of material constants of other codes to constants of Conoid."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

_STRAIGHT = 1e-6
"""Largest deviation of points from a straight line, relative to the largest stress (chosen value: above the rounding of
decks with six digits)."""


def young_of(bulk: float, shear: float) -> tuple[float, float]:
    """Returns Young's modulus and Poisson's ratio from bulk modulus K and shear modulus G: 9KG/(3K+G),
    (3K-2G)/(6K+2G).
    """
    return 9.0 * bulk * shear / (3.0 * bulk + shear), (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear)


def bulk_of(young: float, poisson: float) -> float:
    """Returns the bulk modulus, E / 3(1 - 2 nu). Raises ZeroDivisionError at nu = 0.5."""
    return young / (3.0 * (1.0 - 2.0 * poisson))


def shear_of(young: float, poisson: float) -> float:
    """Returns the shear modulus, E / 2(1 + nu). Raises ZeroDivisionError at nu = -1."""
    return young / (2.0 * (1.0 + poisson))


def hardening_of(young: float, tangent: float) -> float:
    """Returns the plastic modulus, E Et / (E - Et), from the tangent modulus Et of the total strain. Raises
    ValueError if Et is not below Young's modulus E.
    """
    if not tangent < young:
        raise ValueError(f"the tangent modulus {tangent:g} is not below Young's modulus {young:g}")
    return young * tangent / (young - tangent)


def line_of(points: Sequence[tuple[float, float]]) -> tuple[float, float] | None:
    """Returns yield stress and hardening modulus of a curve of points (plastic strain, stress); None unless all points
    lie on one straight line that begins at strain 0. One single point means a constant flow stress.
    """
    if not points or points[0][0] != 0.0 or any(a[0] >= b[0] for a, b in pairwise(points)):
        return None
    (_, first), (end, last) = points[0], points[-1]
    slope = float((_exact(last) - _exact(first)) / _exact(end)) if len(points) > 1 else 0.0
    near = _STRAIGHT * max(abs(stress) for _, stress in points)
    return (first, slope) if all(abs(first + slope * e - stress) <= near for e, stress in points) else None


def _exact(number: float) -> Fraction:
    """Returns the exact decimal number that the deck has, so that 0.5 - 0.4 is 0.1."""
    return Fraction(repr(float(number)))
