"""Sine and cosine to the last bit: those of the C library differ between processors, and digests with them."""

from decimal import Context, Decimal

import numpy as np
import numpy.typing as npt

_DIGITS = Context(prec=60)
"""More than a float64 needs after terms as large as those of some turns have cancelled."""
_SMALL = Decimal("1e-40")
"""Terms from here on change no float64."""


def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Of a finite ``angle``, radians, of at most some turns: the power series in decimals, then rounded."""
    x = Decimal(angle)
    sums, term, k = [Decimal(0), Decimal(1)], Decimal(1), 0
    while _DIGITS.abs(term) > _SMALL:
        k += 1
        term = _DIGITS.divide(_DIGITS.multiply(term, x), Decimal(k))
        sums[1 - k % 2] = _DIGITS.add(sums[1 - k % 2], term if k % 4 < 2 else _DIGITS.minus(term))
    return float(sums[0]), float(sums[1])


def sines_and_cosines(angles: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Of many, in their shape."""
    some, which = np.unique(angles, return_inverse=True)
    parts = np.array([sine_and_cosine(angle) for angle in some.tolist()]).reshape(-1, 2)
    return parts[which, 0].reshape(angles.shape), parts[which, 1].reshape(angles.shape)
