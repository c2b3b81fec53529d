"""J2 plasticity with linear isotropic hardening: radial return in closed form."""

import numpy as np

from conoid.cases.laws.linear_hardening import LinearHardening

from ..elements.scratch import D_XX, D_XY, D_YY, D_YZ, D_ZX, D_ZZ, NODAL, TRIAL, VOLUME_MID
from ..kernels.jit import njit
from ..model.rows import PLASTIC_STRAIN, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ, WORK_PLASTIC, YIELD
from ..model.state import CHUNK
from .law import BEFORE_PRESSURE, FIRST, SHEAR, Law

FACTOR = NODAL
"""Scratch row: ratio of the new deviatoric stress to the trial stress."""
_HARDENING = FIRST
_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_STRAIN, _WORK, _YIELD = PLASTIC_STRAIN * CHUNK, WORK_PLASTIC * CHUNK, YIELD * CHUNK


@njit("void(float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def equivalent_stress(w, s, n):  # type: ignore[no-untyped-def]
    """Sets the row TRIAL to the von Mises stress sqrt(3/2 s : s), Pa, of the deviatoric stress s."""
    for i in range(n):
        sxx, syy, szz = s[_SXX + i], s[_SYY + i], s[_SZZ + i]
        syz, szx, sxy = s[_SYZ + i], s[_SZX + i], s[_SXY + i]
        w[TRIAL + i] = np.sqrt(1.5 * (sxx * sxx + syy * syy + szz * szz + 2.0 * (syz * syz + szx * szx + sxy * sxy)))


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def return_radially(w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Multiplies the trial stress by row FACTOR and adds the plastic work. The row TRIAL has the von Mises stress of
    the trial stress. The plastic work is the work of the mean of the rotated old stress and the new stress (as in
    mohr_coulomb.py).
    """
    shear2 = 2.0 * params[SHEAR]
    for i in range(n):
        q, factor = w[TRIAL + i], w[FACTOR + i]
        moved = (
            s[_SXX + i] * w[D_XX + i]
            + s[_SYY + i] * w[D_YY + i]
            + s[_SZZ + i] * w[D_ZZ + i]
            + 2.0 * (s[_SYZ + i] * w[D_YZ + i] + s[_SZX + i] * w[D_ZX + i] + s[_SXY + i] * w[D_XY + i])
        )
        twice = (1.0 + factor) * 2.0 / 3.0 * q * q - shear2 * dt * moved
        s[_SXX + i] *= factor
        s[_SYY + i] *= factor
        s[_SZZ + i] *= factor
        s[_SYZ + i] *= factor
        s[_SZX + i] *= factor
        s[_SXY + i] *= factor
        s[_WORK + i] += w[VOLUME_MID + i] * (1.0 - factor) * max(twice, 0.0) / (2.0 * shear2)


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def linear_hardening(w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Returns the trial stress to the yield surface. The strain increment (q - yield) / (3 G + H) is exact for this
    law, with the von Mises trial stress q, the shear modulus G and the hardening modulus H.
    """
    equivalent_stress(w, s, n)
    shear3, hardening = 3.0 * params[SHEAR], params[_HARDENING]
    for i in range(n):
        q, old = w[TRIAL + i], s[_YIELD + i]
        over = max(q - old, 0.0)
        increment = over / (shear3 + hardening)
        new = old + hardening * increment
        w[FACTOR + i] = new / q if over > 0.0 else 1.0
        s[_YIELD + i] = new
        s[_STRAIN + i] += increment
    return_radially(w, s, params, n, dt)


def _begin(law: LinearHardening, _: float) -> dict[int, float]:
    return {YIELD: law.yield_stress}


LAW = Law(
    "linear_hardening", BEFORE_PRESSURE, lambda _: YIELD + 1, lambda law: (law.hardening,), _begin, linear_hardening
)  # fmt: skip
"""J2 strength law with linear hardening. The yield stress is a state row."""
