"""Johnson-Holmquist 2 law of brittle materials. The strength depends on pressure, rate and damage. The pressure
includes bulking and has a tension cut-off.

Source: Johnson and Holmquist 1994. A step computes in this order (docs/theory/materials.md): pressure at n+1, with
bulking and damage at n; strength at this pressure; return of the stress to the strength; damage and bulking at n+1.
"""

import math

import numpy as np

from conoid.cases.laws.johnson_holmquist import JohnsonHolmquist

from ..elements.scratch import (
    BEFORE,
    CHANGE,
    CHANGE_SEEN,
    CORNER_CHANGE,
    D_XX,
    D_XY,
    D_YY,
    D_YZ,
    D_ZX,
    D_ZZ,
    DILATATION,
    MODULUS,
    NODAL,
    SEEN,
    TRIAL,
    VOLUME,
    VOLUME_MID,
)
from ..kernels.jit import njit
from ..model.rows import (
    BULKING,
    BULKING_STEP,
    CORNERS,
    DAMAGE,
    MASS,
    PLASTIC_STRAIN,
    PRESSURE,
    S_XX,
    S_XY,
    S_YY,
    S_YZ,
    S_ZX,
    S_ZZ,
    VOLUME_RATIO,
    WORK,
    WORK_AVERAGED,
    WORK_PLASTIC,
)
from ..model.state import CHUNK
from .elementary import log, logarithms, powers
from .equation_of_state import volumes_by_ratio
from .law import AFTER_PRESSURE, BULK, DENSITY, FIRST, SHEAR, Equation, Law
from .plastic import equivalent_stress

_STRENGTH, _PHEL, _T, _A, _N, _B, _M, _C, _RATE, _MOST, _D1, _D2, _K2, _K3, _BETA = range(FIRST, FIRST + 15)
_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_P, _STRAIN, _PLASTIC, _WORK = PRESSURE * CHUNK, PLASTIC_STRAIN * CHUNK, WORK_PLASTIC * CHUNK, WORK * CHUNK
_DAMAGE, _BULKING, _RATIO = DAMAGE * CHUNK, BULKING * CHUNK, VOLUME_RATIO * CHUNK
_BULKING_STEP, _CORNERS = BULKING_STEP * CHUNK, CORNERS * CHUNK
_AVERAGED, _MASS = WORK_AVERAGED * CHUNK, MASS * CHUNK
# Scratch rows of the law: (p* + T*)^N; (p* + T*)^D2; p*^M; logarithm of the relative rate.
_INTACT, _FRACTURE, _CRUMBLED, _FAST = (NODAL + k * CHUNK for k in range(4))
_TINY = 1e-300
"""Smallest argument of a logarithm; an argument of zero is replaced by this value."""
_LEAST = 0.05
"""Smallest bulk modulus in the wave speed, divided by the bulk modulus at rest. Chosen value: a limit of the bulk
modulus from below can only decrease the stable step."""
_THIRD, _TWO_THIRDS = 1.0 / 3.0, 2.0 / 3.0


@njit(
    "UniTuple(float64, 2)(float64[::1], float64, float64, float64)", cache=True, error_model="numpy", forceinline=True
)
def _pressed(params, ratio, bulking, least):  # type: ignore[no-untyped-def]
    """Returns the pressure and the tangent bulk modulus, with m = V0/V - 1. Under compression the pressure is p = K m +
    K2 m^2 + K3 m^3 + bulking. In tension the pressure is p = K m + bulking, but at least ``least`` = -T (1 - D).
    """
    bulk, second, third = params[BULK], params[_K2], params[_K3]
    m = 1.0 / ratio - 1.0
    squeezed = max(m, 0.0)
    free = bulk * m + squeezed * squeezed * (second + third * squeezed) + bulking
    stiff = (1.0 + m) * (bulk + squeezed * (2.0 * second + 3.0 * third * squeezed))
    return (least if free < least else free), stiff


