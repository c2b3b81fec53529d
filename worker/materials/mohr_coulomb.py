"""Mohr-Coulomb strength of brittle materials: return of the deviatoric stress to the yield surface at constant
pressure, or with dilation.

The yield surface is f = (s1 - s3) + (s1 + s3) sin(phi) - 2 c cos(phi) <= 0 with the principal stresses s1 >= s2 >= s3,
tension positive, and s1 - s3 <= cap. Plastic flow either keeps the volume, or is given by f with the dilation angle psi
in place of phi; in the second case the flow increases the pressure. Derived in docs/theory/materials.md. The functions
that return the stress are inlined, because function calls would take three times as long.
"""

import math

import numpy as np

from conoid.cases.laws.mohr_coulomb import MohrCoulomb

from ..elements.scratch import CHANGE, D_XX, D_XY, D_YY, D_YZ, D_ZX, D_ZZ, SEEN, TRIAL, VOLUME_MID, VOLUME_SEEN
from ..kernels.jit import njit
from ..model.rows import (
    DILATION,
    PLASTIC_STRAIN,
    PORES,
    PRESSURE,
    S_XX,
    S_XY,
    S_YY,
    S_YZ,
    S_ZX,
    S_ZZ,
    WORK,
    WORK_PLASTIC,
)
from ..model.state import CHUNK
from .elastic import squeezed
from .law import AFTER_PRESSURE, BULK, DILATES, FIRST, SHEAR, SPALL, Law
from .plastic import equivalent_stress
from .turning import sine_and_cosine

_SINE, _COHESION, _CAP, _FAILURE = FIRST, FIRST + 1, FIRST + 4, FIRST + 5
_RESIDUAL = 2
"""Offset between two groups of constants: the group of intact material begins at _SINE and _COHESION, the group of
failed material follows."""
_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_P, _STRAIN, _WORK = PRESSURE * CHUNK, PLASTIC_STRAIN * CHUNK, WORK_PLASTIC * CHUNK
_WHOLE_WORK, _GROWN, _PORES = WORK * CHUNK, DILATION * CHUNK, PORES * CHUNK
_THIRD, _TWO_THIRDS = 1.0 / 3.0, 2.0 / 3.0
_MISES = 2.0 / math.sqrt(3.0)
"""Largest value of s1 - s3 at a von Mises stress of one, which occurs in pure shear."""
_SHEAR, _AXIAL = 1.0 / math.sqrt(3.0), 2.0 / 3.0
"""Largest principal deviatoric stress at a von Mises stress of one: in pure shear, and in tension along an axis."""


@njit(
    "UniTuple(float64, 3)(float64, float64, float64, float64, float64, float64)",
    cache=True,
    error_model="numpy",
    forceinline=True,
)
def principal(xx, yy, zz, yz, zx, xy):  # type: ignore[no-untyped-def]
    """Returns the principal values, the largest first, of a deviator with von Mises stress one. The error is of the
    order of round-off, even for equal principal values.

    The isolated principal value x of the deviator s solves x^3 - x / 3 = det s. The cubic equation for x is well
    conditioned and is solved by three Newton steps from the chord. The distance between the other two principal values
    follows from s without x and its projector (s^2 + x s + x^2 - 1/3) / (3 x^2 - 1/3).
    """
    det = xx * (yy * zz - yz * yz) + xy * (yz * zx - xy * zz) + zx * (xy * yz - yy * zx)
    size = abs(det)
    x = _SHEAR + size * (_AXIAL - _SHEAR) * 13.5
    for _ in range(3):
        x -= (x * (x * x - _THIRD) - size) / (3.0 * x * x - _THIRD)
    x = x if det >= 0.0 else -x
    h = 1.5 * x / (3.0 * x * x - _THIRD)
    g, k = 1.0 - h * x, 0.5 * x - h * (x * x - _THIRD)
    rxx = g * xx + k - h * (xx * xx + xy * xy + zx * zx)
    ryy = g * yy + k - h * (xy * xy + yy * yy + yz * yz)
    rzz = g * zz + k - h * (zx * zx + yz * yz + zz * zz)
    ryz = g * yz - h * (xy * zx + yy * yz + yz * zz)
    rzx = g * zx - h * (xx * zx + xy * yz + zx * zz)
    rxy = g * xy - h * (xx * xy + xy * yy + zx * yz)
    half = np.sqrt(0.5 * (rxx * rxx + ryy * ryy + rzz * rzz) + ryz * ryz + rzx * rzx + rxy * rxy)
    high, low = half - 0.5 * x, -half - 0.5 * x
    return (x, high, low) if x > 0.0 else (high, low, x)


