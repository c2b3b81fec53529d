"""Hyperelastic shear of materials without a strength law. The deviatoric stress has a potential, so that its energy is
conserved.

The potential is W = V0 G/4 (tr b + tr b^-1 - 6), with b = J^(-2/3) F F^T; it is the Mooney-Rivlin form with equal
constants. Up to the fourth order in strain it is equal to Hencky's potential, G (ln V : ln V). Derived in
docs/theory/materials.md.
"""

import numpy as np

from ..elements.scratch import EDGE, MODULUS, MOVED, RATE, TRIAL, VOLUME
from ..kernels.jit import njit
from ..model.rows import DISTORTION, MASS, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ, TET_VOLUME, WORK
from ..model.state import CHUNK
from .law import DENSITY, FROM_SHAPE, SHEAR, Law

_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_WORK, _MASS, _DISTORTION = WORK * CHUNK, MASS * CHUNK, DISTORTION * CHUNK
_THIRD = 1.0 / 3.0
_ONE = 0x3FF0000000000000
"""Bit pattern of 1.0."""
# Scratch rows of this law. They are the rows of rate of deformation and spin, which this law does not need.
_AXX, _AYY, _AZZ, _AYZ, _AZX, _AXY = (RATE + k * CHUNK for k in range(6))
_MORE, _LESS, _HALF_SHEAR, _K = RATE + 6 * CHUNK, RATE + 7 * CHUNK, RATE + 8 * CHUNK, TRIAL


@njit("float64(float64)", cache=True, error_model="numpy", forceinline=True)
def inverse_sixth_root(u):  # type: ignore[no-untyped-def]
    """Returns u^(-1/6), accurate to round-off for u from 1e-24 to 1e24. The formula y (1 - r)^(-1/6), 1 - r = u y^6, is
    applied three times, as a power series.

    The computation uses only + - * and the bit pattern of a float64 as an integer, with equal results in vector code
    and in scalar code; it uses no root and no quotient, because each of them takes as long as ten products. The bit
    pattern is a piecewise linear logarithm; the first y is found by shifts: a sixth of the distance from the bit
    pattern of 1. The first y is exact at u = 1.
    """
    far = np.float64(u).view(np.int64) - _ONE
    y = np.int64(_ONE - ((far >> 3) + (far >> 5) + (far >> 7) + (far >> 9) + (far >> 11))).view(np.float64)
    for _ in range(3):
        square = y * y
        r = 1.0 - u * (square * square * square)
        y += y * (r * (1 / 6 + r * (7 / 72 + r * (91 / 1296))))
    return y


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def _strains(w, n):  # type: ignore[no-untyped-def]
    """Sets rows of two quantities: A = F^-T F^-1 - 1 = K^T K - K - K^T, with K = du/dx = sum over nodes of u_a b_a / V;
    and det(1 + A) - 1.
    """
    for i in range(n):
        b1x, b1y, b1z = w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i]
        b2x, b2y, b2z = w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i]
        b3x, b3y, b3z = w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i]
        u1x, u1y, u1z = w[MOVED + i], w[MOVED + CHUNK + i], w[MOVED + 2 * CHUNK + i]
        u2x, u2y, u2z = w[MOVED + 3 * CHUNK + i], w[MOVED + 4 * CHUNK + i], w[MOVED + 5 * CHUNK + i]
        u3x, u3y, u3z = w[MOVED + 6 * CHUNK + i], w[MOVED + 7 * CHUNK + i], w[MOVED + 8 * CHUNK + i]
        r = 1.0 / w[VOLUME + i]
        kxx, kxy = r * (u1x * b1x + u2x * b2x + u3x * b3x), r * (u1x * b1y + u2x * b2y + u3x * b3y)
        kxz, kyx = r * (u1x * b1z + u2x * b2z + u3x * b3z), r * (u1y * b1x + u2y * b2x + u3y * b3x)
        kyy, kyz = r * (u1y * b1y + u2y * b2y + u3y * b3y), r * (u1y * b1z + u2y * b2z + u3y * b3z)
        kzx, kzy = r * (u1z * b1x + u2z * b2x + u3z * b3x), r * (u1z * b1y + u2z * b2y + u3z * b3y)
        kzz = r * (u1z * b1z + u2z * b2z + u3z * b3z)
        axx = (kxx * kxx + kyx * kyx + kzx * kzx) - 2.0 * kxx
        ayy = (kxy * kxy + kyy * kyy + kzy * kzy) - 2.0 * kyy
        azz = (kxz * kxz + kyz * kyz + kzz * kzz) - 2.0 * kzz
        ayz = (kxy * kxz + kyy * kyz + kzy * kzz) - (kyz + kzy)
        azx = (kxz * kxx + kyz * kyx + kzz * kzx) - (kzx + kxz)
        axy = (kxx * kxy + kyx * kyy + kzx * kzy) - (kxy + kyx)
        mxx, myy, mzz = ayy * azz - ayz * ayz, azz * axx - azx * azx, axx * ayy - axy * axy
        mzx, mxy = axy * ayz - ayy * azx, ayz * azx - azz * axy
        w[_MORE + i] = (axx + ayy + azz) + (mxx + myy + mzz) + (axx * mxx + axy * mxy + azx * mzx)
        w[_AXX + i], w[_AYY + i], w[_AZZ + i] = axx, ayy, azz
        w[_AYZ + i], w[_AZX + i], w[_AXY + i] = ayz, azx, axy


