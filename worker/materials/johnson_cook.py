"""Johnson-Cook flow stress, radial return with adiabatic heating.

sigma = (A + B e^n) (1 + C ln max(rate / rate_0, 1)) (1 - T*^m). Johnson and Cook 1983.
"""

import math

from conoid.cases.laws.johnson_cook import JohnsonCook

from ..elements.tet4 import TRIAL, VOLUME_MID
from ..jit import njit
from ..state import CHUNK, FLOW, MASS, PLASTIC_STRAIN, TEMPERATURE, WORK_PLASTIC, YIELD
from .law import BEFORE_PRESSURE, FIRST, SHEAR, Law
from .plastic import equivalent_stress, scale_deviator

_A, _B, _N, _C, _M, _RATE, _T0, _MELT, _HEAT = range(FIRST, FIRST + 9)
_STRAIN, _WORK, _YIELD, _FLOW = PLASTIC_STRAIN * CHUNK, WORK_PLASTIC * CHUNK, YIELD * CHUNK, FLOW * CHUNK
_TEMPERATURE, _MASS = TEMPERATURE * CHUNK, MASS * CHUNK
_MOST = 60
"""Newton steps at most: halving alone, from a bracket, has reached the last bit of a float64 by then (52 bits)."""
_CLOSE = 1e-4
"""A Newton step below this share of the strain increment leaves an error of its square: below 1e-8 of the stress."""


@njit("UniTuple(float64, 2)(float64[::1], float64)", cache=True, error_model="numpy")
def softening(params, temperature):  # type: ignore[no-untyped-def]
    """1 - T*^m and its derivative by temperature, 1/K; 1 below the reference temperature, 0 from melting on."""
    span = params[_MELT] - params[_T0]
    homologous = (temperature - params[_T0]) / span
    if homologous <= 0.0:
        return 1.0, 0.0
    if homologous >= 1.0:
        return 0.0, 0.0
    m = params[_M]
    power = homologous if m == 1.0 else homologous**m
    return 1.0 - power, -m * power / (homologous * span)


@njit("UniTuple(float64, 4)(float64[::1], float64, float64, float64, float64)", cache=True, error_model="numpy")
def flow_stress(params, strain, increment, dt, temperature):  # type: ignore[no-untyped-def]
    """Flow stress, Pa, its derivatives by the strain increment and by temperature, and the rate-free flow stress.

    ``strain`` is the plastic strain at the end of the increment.
    """
    power = params[_B] * strain ** params[_N] if strain > 0.0 else 0.0
    hardening = params[_A] + power
    slope = params[_N] * power / strain if strain > 0.0 else 0.0
    relative = increment / (dt * params[_RATE])
    rate, rate_slope = 1.0, 0.0
    if relative > 1.0:
        rate, rate_slope = 1.0 + params[_C] * math.log(relative), params[_C] / increment
    heat, heat_slope = softening(params, temperature)
    return (
        hardening * rate * heat,
        (slope * rate + hardening * rate_slope) * heat,
        hardening * rate * heat_slope,
        hardening * heat,
    )


@njit(
    "UniTuple(float64, 3)(float64[::1], float64, float64, float64, float64, float64, float64)",
    cache=True,
    error_model="numpy",
)
def plastic_increment(params, q, strain, temperature, dt, guess, heat):  # type: ignore[no-untyped-def]
    """Solves q - 3 G d = flow stress(d) for the plastic strain increment d in [0, q / 3G].

    The left side falls and the right side rises with d until the metal softens, so the root is bracketed: Newton,
    halving when it leaves the bracket. ``heat`` is K per J/m^3 of plastic work. Returns d, the flow stress there and
    the rate-free flow stress.
    """
    shear3 = 3.0 * params[SHEAR]
    low, high = 0.0, q / shear3
    d = min(max(guess, 1e-3 * high), high)
    for _ in range(_MOST):
        stress = q - shear3 * d
        flow, by_strain, by_heat, static = flow_stress(params, strain + d, d, dt, temperature + heat * d * stress)
        residual = stress - flow
        if residual > 0.0:
            low = d
        else:
            high = d
        slope = -shear3 - by_strain - by_heat * heat * (stress - shear3 * d)
        step = -residual / slope if slope < 0.0 else 0.0
        new = d + step
        if not low <= new <= high or slope >= 0.0:
            new = 0.5 * (low + high)
            step = new - d
        d = new
        if abs(step) <= _CLOSE * d or high - low <= 1e-12 * high:
            break
    return d, max(q - shear3 * d, 0.0), static


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def johnson_cook(w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Returns the trial stress of the tets beyond their rate-free flow stress; heats them by the plastic work."""
    equivalent_stress(w, s, n)
    shear3 = 3.0 * params[SHEAR]
    for i in range(n):
        q = w[TRIAL + i]
        if q <= s[_YIELD + i]:
            continue
        density = s[_MASS + i] / w[VOLUME_MID + i]
        heat = params[_HEAT] / density
        guess = (q - s[_FLOW + i]) / shear3
        d, flow, static = plastic_increment(params, q, s[_STRAIN + i], s[_TEMPERATURE + i], dt, guess, heat)
        scale_deviator(s, i, flow / q)
        s[_STRAIN + i] += d
        s[_WORK + i] += flow * d * w[VOLUME_MID + i]
        s[_TEMPERATURE + i] += heat * flow * d
        s[_YIELD + i] = static
        s[_FLOW + i] = flow


def _constants(law: JohnsonCook) -> tuple[float, ...]:
    heat = law.taylor_quinney / law.specific_heat
    return (
        law.A, law.B, law.n, law.C, law.m, law.reference_rate, law.reference_temperature, law.melt_temperature, heat
    )  # fmt: skip


def initial_yield(law: JohnsonCook, temperature: float) -> float:
    """Flow stress at zero plastic strain and vanishing rate, Pa."""
    span = law.melt_temperature - law.reference_temperature
    homologous = min(max((temperature - law.reference_temperature) / span, 0.0), 1.0)
    return float(law.A * (1.0 - homologous**law.m))


def _begin(law: JohnsonCook, temperature: float) -> dict[int, float]:
    strength = initial_yield(law, temperature)
    return {YIELD: strength, FLOW: strength, TEMPERATURE: temperature}


LAW = Law("johnson_cook", BEFORE_PRESSURE, TEMPERATURE + 1, _constants, _begin, johnson_cook)
"""Strength with the heat of the plastic work; damage is not in it."""
