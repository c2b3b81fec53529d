"""Elastic shear of a material without a strength: the deviatoric stress has a potential, so it keeps its energy.

W = V0 G/4 (tr b + tr b^-1 - 6), b = J^(-2/3) F F^T: the Mooney-Rivlin form with equal constants, which to the fourth
order in strain is Hencky's, G (ln V : ln V). Derived in docs/numerics.md.
"""

import numpy as np

from ..elements.tet4 import EDGE, MODULUS, RATE, REFERENCE, SEEN, TRIAL, VOLUME
from ..jit import njit
from ..state import CHUNK, DISTORTION, MASS, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ, WORK
from .law import DENSITY, FROM_SHAPE, SHEAR, Law

_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_WORK, _MASS, _DISTORTION = WORK * CHUNK, MASS * CHUNK, DISTORTION * CHUNK
_THIRD, _SIXTH = 1.0 / 3.0, 1.0 / 6.0
# Rows of the scratch: rate of deformation and spin are not needed here.
_BXX, _BYY, _BZZ, _BYZ, _BZX, _BXY = (RATE + k * CHUNK for k in range(6))
_MORE, _LESS, _HALF_SHEAR, _K, _SIX_VOLUMES = RATE + 6 * CHUNK, RATE + 7 * CHUNK, RATE + 8 * CHUNK, TRIAL, SEEN


@njit("float64(float64)", cache=True, error_model="numpy", forceinline=True)
def inverse_cube_root(u):  # type: ignore[no-untyped-def]
    """u^(-1/3), to round-off for u from 0.01 to 100: with t = u^(1/4) it is t^(-1/3) / t, by Newton's method.

    Only + - * / and roots, which round alike in a vector lane and in a scalar. The start is the Pade approximant at 1,
    and below the root for large t, from where the method is safe, if slow.
    """
    t = np.sqrt(np.sqrt(u))
    y = min((2.0 + t) / (1.0 + 2.0 * t), 3.0 / (1.0 + t))
    for _ in range(4):
        y *= (4.0 - t * y * y * y) * _THIRD
    return y / t


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def _strains(w, n):  # type: ignore[no-untyped-def]
    """Rows of B = F F^T - 1 = H + H^T + H H^T, of det(1 + B) - 1, and six times the undeformed volume, m^3."""
    for i in range(n):
        r1x, r1y, r1z = w[REFERENCE + i], w[REFERENCE + CHUNK + i], w[REFERENCE + 2 * CHUNK + i]
        r2x, r2y, r2z = w[REFERENCE + 3 * CHUNK + i], w[REFERENCE + 4 * CHUNK + i], w[REFERENCE + 5 * CHUNK + i]
        r3x, r3y, r3z = w[REFERENCE + 6 * CHUNK + i], w[REFERENCE + 7 * CHUNK + i], w[REFERENCE + 8 * CHUNK + i]
        g1x, g1y, g1z = r2y * r3z - r2z * r3y, r2z * r3x - r2x * r3z, r2x * r3y - r2y * r3x
        g2x, g2y, g2z = r3y * r1z - r3z * r1y, r3z * r1x - r3x * r1z, r3x * r1y - r3y * r1x
        g3x, g3y, g3z = r1y * r2z - r1z * r2y, r1z * r2x - r1x * r2z, r1x * r2y - r1y * r2x
        six_volumes = r1x * g1x + r1y * g1y + r1z * g1z
        r = 1.0 / six_volumes
        u1x, u1y, u1z = w[EDGE + i] - r1x, w[EDGE + CHUNK + i] - r1y, w[EDGE + 2 * CHUNK + i] - r1z
        u2x, u2y, u2z = w[EDGE + 3 * CHUNK + i] - r2x, w[EDGE + 4 * CHUNK + i] - r2y, w[EDGE + 5 * CHUNK + i] - r2z
        u3x, u3y, u3z = w[EDGE + 6 * CHUNK + i] - r3x, w[EDGE + 7 * CHUNK + i] - r3y, w[EDGE + 8 * CHUNK + i] - r3z
        hxx, hxy = r * (u1x * g1x + u2x * g2x + u3x * g3x), r * (u1x * g1y + u2x * g2y + u3x * g3y)
        hxz, hyx = r * (u1x * g1z + u2x * g2z + u3x * g3z), r * (u1y * g1x + u2y * g2x + u3y * g3x)
        hyy, hyz = r * (u1y * g1y + u2y * g2y + u3y * g3y), r * (u1y * g1z + u2y * g2z + u3y * g3z)
        hzx, hzy = r * (u1z * g1x + u2z * g2x + u3z * g3x), r * (u1z * g1y + u2z * g2y + u3z * g3y)
        hzz = r * (u1z * g1z + u2z * g2z + u3z * g3z)
        bxx = 2.0 * hxx + (hxx * hxx + hxy * hxy + hxz * hxz)
        byy = 2.0 * hyy + (hyx * hyx + hyy * hyy + hyz * hyz)
        bzz = 2.0 * hzz + (hzx * hzx + hzy * hzy + hzz * hzz)
        byz = hyz + hzy + (hyx * hzx + hyy * hzy + hyz * hzz)
        bzx = hzx + hxz + (hzx * hxx + hzy * hxy + hzz * hxz)
        bxy = hxy + hyx + (hxx * hyx + hxy * hyy + hxz * hyz)
        axx, ayy, azz = byy * bzz - byz * byz, bzz * bxx - bzx * bzx, bxx * byy - bxy * bxy
        azx, axy = bxy * byz - byy * bzx, byz * bzx - bzz * bxy
        trace = bxx + byy + bzz
        w[_MORE + i] = trace + (axx + ayy + azz) + (bxx * axx + bxy * axy + bzx * azx)
        w[_BXX + i], w[_BYY + i], w[_BZZ + i] = bxx, byy, bzz
        w[_BYZ + i], w[_BZX + i], w[_BXY + i] = byz, bzx, bxy
        w[_SIX_VOLUMES + i] = six_volumes