@njit("void(float64[::1], int64, float64)", cache=True, error_model="numpy")
def _roots(w, n, shear):  # type: ignore[no-untyped-def]
    """Sets the rows k = det(1 + A)^(-1/3), k - 1 without cancellation, and G / 2J. A separate loop computes these rows,
    so that the long chains of operations of several tets overlap.

    The result is NaN if the determinant is not positive because of round-off.
    """
    half = 0.5 * shear
    for i in range(n):
        more = w[_MORE + i]
        u = 1.0 + more
        root = inverse_sixth_root(u if u > 0.0 else np.nan)
        k = root * root
        inverse = k * root
        w[_LESS + i] = -more * (inverse * inverse) / (1.0 + k + k * k)
        w[_K + i] = k
        w[_HALF_SHEAR + i] = half * (u * inverse)


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def hyperelastic(w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Computes the deviatoric stress G / 2J dev(b - b^-1) of a chunk, Pa; the work of this stress is the change of its
    potential.

    ``w`` has V grad N at the end of the step, and from MOVED on the displacements. The stress is computed from A, and
    therefore from the displacement gradient, so that small strains keep their digits, and zero strain gives exactly
    zero stress. b^-1 = k (1 + A), so that b^-1 - 1 = k A + (k - 1). b is the adjugate of b^-1, because the determinant
    of b^-1 is one.
    """
    _strains(w, n)
    _roots(w, n, params[SHEAR])
    of_energy = 0.25 * params[SHEAR] / params[DENSITY]
    for i in range(n):
        axx, ayy, azz = w[_AXX + i], w[_AYY + i], w[_AZZ + i]
        ayz, azx, axy = w[_AYZ + i], w[_AZX + i], w[_AXY + i]
        mxx, myy, mzz = ayy * azz - ayz * ayz, azz * axx - azx * azx, axx * ayy - axy * axy
        myz, mzx, mxy = azx * axy - axx * ayz, axy * ayz - ayy * azx, ayz * azx - azz * axy
        k, less, g = w[_K + i], w[_LESS + i], w[_HALF_SHEAR + i]
        square = k * k
        own = square * (axx + ayy + azz) + (k + 1.0) * less
        excess = (
            (k * axx + less) * (square * (axx - mxx) - own)
            + (k * ayy + less) * (square * (ayy - myy) - own)
            + (k * azz + less) * (square * (azz - mzz) - own)
            + 2.0 * k * square * (ayz * (ayz - myz) + azx * (azx - mzx) + axy * (axy - mxy))
        )
        energy = of_energy * s[_MASS + i] * excess
        s[_WORK + i] += energy - s[_DISTORTION + i]
        s[_DISTORTION + i] = energy
        one, two = g * (k + square), g * square
        sxx, syy, szz = two * mxx - one * axx, two * myy - one * ayy, two * mzz - one * azz
        mean = (sxx + syy + szz) * _THIRD
        s[_SXX + i], s[_SYY + i], s[_SZZ + i] = sxx - mean, syy - mean, szz - mean
        s[_SYZ + i], s[_SZX + i], s[_SXY + i] = two * myz - one * ayz, two * mzx - one * azx, two * mxy - one * axy


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def stiffen(w, s, params, n):  # type: ignore[no-untyped-def]
    """Raises the row MODULUS from K + 4/3 G to an upper bound for a strained tet: K + 4/3 (G + 2 W / V0) / |J|.

    The bound is positive even for an inverted tet; limits.step_limit detects an inverted tet by its volume.
    """
    shear = params[SHEAR]
    of_mass = shear / params[DENSITY]
    for i in range(n):
        stiff = (of_mass * s[_MASS + i] + 2.0 * s[_DISTORTION + i]) / abs(w[VOLUME + i])
        w[MODULUS + i] += 4.0 * _THIRD * (stiff - shear)


LAW = Law("", FROM_SHAPE, lambda _: TET_VOLUME + 1, lambda _: (), lambda *_: {}, hyperelastic)
"""Law for materials that have no strength law."""