@njit(
    "UniTuple(float64, 3)(float64, float64, float64, float64, float64, float64)",
    cache=True,
    error_model="numpy",
    forceinline=True,
)
def returned(d1, d2, d3, strength, sine, cap):  # type: ignore[no-untyped-def]
    """Returns the principal deviatoric stresses d1 >= d2 >= d3 projected onto the yield surface. Stresses below the
    yield surface are not changed.

    The yield surface is (1 + sine) d1 - (1 - sine) d3 <= strength and d1 - d3 <= cap. For the two planes the flow is
    along (1, 0, -1), at constant d2. If the flow would change the order of the three values, two of the values are set
    equal, which gives a single point.
    """
    new = min(0.5 * (strength - (1.0 - sine) * d2), 0.5 * (cap - d2))
    if not new < d1:
        return d1, d2, d3
    if new < d2:
        low = min(strength / (3.0 - sine), cap / 3.0)
        return low, low, -2.0 * low
    if d3 + (d1 - new) > d2:
        high = min(strength / (3.0 + sine), cap / 3.0)
        return 2.0 * high, -high, -high
    return new, d2, d3 + (d1 - new)


@njit(
    "UniTuple(float64, 4)(float64, float64, float64, float64, float64, float64, float64, float64, float64)",
    cache=True,
    error_model="numpy",
    forceinline=True,
)
def dilated(d1, d2, d3, strength, sine, cap, psi, shear2, bulk):  # type: ignore[no-untyped-def]
    """Returns the principal deviatoric stresses projected onto the yield surface with flow along (1 + psi, 0, psi - 1),
    which increases volume, pressure and strength. psi is the sine of the dilation angle. The function also returns the
    amount of flow; the plastic volume strain is 2 psi times this amount.

    The cap is applied first, at constant volume. Flow ends if the deviator becomes zero.
    """
    d1, d2, d3 = returned(d1, d2, d3, np.inf, sine, cap)
    up, down, stiff = 1.0 + psi * _THIRD, 1.0 - psi * _THIRD, 4.0 * bulk * sine * psi
    flow = ((1.0 + sine) * d1 - (1.0 - sine) * d3 - strength) / (2.0 * shear2 * (1.0 + sine * psi * _THIRD) + stiff)
    if flow <= 0.0:
        return d1, d2, d3, 0.0
    e1, e2, e3 = d1 - shear2 * up * flow, d2 + shear2 * _TWO_THIRDS * psi * flow, d3 + shear2 * down * flow
    if e1 < e2:
        half = 0.5 * (3.0 - sine)
        flow = min((-half * d3 - strength) / (half * down * shear2 + stiff), -d3 / (shear2 * down))
        low = max(-0.5 * (d3 + shear2 * down * flow), 0.0)
        return low, low, -2.0 * low, flow
    if e3 > e2:
        half = 0.5 * (3.0 + sine)
        flow = min((half * d1 - strength) / (half * up * shear2 + stiff), d1 / (shear2 * up))
        high = max(0.5 * (d1 - shear2 * up * flow), 0.0)
        return 2.0 * high, -high, -high, flow
    return e1, e2, e3, flow


@njit("void(float64[::1], float64[::1], int64, float64, float64, float64)", cache=True, error_model="numpy",
      forceinline=True)  # fmt: skip
