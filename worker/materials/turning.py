"""Sine and cosine, correct to the last bit. The functions of C libraries differ between processors, so digests of runs
would differ, too.
"""

from decimal import Context, Decimal

import numpy as np
import numpy.typing as npt

_DIGITS = Context(prec=60)
"""Number of decimal digits in the computation; it is more than a float64 needs after the cancellation of terms for an
angle of a whole turn."""
_MANY = Context(prec=120)
"""Number of additional decimal digits: as many as the largest angle of a case has before the decimal point."""
_SMALL = Decimal("1e-40")
"""Size of a term of a power series. A smaller term no longer changes a float64."""


def _arc_tangent(n: int) -> Decimal:
    """Returns the arc tangent of 1 / n."""
    total, power, k = Decimal(0), _MANY.divide(Decimal(1), Decimal(n)), 1
    while power > Decimal(f"1e-{_MANY.prec}"):
        term = _MANY.divide(power, Decimal(k if k % 4 == 1 else -k))
        total, power, k = _MANY.add(total, term), _MANY.divide(power, Decimal(n * n)), k + 2
    return total


_TURN = _MANY.subtract(_MANY.multiply(Decimal(32), _arc_tangent(5)), _MANY.multiply(Decimal(8), _arc_tangent(239)))
"""The number 2 pi, computed by Machin's formula."""


def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Returns sine and cosine of an ``angle``, radians, below 1e60. The function subtracts whole turns from the angle,
    sums power series in decimals, and rounds the sums.
    """
    x = _MANY.remainder(Decimal(angle), _TURN)
    sums, term, k = [Decimal(0), Decimal(1)], Decimal(1), 0
    while _DIGITS.abs(term) > _SMALL:
        k += 1
        term = _DIGITS.divide(_DIGITS.multiply(term, x), Decimal(k))
        sums[1 - k % 2] = _DIGITS.add(sums[1 - k % 2], term if k % 4 < 2 else _DIGITS.minus(term))
    return float(sums[0]), float(sums[1])


def sines_and_cosines(angles: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Returns sines and cosines of an array of angles, in the shape of the array."""
    some, which = np.unique(angles, return_inverse=True)
    parts = np.array([sine_and_cosine(angle) for angle in some.tolist()]).reshape(-1, 2)
    return parts[which, 0].reshape(angles.shape), parts[which, 1].reshape(angles.shape)