@njit("float64(float64[::1], float64, float64, float64, float64)", cache=True, error_model="numpy")
def _stored(params, ratio, p, bulking, least):  # type: ignore[no-untyped-def]
    """Returns the elastic energy of the pressure ``p``, computed by ``_pressed``, per initial volume, Pa: the integral
    of -p over the volume ratio, from the ratio at zero pressure. Above the volume ratio at which the pressure is
    ``least``, the energy is constant; under compression the energy is computed as a triangle.
    """
    bulk = params[BULK]
    stiff = bulk - bulking
    free, end = bulk / stiff, bulk / (stiff + least)
    if not ratio > free:
        return 0.5 * p * (free - ratio)
    to = min(ratio, end)
    return stiff * (to - free) - bulk * log(to / free)


@njit("float64(float64[::1], float64, float64, float64, float64, float64, float64)", cache=True, error_model="numpy")
def _beyond(params, before, after, old, new, bulking, least):  # type: ignore[no-untyped-def]
    """Returns the part of the work of the mean pressure between two volume ratios that is not stored, per initial
    volume, Pa. The part is not zero only if the tension cut-off acts.
    """
    if (new > least or not after > before) and (old > least or not before > after):
        return 0.0
    more = _stored(params, after, new, bulking, least) - _stored(params, before, old, bulking, least)
    return -0.5 * (old + new) * (after - before) - more


@njit("float64(float64[::1], float64, float64, float64, float64)", cache=True, error_model="numpy", forceinline=True)
def _opened(params, before, after, bulking, least):  # type: ignore[no-untyped-def]
    """Returns the increase of the volume ratio of a tet from ``before`` to ``after``, counted only beyond the tension
    cut-off.
    """
    end = params[BULK] / (params[BULK] - bulking + least)
    return max(after - end, 0.0) - max(before - end, 0.0)


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def crumbling(w, s, params, n):  # type: ignore[no-untyped-def]
    """Computes the pressure of ``_pressed`` for a chunk. In the averaged pressure forms the pressure is the mean over
    the four nodes, each with its own cut-off, and the energy is summed over the nodes (elements/heat_and_bulking.py).

    The plastic work has two parts. The first part of the plastic work is the difference between the work of the
    pressure of step n and the work at the same volume ratio with the present bulking and damage. The second part of the
    plastic work is the work of the expansion beyond the tension cut-off. Beyond the cut-off the pressure does not
    determine a volume ratio. The work is therefore computed from the opening of the tet itself, not from the ratio at
    its nodes, which also contains the opening of neighbours without tension.
    """
    bulk, averaged = params[BULK], len(s) > _BULKING_STEP
    for i in range(n):
        # 1. Compute the volume ratio at step n+1, and the tension cut-off.
        half = 0.5 * w[SEEN + i]
        ratio = s[_RATIO + i] * (1.0 + half) / (1.0 - half)
        least = -params[_T] * (1.0 - s[_DAMAGE + i])
        # 2. Compute pressure and work beyond the cut-off at n+1. The pressure is the mean over the corners, or the
        # value of the tet.
        if averaged:
            new, stiff, stored, beyond = 0.0, 0.0, 0.0, 0.0
            whole = s[_MASS + i] / params[DENSITY]
            own = _opened(
                params, (w[VOLUME + i] - w[CHANGE + i]) / whole, w[VOLUME + i] / whole, s[_BULKING + i], least
            )
            for k in range(4):
                corner, change = s[_CORNERS + k * CHUNK + i], w[CORNER_CHANGE + k * CHUNK + i]
                p, modulus = _pressed(params, corner, s[_BULKING + i], least)
                old, _ = _pressed(params, corner - change, s[_BULKING + i], least)
                new, stiff = new + 0.25 * p, stiff if modulus < stiff else modulus
                if p > least or old > least:
                    stored += (old + p) * change
                    beyond += 0.25 * _beyond(params, corner - change, corner, old, p, s[_BULKING + i], least)
                else:
                    stored += 2.0 * least * own
                    beyond -= 0.25 * least * own
            seen = 0.125 * whole * stored
            s[_AVERAGED + i] += seen - 0.5 * (w[BEFORE + i] + new) * w[CHANGE_SEEN + i]
        else:
            new, stiff = _pressed(params, ratio, s[_BULKING + i], least)
            old, _ = _pressed(params, s[_RATIO + i], s[_BULKING + i], least)
            s[_PLASTIC + i] -= 0.5 * (s[_P + i] - old) * w[CHANGE + i]
            beyond = _beyond(params, s[_RATIO + i], ratio, old, new, s[_BULKING + i], least)
        # 3. Add the work, update the state, compute the modulus.
        s[_PLASTIC + i] += s[_MASS + i] / params[DENSITY] * beyond
        s[_WORK + i] -= 0.5 * (s[_P + i] + new) * w[CHANGE + i]
        s[_P + i], s[_RATIO + i] = new, ratio
        w[MODULUS + i] = (_LEAST * bulk if stiff < _LEAST * bulk else stiff) + 4.0 / 3.0 * params[SHEAR]


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def _factors(w, s, params, n):  # type: ignore[no-untyped-def]
    """Computes powers of the pressure, which are nearly zero if the pressure is zero. Also computes the logarithm of
    the squared relative rate, which is at least 0.
    """
    per_pressure, tension = 1.0 / params[_PHEL], params[_T] / params[_PHEL]
    per_rate = _TWO_THIRDS / (params[_RATE] * params[_RATE])
    for i in range(n):
        p = s[_P + i] * per_pressure
        mean = w[DILATATION + i] * _THIRD
        xx, yy, zz = w[D_XX + i] - mean, w[D_YY + i] - mean, w[D_ZZ + i] - mean
        yz, zx, xy = w[D_YZ + i], w[D_ZX + i], w[D_XY + i]
        square = per_rate * (xx * xx + yy * yy + zz * zz + 2.0 * (yz * yz + zx * zx + xy * xy))
        w[_INTACT + i] = max(p + tension, _TINY)
        w[_CRUMBLED + i] = max(p, _TINY)
        w[_FAST + i] = max(square, 1.0)
    logarithms(w, _INTACT, n)
    for i in range(n):
        w[_FRACTURE + i] = w[_INTACT + i]
    powers(w, _INTACT, n, params[_N])
    powers(w, _FRACTURE, n, params[_D2])
    logarithms(w, _CRUMBLED, n)
    powers(w, _CRUMBLED, n, params[_M])
    logarithms(w, _FAST, n)


