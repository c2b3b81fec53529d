"""Ensembles of runs of a scene that is sensitive to small changes: mean, deviation, and significance of differences."""

import math
from dataclasses import dataclass
from statistics import NormalDist, fmean, stdev

CONFIDENCE, POWER = 0.95, 0.8
"""Significance level and power of statistical tests (chosen values: usual in experiments)."""
_NORMAL = NormalDist()


@dataclass(frozen=True)
class Sample:
    """Values of one quantity for the members of an ensemble."""

    values: tuple[float, ...]

    @property
    def mean(self) -> float:
        """Mean of the members."""
        return fmean(self.values)

    @property
    def deviation(self) -> float:
        """Standard deviation of the members; 0 for a single member."""
        return stdev(self.values) if len(self.values) > 1 else 0.0

    @property
    def error(self) -> float:
        """Standard error of the mean of the members."""
        return self.deviation / math.sqrt(len(self.values))


def perturbations(members: int, least: float = 1e-3, most: float = 1e-2) -> list[float]:
    """Returns the fraction by which the time steps of each member are shorter: 0 for the first member, then
    ``least`` to ``most``, evenly spaced in the logarithm.
    """
    last = max(members - 2, 1)
    return [0.0, *(least * (most / least) ** (k / last) for k in range(members - 1))][:members]


def runs_needed(deviation: float, difference: float, confidence: float = CONFIDENCE, power: float = POWER) -> int:
    """Returns the number of members that each of two ensembles needs, so that a difference of their means is detected.

    2 ((z_a + z_b) s / d)^2 + z_a^2 / 4, two-sided (Guenther, The American Statistician 35 (1981) 243).
    """
    if deviation == 0.0:
        return 1
    if difference == 0.0:
        raise ValueError("a difference of 0 cannot be detected by any number of runs")
    a, b = _NORMAL.inv_cdf(0.5 + 0.5 * confidence), _NORMAL.inv_cdf(power)
    return max(2, math.ceil(2.0 * ((a + b) * deviation / difference) ** 2 + 0.25 * a * a))


def differ(a: Sample, b: Sample, confidence: float = CONFIDENCE) -> bool:
    """Returns True if two means differ significantly by Welch's test; single values differ if they are not equal."""
    variances = a.error**2, b.error**2
    if sum(variances) == 0.0:
        return a.mean != b.mean
    below = sum(v * v / (len(s.values) - 1) for v, s in zip(variances, (a, b), strict=True) if v > 0.0)
    free = sum(variances) ** 2 / below
    return abs(a.mean - b.mean) > student(0.5 + 0.5 * confidence, free) * math.sqrt(sum(variances))


def student(probability: float, free: float) -> float:
    """Returns the quantile of Student's t distribution: exact up to two degrees of freedom, otherwise by Abramowitz
    and Stegun 26.7.5.
    """
    if free < 2.0:
        return math.tan(math.pi * (probability - 0.5))
    if free < 3.0:
        return (2.0 * probability - 1.0) / math.sqrt(2.0 * probability * (1.0 - probability))
    z = _NORMAL.inv_cdf(probability)
    g1 = (z**3 + z) / 4.0
    g2 = (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0
    g3 = (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0
    g4 = (79.0 * z**9 + 776.0 * z**7 + 1482.0 * z**5 - 1920.0 * z**3 - 945.0 * z) / 92160.0
    return z + g1 / free + g2 / free**2 + g3 / free**3 + g4 / free**4