def grow(w, s, i, grown, subtracted, bulk):  # type: ignore[no-untyped-def]
    """Adds a plastic volume strain ``grown`` to the pressure of tet ``i``. Also adds the work of the plastic volume
    strain, computed with the mean pressure of the step.

    ``subtracted``: strain of the last step that the averaged pressure forms have subtracted from the old pressure.
    """
    more = bulk * grown
    s[_P + i] += more
    s[_GROWN + i] = grown
    s[_WHOLE_WORK + i] -= 0.5 * more * w[CHANGE + i]
    s[_WORK + i] -= w[VOLUME_SEEN + i] * grown * (s[_P + i] + 0.5 * (bulk * (w[SEEN + i] + subtracted) - more))


@njit(
    "UniTuple(float64, 6)(float64, float64, float64, float64, float64, float64, "
    "float64, float64, float64, float64, float64, float64)",
    cache=True,
    error_model="numpy",
    forceinline=True,
)
def with_values(xx, yy, zz, yz, zx, xy, d1, d2, d3, e1, e2, e3):  # type: ignore[no-untyped-def]
    """Returns a tensor with the principal directions of the given tensor, and with the principal values e in place of
    d.

    The formula is e2 + [e2, e3] (s - d2) + [e1, e2, e3] (s - d2) (s - d3), Newton's interpolation, which needs no
    principal directions. After ``returned`` the first differences are between 0 and 1, so equal values cause no error:
    if two values d are equal, the two values e are also equal.
    """
    upper = (e1 - e2) / (d1 - d2) if e1 > e2 else 0.0
    lower = (e2 - e3) / (d2 - d3) if e2 > e3 else 0.0
    second = (upper - lower) / (d1 - d3)
    first = lower - second * d3
    axx, ayy, azz = xx - d2, yy - d2, zz - d2
    bxx, byy, bzz = first + second * xx, first + second * yy, first + second * zz
    byz, bzx, bxy = second * yz, second * zx, second * xy
    return (
        e2 + axx * bxx + xy * bxy + zx * bzx,
        e2 + xy * bxy + ayy * byy + yz * byz,
        e2 + zx * bzx + yz * byz + azz * bzz,
        xy * bzx + ayy * byz + yz * bzz,
        axx * bzx + xy * byz + zx * bzz,
        axx * bxy + xy * byy + zx * byz,
    )


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def mohr_coulomb(w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Returns the trial stress of tets above the yield surface to the yield surface at their new pressure; adds the
    plastic work.

    The plastic work is the work of the mean of the rotated old stress and the new stress, as for the total work. The
    remaining work is equal to the change of the elastic energy of the stress, even if lower pressure or failure
    decreases the strength. If the volume increases by dilation, the elastic energy density belongs to a larger volume
    afterwards; the additional energy is subtracted from the work of the flow. With open pores there is no dilation,
    because the additional volume would go into the pores, and the pressure would not increase.
    """
    equivalent_stress(w, s, n)
    shear2, cap, dilates = 2.0 * params[SHEAR], params[_CAP], params[DILATES] > 0.0
    porous = params[SPALL] < np.inf
    for i in range(n):
        # 1. Compute the strength at the new pressure, or the residual strength; skip tets below the strength.
        k, subtracted = _RESIDUAL if s[_STRAIN + i] > params[_FAILURE] else 0, 0.0
        if dilates:
            subtracted = max(-s[_GROWN + i], 0.0)
            s[_GROWN + i] = 0.0
        sine = params[_SINE + k]
        strength = params[_COHESION + k] + 2.0 * sine * s[_P + i]
        q = w[TRIAL + i]
        most = _MISES * q
        if (most * np.sqrt(1.0 + sine * sine * _THIRD) <= strength and most <= cap) or q == 0.0:
            continue
        # 2. Compute the principal values d of the deviator, scaled to von Mises stress one.
        r = 1.0 / q
        mean = (s[_SXX + i] + s[_SYY + i] + s[_SZZ + i]) * _THIRD
        sxx, syy, szz = r * (s[_SXX + i] - mean), r * (s[_SYY + i] - mean), r * (s[_SZZ + i] - mean)
        syz, szx, sxy = r * s[_SYZ + i], r * s[_SZX + i], r * s[_SXY + i]
        d1, d2, d3 = principal(sxx, syy, szz, syz, szx, sxy)
        # 3. Compute the values e on the yield surface. With dilation, compute also the pressure.
        if dilates and k == 0 and not (porous and s[_PORES + i] > 0.0):
            e1, e2, e3, flow = dilated(d1, d2, d3, r * strength, sine, r * cap, params[DILATES], shear2, params[BULK])
            grown = 2.0 * params[DILATES] * q * flow
            grow(w, s, i, grown, subtracted, params[BULK])
            stored = squeezed(s, params, i) + 0.5 * q * q / shear2 * (e1 * e1 + e2 * e2 + e3 * e3)
            s[_WORK + i] -= w[VOLUME_SEEN + i] * grown * stored
        else:
            e1, e2, e3 = returned(d1, d2, d3, max(r * strength, 0.0), sine, r * cap)
        if e1 == d1:
            continue
        # 4. Compute the tensor with the values e. Add plastic strain and work.
        nxx, nyy, nzz, nyz, nzx, nxy = with_values(sxx, syy, szz, syz, szx, sxy, d1, d2, d3, e1, e2, e3)
        s[_SXX + i], s[_SYY + i], s[_SZZ + i] = q * nxx, q * nyy, q * nzz
        s[_SYZ + i], s[_SZX + i], s[_SXY + i] = q * nyz, q * nzx, q * nxy
        f1, f2, f3 = d1 - e1, d2 - e2, d3 - e3
        square, work = f1 * f1 + f2 * f2 + f3 * f3, e1 * f1 + e2 * f2 + e3 * f3
        moved = (
            (sxx - nxx) * w[D_XX + i]
            + (syy - nyy) * w[D_YY + i]
            + (szz - nzz) * w[D_ZZ + i]
            + 2.0 * ((syz - nyz) * w[D_YZ + i] + (szx - nzx) * w[D_ZX + i] + (sxy - nxy) * w[D_XY + i])
        )
        s[_STRAIN + i] += q / shear2 * np.sqrt(_TWO_THIRDS * square)
        s[_WORK + i] += w[VOLUME_MID + i] * q * q / shear2 * max(work + 0.5 * (square - r * shear2 * dt * moved), 0.0)


def _constants(law: MohrCoulomb) -> tuple[float, ...]:
    """Returns the constants of the law; limits that are not given are infinite."""
    residual = law.residual_friction_angle
    angle = min(math.radians(30.0), law.friction_angle) if residual is None else residual
    return (
        *_sine_and_cohesion(law.cohesion, law.friction_angle),
        *_sine_and_cohesion(law.residual_cohesion or 0.0, angle),
        math.inf if law.strength_cap is None else law.strength_cap,
        math.inf if law.failure_strain is None else law.failure_strain,
    )


def _sine_and_cohesion(cohesion: float, angle: float) -> tuple[float, float]:
    """Returns sin(phi) and 2 c cos(phi), Pa."""
    sine, cosine = sine_and_cosine(angle)
    return sine, 2.0 * cohesion * cosine


def _rows(law: MohrCoulomb) -> int:
    return (DILATION if law.dilation_angle else WORK_PLASTIC) + 1


LAW = Law(
    "mohr_coulomb", AFTER_PRESSURE, _rows, _constants, lambda *_: {}, mohr_coulomb,
    dilates=lambda law: sine_and_cosine(law.dilation_angle)[0],
)  # fmt: skip
"""Mohr-Coulomb strength law. For tension beyond the apex of the yield surface the deviator is zero; the pressure
remains a tension until facets break."""