@njit("float64(float64[::1], float64[::1], int64, float64, float64, boolean)", cache=True, error_model="numpy")
def _tension_lost(s, params, i, damage, grown, averaged):  # type: ignore[no-untyped-def]
    """Returns the decrease of the elastic energy of tension by an increase ``grown`` of the damage of tet ``i``, per
    initial volume, Pa.
    """
    before, after = -params[_T] * (1.0 - damage), -params[_T] * (1.0 - grown)
    lost = 0.0
    for k in range(4 if averaged else 1):
        ratio = s[_CORNERS + k * CHUNK + i] if averaged else s[_RATIO + i]
        if ratio > 1.0:
            bulking = s[_BULKING + i]
            lost += _stored(params, ratio, 0.0, bulking, before) - _stored(params, ratio, 0.0, bulking, after)
    return 0.25 * lost if averaged else lost


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def johnson_holmquist(w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Returns the trial stress to the strength at the new pressure. Updates damage and bulking, and adds the plastic
    work.

    The strength uses the damage at n, so that the return to the strength needs no iteration. The plastic work is the
    work of the mean of the rotated old stress and the new stress (as in mohr_coulomb.py), even if damage or pressure
    lower the strength. Energy that is converted to bulking is stored, and is therefore subtracted from the plastic
    work. In the averaged pressure forms new bulking is first distributed to the nodes (elements/heat_and_bulking.py).
    """
    equivalent_stress(w, s, n)
    _factors(w, s, params, n)
    shear, bulk, hel = params[SHEAR], params[BULK], params[_STRENGTH]
    tension, averaged = params[_T], len(s) > _BULKING_STEP
    grows = _BULKING_STEP if averaged else _BULKING
    for i in range(n):
        # 1. Compute the strength at the new pressure, between the strengths of intact and of fractured material.
        q, p, damage = w[TRIAL + i], s[_P + i], s[_DAMAGE + i]
        rate = 1.0 + 0.5 * params[_C] * w[_FAST + i]
        intact = hel * params[_A] * rate * w[_INTACT + i] if p > -tension else 0.0
        crumbled = min(hel * params[_B] * rate * w[_CRUMBLED + i], hel * params[_MOST]) if p > 0.0 else 0.0
        crumbled = min(crumbled, intact)
        strength = intact - damage * (intact - crumbled)
        if q <= strength:
            continue
        # 2. Compute the plastic strain, and the damage: plastic strain divided by fracture strain.
        strain = (q - strength) / (3.0 * shear)
        fracture = params[_D1] * w[_FRACTURE + i] if p > -tension else 0.0
        grown = damage + strain / fracture if strain < (1.0 - damage) * fracture else 1.0
        # 3. Return the stress to the strength, and add the work.
        factor = strength / q
        mean = w[DILATATION + i] * _THIRD
        moved = (
            s[_SXX + i] * (w[D_XX + i] - mean)
            + s[_SYY + i] * (w[D_YY + i] - mean)
            + s[_SZZ + i] * (w[D_ZZ + i] - mean)
            + 2.0 * (s[_SYZ + i] * w[D_YZ + i] + s[_SZX + i] * w[D_ZX + i] + s[_SXY + i] * w[D_XY + i])
        )
        lost = (1.0 - factor) * ((1.0 + factor) * _TWO_THIRDS * q * q - 2.0 * shear * dt * moved) / (4.0 * shear)
        for row in range(S_XX, S_XY + 1):
            s[row * CHUNK + i] *= factor
        s[_STRAIN + i] += strain
        s[_PLASTIC + i] += w[VOLUME_MID + i] * max(lost, 0.0)
        # 4. Lower the tension by the damage. Add bulking from the deviatoric energy that the lower strength releases.
        s[_DAMAGE + i] = grown
        s[_PLASTIC + i] += s[_MASS + i] / params[DENSITY] * _tension_lost(s, params, i, damage, grown, averaged)
        m = 1.0 / s[_RATIO + i] - 1.0
        if m > 0.0:
            after = intact - grown * (intact - crumbled)
            free = (strength * strength - after * after) / (6.0 * shear)
            whole = bulk * m + s[_BULKING + i]
            s[grows + i] += math.sqrt(whole * whole + 2.0 * params[_BETA] * bulk * free) - whole
            kept = w[VOLUME_MID + i] * params[_BETA] * free
            s[_PLASTIC + i] -= kept
            if averaged:
                s[_AVERAGED + i] += kept


def _constants(law: JohnsonHolmquist) -> tuple[float, ...]:
    most = np.inf if law.largest_fractured is None else law.largest_fractured
    return (
        law.strength_hel, law.pressure_hel, law.tension, law.A, law.N, law.B, law.M, law.C, law.reference_rate, most,
        law.D1, law.D2, law.K2, law.K3, law.beta,
    )  # fmt: skip


PRESSURE_LAW = Equation("johnson_holmquist", DAMAGE + 1, lambda _: (), crumbling, volumes_by_ratio, CORNERS + 4)
"""Equation of state of the Johnson-Holmquist law. The pressure includes bulking (a nodal mean in the averaged pressure
forms) and has the tension cut-off of the law."""
LAW = Law(
    "johnson_holmquist", AFTER_PRESSURE, lambda _: DAMAGE + 1, _constants,
    lambda *_: {CORNERS + k: 1.0 for k in range(4)}, johnson_holmquist,
    PRESSURE_LAW.model,
)  # fmt: skip
"""Johnson-Holmquist strength law. Tension is limited to T (1 - D), with the tensile strength T and the damage D, so
fully damaged material has no tensile strength."""
