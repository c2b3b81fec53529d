"""Hypoelastic deviatoric stress with an exact rotation. If a material has a strength law, the elastic stress is the
trial stress.
"""

import numpy as np

from ..elements.scratch import D_XX, D_XY, D_YY, D_YZ, D_ZX, D_ZZ, DILATATION, SPIN, VOLUME_MID
from ..kernels.jit import njit
from ..model.rows import PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ, WORK
from ..model.state import CHUNK
from .law import BULK, SHEAR

_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_WORK, _P = WORK * CHUNK, PRESSURE * CHUNK
_THIRD = 1.0 / 3.0


@njit("float64(float64[::1], float64[::1], int64)", cache=True, error_model="numpy", forceinline=True)
def sheared(s, params, i):  # type: ignore[no-untyped-def]
    """Returns the energy density of the deviatoric stress s of tet ``i``, s:s / 4G, J/m^3."""
    sxx, syy, szz = s[_SXX + i], s[_SYY + i], s[_SZZ + i]
    syz, szx, sxy = s[_SYZ + i], s[_SZX + i], s[_SXY + i]
    square = sxx * sxx + syy * syy + szz * szz + 2.0 * (syz * syz + szx * szx + sxy * sxy)
    return 0.25 * square / params[SHEAR]


@njit("float64(float64[::1], float64[::1], int64)", cache=True, error_model="numpy", forceinline=True)
def squeezed(s, params, i):  # type: ignore[no-untyped-def]
    """Returns the energy density of a linear pressure in tet ``i``, p^2 / 2K, J/m^3."""
    return 0.5 * s[_P + i] * s[_P + i] / params[BULK]


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def turn_rate(w, n):  # type: ignore[no-untyped-def]
    """Rotates the rate of deformation from mid-step to the end of the step, by half of the rotation angle of the step
    (rotation Q of ``predict``).

    If a is the axial vector of W dt/2, with |a| = tan(angle / 2), the axial vector for half of the angle is b = a / (1
    + sqrt(1 + a.a)).
    """
    for i in range(n):
        ax, ay, az = w[SPIN + i], w[SPIN + CHUNK + i], w[SPIN + 2 * CHUNK + i]
        half = 1.0 / (1.0 + np.sqrt(1.0 + ax * ax + ay * ay + az * az))
        ax, ay, az = half * ax, half * ay, half * az
        f = 2.0 / (1.0 + ax * ax + ay * ay + az * az)
        qxx, qyy, qzz = 1.0 - f * (ay * ay + az * az), 1.0 - f * (ax * ax + az * az), 1.0 - f * (ax * ax + ay * ay)
        qxy, qyx = f * (ax * ay - az), f * (ax * ay + az)
        qxz, qzx = f * (ax * az + ay), f * (ax * az - ay)
        qyz, qzy = f * (ay * az - ax), f * (ay * az + ax)
        xx, yy, zz = w[D_XX + i], w[D_YY + i], w[D_ZZ + i]
        yz, zx, xy = w[D_YZ + i], w[D_ZX + i], w[D_XY + i]
        txx, txy, txz = qxx * xx + qxy * xy + qxz * zx, qxx * xy + qxy * yy + qxz * yz, qxx * zx + qxy * yz + qxz * zz
        tyx, tyy, tyz = qyx * xx + qyy * xy + qyz * zx, qyx * xy + qyy * yy + qyz * yz, qyx * zx + qyy * yz + qyz * zz
        tzx, tzy, tzz = qzx * xx + qzy * xy + qzz * zx, qzx * xy + qzy * yy + qzz * yz, qzx * zx + qzy * yz + qzz * zz
        w[D_XX + i] = txx * qxx + txy * qxy + txz * qxz
        w[D_YY + i] = tyx * qyx + tyy * qyy + tyz * qyz
        w[D_ZZ + i] = tzx * qzx + tzy * qzy + tzz * qzz
        w[D_YZ + i] = tyx * qzx + tyy * qzy + tyz * qzz
        w[D_ZX + i] = tzx * qxx + tzy * qxy + tzz * qxz
        w[D_XY + i] = txx * qyx + txy * qyy + txz * qyz


