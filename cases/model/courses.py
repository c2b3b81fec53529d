"""Factor of a load or of a prescribed motion as a function of time."""

from itertools import pairwise

from ..units import Ratio, Time

Course = tuple[tuple[Time, Ratio], ...]
"""A function of time: pairs of a time and a factor."""


def factor_at(course: Course, time: float) -> float:
    """Returns the factor at a time, s: linear between the pairs, constant before the first pair and after the last
    pair, 1 without pairs.
    """
    if not course or time <= course[0][0]:
        return course[0][1] if course else 1.0
    for (start, low), (end, high) in pairwise(course):
        if time <= end:
            return low + (high - low) * (time - start) / (end - start)
    return course[-1][1]


def extremes(course: Course) -> tuple[float, float]:
    """Returns the smallest and the largest factor."""
    factors = [factor for _, factor in course] or [1.0]
    return min(factors), max(factors)
