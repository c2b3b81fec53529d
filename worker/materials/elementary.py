"""Functions log and exp whose results are bit-identical on any processor; they are used in loops over a chunk that the
compiler vectorises.

The functions use only + - * / and the bit pattern of a float64 as an integer; these operations give the same result in
vector code and in scalar code, and no result depends on a C library. Derived in docs/theory/sums.md.
"""

import numpy as np

from ..kernels.jit import njit
from ..model.state import CHUNK

_LN2_HIGH, _LN2_LOW = 0.693147180369123816490, 1.90821492927058770002e-10
"""The number ln 2 as a sum of two float64, which together have 86 bits. The first of the two has 33 bits, so that its
product with an exponent is exact."""
_INVERSE_LN2 = 1.4426950408889634
"""The number 1 / ln 2."""
NEAREST = 6755399441055744.0
"""The number 1.5 * 2^52. If this number is added to a smaller number, the last bits of the sum contain the nearest
integer."""
_ROOT_HALF = 0x3FE6A09E667F3BCD
"""Bit pattern of sqrt(1/2). An argument is divided by a power of two such that the result is between sqrt(1/2) and
sqrt(2)."""
_WHOLE, _OFFSET, _BIASED = 0x4330000000000000, 4096, 4503599627374592.0
"""Constants that convert integers to float64: the bit pattern of 2^52, an offset that makes exponents positive, and the
sum of the two as a float64."""
LEAST, MOST = -700.0, 700.0
"""Range of arguments of ``exp`` in which the result is a normal number, 1e-304 to 1e304."""


@njit("float64(float64)", cache=True, error_model="numpy", forceinline=True)
def log(x):  # type: ignore[no-untyped-def]
    """Returns ln x of a positive normal number; relative error 4e-16.

    With x = 2^k f, f between sqrt(1/2) and sqrt(2), and s = (f - 1) / (f + 1), the logarithm is k ln 2 + 2 (s + s^3/3 +
    s^5/5 ...).
    """
    bits = np.float64(x).view(np.int64)
    k = (bits - _ROOT_HALF) >> 52
    f = np.int64(bits - (k << 52)).view(np.float64)
    exponent = np.int64((k + _OFFSET) | _WHOLE).view(np.float64) - _BIASED
    s = (f - 1.0) / (f + 1.0)
    z = s * s
    zz = z * z
    tail = z * (
        (1 / 3 + z * (1 / 5))
        + zz * ((1 / 7 + z * (1 / 9)) + zz * ((1 / 11 + z * (1 / 13)) + zz * ((1 / 15 + z * (1 / 17)) + zz * (1 / 19))))
    )
    return exponent * _LN2_HIGH + (2.0 * s + (2.0 * s * tail + exponent * _LN2_LOW))


@njit("UniTuple(float64, 2)(float64)", cache=True, error_model="numpy", forceinline=True)
def _reduced(x):  # type: ignore[no-untyped-def]
    """Returns k, as the last bits of a float64, and e^r - 1. Here r = x - k ln 2, and e^r - 1 is computed with 12
    terms.
    """
    shifted = x * _INVERSE_LN2 + NEAREST
    k = shifted - NEAREST
    r = (x - k * _LN2_HIGH) - k * _LN2_LOW
    r2 = r * r
    r4 = r2 * r2
    low = (1 / 2 + r * (1 / 6)) + r2 * (1 / 24 + r * (1 / 120))
    middle = (1 / 720 + r * (1 / 5040)) + r2 * (1 / 40320 + r * (1 / 362880))
    high = (1 / 3628800 + r * (1 / 39916800)) + r2 * (1 / 479001600 + r * (1 / 6227020800))
    return shifted, r + r2 * (low + r4 * (middle + r4 * high))


@njit("float64(float64, float64)", cache=True, error_model="numpy", forceinline=True)
def _doubled(x, shifted):  # type: ignore[no-untyped-def]
    """Returns 2^k x; the last bits of ``shifted`` contain k."""
    return np.int64(np.float64(x).view(np.int64) + (np.float64(shifted).view(np.int64) << 52)).view(np.float64)


@njit("float64(float64)", cache=True, error_model="numpy", forceinline=True)
def exp(x):  # type: ignore[no-untyped-def]
    """Returns e^x for x from LEAST to MOST, computed as 2^k e^r; relative error 3e-16."""
    shifted, grown = _reduced(x)
    return _doubled(1.0 + grown, shifted)


@njit("float64(float64)", cache=True, error_model="numpy")
def exp_less_one(x):  # type: ignore[no-untyped-def]
    """Returns e^x - 1 for x up to MOST, computed as 2^k (e^r - 1) + (2^k - 1), or -1 for x below LEAST; relative error
    4e-16.
    """
    if x < LEAST:
        return -1.0
    shifted, grown = _reduced(x)
    power = _doubled(1.0, shifted)
    return power * grown + (power - 1.0)


@njit("float64(float64, float64)", cache=True, error_model="numpy")
def power(x, exponent):  # type: ignore[no-untyped-def]
    """Returns x to the power ``exponent``, for a positive exponent. x must be zero or a positive normal number. The
    result is 0 for x = 0, and is limited to the range from e^LEAST to e^MOST for other x.
    """
    return exp(max(min(exponent * log(x), MOST), LEAST)) if x > 0.0 else 0.0


@njit("void(float64[::1], int64, int64)", cache=True, error_model="numpy")
def logarithms(w, row, n):  # type: ignore[no-untyped-def]
    """Replaces ``n`` numbers in the scratch memory, from ``row`` on, by their logarithms."""
    values = w[row : row + CHUNK]
    for i in range(n):
        values[i] = log(values[i])


@njit("void(float64[::1], int64, int64, float64)", cache=True, error_model="numpy")
def powers(w, row, n, exponent):  # type: ignore[no-untyped-def]
    """Replaces ``n`` logarithms in the scratch memory, from ``row`` on, by powers: exp(exponent * logarithm)."""
    values = w[row : row + CHUNK]
    for i in range(n):
        values[i] = exp(max(exponent * values[i], LEAST))