@njit("void(float64[::1], int64, float64)", cache=True, error_model="numpy")
def _roots(w, n, shear):  # type: ignore[no-untyped-def]
    """Rows k = det(1 + B)^(-1/3), k - 1 without cancellation, G / 2J: long chains, which overlap in a loop alone."""
    for i in range(n):
        more = w[_MORE + i]
        k = inverse_cube_root(1.0 + more)
        w[_LESS + i] = -more / ((1.0 + more) * (1.0 + k + k * k))
        w[_K + i] = k
        w[_HALF_SHEAR + i] = 0.5 * shear / np.sqrt(1.0 + more)


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def hyperelastic(w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """The deviatoric stress G / 2J dev(b - b^-1) of a chunk, Pa; its work is the change of its potential.

    ``w`` holds the edges of the end of the step and, from REFERENCE on, those of the undeformed tets. All is made of B
    and so of the displacement gradient H, so that small strains keep their digits and none leaves nothing:
    b - 1 = k B + (k - 1), and b^-1 is the adjugate of b, whose determinant is one.
    """
    _strains(w, n)
    _roots(w, n, params[SHEAR])
    of_energy = 0.25 * _SIXTH * params[SHEAR]
    for i in range(n):
        bxx, byy, bzz = w[_BXX + i], w[_BYY + i], w[_BZZ + i]
        byz, bzx, bxy = w[_BYZ + i], w[_BZX + i], w[_BXY + i]
        axx, ayy, azz = byy * bzz - byz * byz, bzz * bxx - bzx * bzx, bxx * byy - bxy * bxy
        ayz, azx, axy = bzx * bxy - bxx * byz, bxy * byz - byy * bzx, byz * bzx - bzz * bxy
        k, less, g = w[_K + i], w[_LESS + i], w[_HALF_SHEAR + i]
        square = k * k
        own = square * (bxx + byy + bzz) + (k + 1.0) * less
        excess = (
            (k * bxx + less) * (square * (bxx - axx) - own)
            + (k * byy + less) * (square * (byy - ayy) - own)
            + (k * bzz + less) * (square * (bzz - azz) - own)
            + 2.0 * k * square * (byz * (byz - ayz) + bzx * (bzx - azx) + bxy * (bxy - axy))
        )
        energy = of_energy * w[_SIX_VOLUMES + i] * excess
        s[_WORK + i] += energy - s[_DISTORTION + i]
        s[_DISTORTION + i] = energy
        one, two = g * (k + square), g * square
        sxx, syy, szz = one * bxx - two * axx, one * byy - two * ayy, one * bzz - two * azz
        mean = (sxx + syy + szz) * _THIRD
        s[_SXX + i], s[_SYY + i], s[_SZZ + i] = sxx - mean, syy - mean, szz - mean
        s[_SYZ + i], s[_SZX + i], s[_SXY + i] = one * byz - two * ayz, one * bzx - two * azx, one * bxy - two * axy


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def stiffen(w, s, params, n):  # type: ignore[no-untyped-def]
    """Raises MODULUS to what a strained tet has at most: K + 4/3 (G + 2 W / V0) / |J| instead of K + 4/3 G.

    Positive for a tet that is inside out too: that is how the limit of its step finds it (tet4.step_limit).
    """
    shear = params[SHEAR]
    of_mass = shear / params[DENSITY]
    for i in range(n):
        stiff = (of_mass * s[_MASS + i] + 2.0 * s[_DISTORTION + i]) / abs(w[VOLUME + i])
        w[MODULUS + i] += 4.0 * _THIRD * (stiff - shear)


LAW = Law("", FROM_SHAPE, lambda _: DISTORTION + 1, lambda _: (), lambda *_: {}, hyperelastic)
"""Materials without a strength."""
