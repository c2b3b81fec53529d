r"""Internal forces of the four-node tetrahedron, in integer quanta, and the sums of these forces at the nodes.

::

    f_a = -V stress grad N_a = -stress b_a,   a = 1, 2, 3        f_0 = -(f_1 + f_2 + f_3), exactly, in quanta
"""

import numpy as np

from ..kernels.jit import njit
from ..materials.elementary import NEAREST
from ..model.rows import PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ, VISCOUS
from ..model.state import CHUNK
from . import corners
from .corners import FOUR
from .scratch import EDGE

_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_P, _Q = PRESSURE * CHUNK, VISCOUS * CHUNK
_NEAREST_BITS = 0x4338000000000000
"""Bit pattern of the float64 NEAREST."""
MAGNITUDE = 0x7FFFFFFFFFFFFFFF
"""Mask that removes the sign bit of a float64. Read as integers, the masked bit patterns have the order of the absolute
values, and NaN is larger than all numbers."""


@njit("int64(float64)", cache=True, error_model="numpy", forceinline=True)
def _whole(x):  # type: ignore[no-untyped-def]
    """Returns the integer nearest to x, |x| < 2^51. If two integers are equally near, the even one is returned. The
    integer is read from the last bits of a sum, because many processors have no instruction that converts a vector of
    float64 to integers.
    """
    return np.float64(x + NEAREST).view(np.int64) - _NEAREST_BITS


@njit("UniTuple(int64, 3)(float64, float64, float64, float64)", cache=True, error_model="numpy")
def quanta(a, b, c, scale):  # type: ignore[no-untyped-def]
    """Returns three numbers in quanta of 1 / ``scale``, rounded to the nearest integer; the result is undefined for
    numbers above fixed_point.CONTRIBUTION_BITS."""
    return _whole(a * scale), _whole(b * scale), _whole(c * scale)


@njit("int64(float64, float64, float64)", cache=True, error_model="numpy")
def largest_of(a, b, c):  # type: ignore[no-untyped-def]
    """Returns the bit pattern of the largest magnitude of three numbers. NaN is larger than all numbers."""
    return max(
        max(np.float64(a).view(np.int64) & MAGNITUDE, np.float64(b).view(np.int64) & MAGNITUDE),
        np.float64(c).view(np.int64) & MAGNITUDE,
    )


@njit("int64(int64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def internal_forces(wi, w, s, n, scale):  # type: ignore[no-untyped-def]
    """Sets nine rows to the forces -V stress grad N on nodes 1, 2, 3, in quanta of 1 / ``scale`` N. Returns the largest
    force as its bit pattern (integer).

    ``scatter_forces`` adds minus the sum of these forces to node 0.
    """
    peak = 0
    for i in range(n):
        pressure = s[_P + i] + s[_Q + i]
        sxx, syy, szz = pressure - s[_SXX + i], pressure - s[_SYY + i], pressure - s[_SZZ + i]
        syz, szx, sxy = -s[_SYZ + i], -s[_SZX + i], -s[_SXY + i]
        b1x, b1y, b1z = w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i]
        b2x, b2y, b2z = w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i]
        b3x, b3y, b3z = w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i]
        f1x, f1y, f1z = (
            sxx * b1x + sxy * b1y + szx * b1z,
            sxy * b1x + syy * b1y + syz * b1z,
            szx * b1x + syz * b1y + szz * b1z,
        )
        f2x, f2y, f2z = (
            sxx * b2x + sxy * b2y + szx * b2z,
            sxy * b2x + syy * b2y + syz * b2z,
            szx * b2x + syz * b2y + szz * b2z,
        )
        f3x, f3y, f3z = (
            sxx * b3x + sxy * b3y + szx * b3z,
            sxy * b3x + syy * b3y + syz * b3z,
            szx * b3x + syz * b3y + szz * b3z,
        )
        wi[i], wi[CHUNK + i], wi[2 * CHUNK + i] = quanta(f1x, f1y, f1z, scale)
        wi[3 * CHUNK + i], wi[4 * CHUNK + i], wi[5 * CHUNK + i] = quanta(f2x, f2y, f2z, scale)
        wi[6 * CHUNK + i], wi[7 * CHUNK + i], wi[8 * CHUNK + i] = quanta(f3x, f3y, f3z, scale)
        first, second, third = largest_of(f1x, f1y, f1z), largest_of(f2x, f2y, f2z), largest_of(f3x, f3y, f3z)
        peak = max(peak, max(max(first, second), third))
    return peak


@njit("void(int64[:, ::1], int64[::1], uint32[:, ::1], int64)", cache=True)
def scatter_forces(force, wi, tets, n):  # type: ignore[no-untyped-def]
    """Adds the forces, in quanta, to the nodal sums (nodes, 4). Node 0 gets minus the sum of the other three forces, so
    that the four forces of a tet add up to exactly zero.
    """
    whole = n // FOUR * FOUR
    for i in range(0, whole, FOUR):
        corners.add_forces(force, wi, tets, i)
    for i in range(whole, n):
        a, b, c, d = tets[i, 0], tets[i, 1], tets[i, 2], tets[i, 3]
        for k in range(3):
            f1, f2, f3 = wi[k * CHUNK + i], wi[(3 + k) * CHUNK + i], wi[(6 + k) * CHUNK + i]
            force[b, k] += f1
            force[c, k] += f2
            force[d, k] += f3
            force[a, k] -= f1 + f2 + f3