@njit("void(float64[::1], float64[::1], int64, float64, float64)", cache=True, error_model="numpy")
def predict(w, s, n, shear, dt):  # type: ignore[no-untyped-def]
    """Computes the trial stress: rotates the deviatoric stress and adds 2 G dt dev D. Adds the first half of the work.

    s becomes Q s Q^T with Q = (I - W dt/2)^-1 (I + W dt/2), a rotation to round-off (Hughes and Winget 1980); in closed
    form, where a is the axial vector of W dt/2, Q = I + 2 (A + A^2) / (1 + a.a). The work of a step is V s : D,
    integrated by the trapezoidal rule. The function ``predict`` adds the half of the work with the rotated old stress;
    ``deviatoric_work`` adds the half with the new stress.
    """
    turn_rate(w, n)
    twice_shear_dt = 2.0 * shear * dt
    for i in range(n):
        # 1. Compute Q from the axial vector a.
        ax, ay, az = w[SPIN + i], w[SPIN + CHUNK + i], w[SPIN + 2 * CHUNK + i]
        f = 2.0 / (1.0 + ax * ax + ay * ay + az * az)
        qxx, qyy, qzz = 1.0 - f * (ay * ay + az * az), 1.0 - f * (ax * ax + az * az), 1.0 - f * (ax * ax + ay * ay)
        qxy, qyx = f * (ax * ay - az), f * (ax * ay + az)
        qxz, qzx = f * (ax * az + ay), f * (ax * az - ay)
        qyz, qzy = f * (ay * az - ax), f * (ay * az + ax)
        # 2. Rotate the stress: T = Q s, then s = T Q^T.
        sxx, syy, szz = s[_SXX + i], s[_SYY + i], s[_SZZ + i]
        syz, szx, sxy = s[_SYZ + i], s[_SZX + i], s[_SXY + i]
        txx, txy = qxx * sxx + qxy * sxy + qxz * szx, qxx * sxy + qxy * syy + qxz * syz
        txz, tyx = qxx * szx + qxy * syz + qxz * szz, qyx * sxx + qyy * sxy + qyz * szx
        tyy, tyz = qyx * sxy + qyy * syy + qyz * syz, qyx * szx + qyy * syz + qyz * szz
        tzx, tzy = qzx * sxx + qzy * sxy + qzz * szx, qzx * sxy + qzy * syy + qzz * syz
        tzz = qzx * szx + qzy * syz + qzz * szz
        sxx, syy, szz = (
            txx * qxx + txy * qxy + txz * qxz,
            tyx * qyx + tyy * qyy + tyz * qyz,
            tzx * qzx + tzy * qzy + tzz * qzz,
        )
        syz, szx, sxy = (
            tyx * qzx + tyy * qzy + tyz * qzz,
            tzx * qxx + tzy * qxy + tzz * qxz,
            txx * qyx + txy * qyy + txz * qyz,
        )
        # 3. Add the work of the rotated stress; compute the trial stress s + 2 G dt dev D.
        mean = w[DILATATION + i] * _THIRD
        dxx, dyy, dzz = w[D_XX + i] - mean, w[D_YY + i] - mean, w[D_ZZ + i] - mean
        dyz, dzx, dxy = w[D_YZ + i], w[D_ZX + i], w[D_XY + i]
        power = sxx * dxx + syy * dyy + szz * dzz + 2.0 * (syz * dyz + szx * dzx + sxy * dxy)
        s[_WORK + i] += 0.5 * dt * w[VOLUME_MID + i] * power
        s[_SXX + i], s[_SYY + i], s[_SZZ + i] = (
            sxx + twice_shear_dt * dxx,
            syy + twice_shear_dt * dyy,
            szz + twice_shear_dt * dzz,
        )
        s[_SYZ + i], s[_SZX + i], s[_SXY + i] = (
            syz + twice_shear_dt * dyz,
            szx + twice_shear_dt * dzx,
            sxy + twice_shear_dt * dxy,
        )


@njit("void(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def deviatoric_work(w, s, n, dt):  # type: ignore[no-untyped-def]
    """Adds V dt/2 s : D, the second half of the work of the step, computed with the new stress."""
    for i in range(n):
        mean = w[DILATATION + i] * _THIRD
        power = (
            s[_SXX + i] * (w[D_XX + i] - mean)
            + s[_SYY + i] * (w[D_YY + i] - mean)
            + s[_SZZ + i] * (w[D_ZZ + i] - mean)
            + 2.0 * (s[_SYZ + i] * w[D_YZ + i] + s[_SZX + i] * w[D_ZX + i] + s[_SXY + i] * w[D_XY + i])
        )
        s[_WORK + i] += 0.5 * dt * w[VOLUME_MID + i] * power
