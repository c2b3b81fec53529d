"""Johnson-Cook strength law: radial return to the flow stress, with adiabatic heating.

sigma = (A + B e^n) (1 + C ln max(rate / rate_0, 1)) (1 - T*^m), with the plastic strain e. Source: Johnson and Cook
1983. With ``softening`` s the flow stress is multiplied by 1 - s D, where D is the damage at the start of the step
(Borvik and others 2001).

The yielding tets of a chunk are copied side by side into the scratch memory and solved together, loop after loop, with
the logarithms and powers of elementary.py. Converged tets are moved to the end of the list and are not changed again,
so that no result depends on the other tets of the chunk.
"""

from conoid.cases.laws.johnson_cook import JohnsonCook

from ..elements.scratch import D_XX, D_XY, D_YY, D_YZ, D_ZX, D_ZZ, NODAL, TRIAL, VOLUME_MID
from ..kernels.jit import njit
from ..model.rows import (
    DAMAGE,
    FLOW,
    MASS,
    PLASTIC_STRAIN,
    PRESSURE,
    S_XX,
    S_XY,
    S_YY,
    S_YZ,
    S_ZX,
    S_ZZ,
    TEMPERATURE,
    WORK_PLASTIC,
    YIELD,
)
from ..model.state import CHUNK
from .elementary import logarithms, power, powers
from .law import BEFORE_PRESSURE, FIRST, SHEAR, Law
from .plastic import equivalent_stress

_A, _B, _N, _C, _M, _RATE, _T0, _MELT, _HEAT, _DAMAGED, _D1, _D2, _D3, _D4, _D5, _SOFTENING = range(FIRST, FIRST + 16)
_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_STRAIN, _WORK, _YIELD, _FLOW = PLASTIC_STRAIN * CHUNK, WORK_PLASTIC * CHUNK, YIELD * CHUNK, FLOW * CHUNK
_TEMPERATURE, _MASS, _P, _DAMAGE = TEMPERATURE * CHUNK, MASS * CHUNK, PRESSURE * CHUNK, DAMAGE * CHUNK
# Scratch rows with one value for each yielding tet. First: place in the chunk; known quantities; fraction of the
# strength that damage leaves; bracket; increment; flag, 1 if the increment has not converged; flow stress without rate.
# Then: e, T* and the relative rate; and the logarithms and powers of these three.
_PLACE, _Q, _KNOWN, _HOT, _WARM, _LEFT, _LOW, _HIGH, _D, _OPEN, _STATIC, _SUM, _FAST, _SOFT, _T = (
    NODAL + k * CHUNK for k in range(15)
)
_MOST = 140
"""Largest number of iterations. At least every second iteration halves the bracket, so the bracket reaches the last bit
of a float64 (52 bits)."""
_CLOSE = 1e-4
"""Relative Newton step at which the iteration ends. The remaining error of the strain increment is the square of the
last Newton step, below 1e-8 of the stress."""
_PATIENT = 20
"""Number of iterations after which every second iteration halves the bracket, because with softening Newton's method
may alternate between two values. First yield, with increments between 1e-2 and 1e-21, takes up to 20 iterations without
halving; smaller increments, for a trial stress less than 1e5 Pa above the flow stress, take up to 100 iterations with
halving."""
_BELOW = 1.0 - 2.0**-40
"""Factor slightly below 1. The rate term begins at a certain increment, where the flow stress has a kink. The product
of the factor and the increment at the kink is just below the kink."""
_NARROW = 1e-12
"""Relative width of the bracket at which the iteration ends."""
_STEEPEST = 600.0
"""Largest magnitude of the exponent of e in the fracture strain, which is then between 0 and 1e260."""
_MOST_TENSE = 1.5
"""Largest ratio of tension to flow stress in the formula for the fracture strain. Johnson and Cook 1985 give no
measurements at larger ratios."""
_LEAST_STRAIN = 1e-6
"""Smallest fracture strain. Chosen value: if the constants give a negative fracture strain, a tet breaks at first
yield."""
_TWO_THIRDS = 2.0 / 3.0
_TINY = 1e-300
"""Smallest argument of a logarithm; an argument of zero is replaced by this value."""


@njit("int64(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def gather(w, s, params, n):  # type: ignore[no-untyped-def]
    """Copies the tets above their rate-free flow stress side by side into the scratch memory. Returns their number. The
    plastic increment of each tet is in the bracket [0, q / 3 G], with the von Mises trial stress q.
    """
    m, shear3, softening = 0, 3.0 * params[SHEAR], params[_SOFTENING]
    for i in range(n):
        q = w[TRIAL + i]
        if q > s[_YIELD + i]:
            w[_PLACE + m], w[_Q + m] = i, q
            w[_KNOWN + m], w[_HOT + m] = s[_STRAIN + i], s[_TEMPERATURE + i]
            w[_WARM + m] = w[VOLUME_MID + i] / s[_MASS + i]
            w[_D + m] = s[_FLOW + i]
            w[_LEFT + m] = 1.0 - softening * s[_DAMAGE + i] if softening > 0.0 else 1.0
            m += 1
    for j in range(m):
        high = w[_Q + j] / shear3
        w[_WARM + j] *= params[_HEAT]
        w[_D + j] = min(max((w[_Q + j] - w[_D + j]) / shear3, 1e-3 * high), high)
        w[_LOW + j], w[_HIGH + j], w[_OPEN + j] = 0.0, high, 1.0
    return m


@njit("void(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def _factors(w, params, m, dt):  # type: ignore[no-untyped-def]
    """Computes e^n, the logarithm of the relative rate (at least 0), and T*^m, at the present increments."""
    shear3, fast, cold = 3.0 * params[SHEAR], 1.0 / (dt * params[_RATE]), params[_T0]
    per_span = 1.0 / (params[_MELT] - params[_T0])
    for j in range(m):
        d = w[_D + j]
        soft = (w[_HOT + j] + w[_WARM + j] * d * (w[_Q + j] - shear3 * d) - cold) * per_span
        w[_SUM + j] = max(w[_KNOWN + j] + d, _TINY)
        w[_FAST + j] = max(d * fast, 1.0)
        w[_T + j] = soft
        w[_SOFT + j] = min(max(soft, _TINY), 1.0)
    logarithms(w, _SUM, m)
    powers(w, _SUM, m, params[_N])
    logarithms(w, _FAST, m)
    if params[_M] != 1.0:
        logarithms(w, _SOFT, m)
        powers(w, _SOFT, m, params[_M])


@njit("int64(float64[::1], float64[::1], int64, float64, boolean)", cache=True, error_model="numpy")
def _newton(w, params, m, dt, halve):  # type: ignore[no-untyped-def]
    """Executes one iteration of q - 3 G d = flow stress(d) for ``m`` tets; returns the number of tets that have not
    converged.

    The left side decreases with d, and the right side increases until the metal softens, so the root stays in its
    bracket.

    The step is in ln d, to second order, if the flow stress increases more steeply than the trial stress decreases (as
    the logarithm or a power of d: by the rate, or on first yield). The step is also in ln d if a step in d would cross
    the kink at which the rate term begins, because such steps would alternate between 1e-9 and 1e-5. A step in ln d
    that crosses the kink ends at the kink. With ``halve`` the bracket is always halved.
    """
    shear3, going, kink = 3.0 * params[SHEAR], 0, _BELOW * dt * params[_RATE]
    a, b, n, c, per_span = params[_A], params[_B], params[_N], params[_C], params[_M] / (params[_MELT] - params[_T0])
    for j in range(m):
        # 1. Compute residual and slope at d.
        d, low, high, warm = w[_D + j], w[_LOW + j], w[_HIGH + j], w[_WARM + j]
        stress, within = w[_Q + j] - shear3 * d, w[_T + j]
        power, strain = b * w[_SUM + j], max(w[_KNOWN + j] + d, _TINY)
        hardening, rate = a + power, 1.0 + c * w[_FAST + j]
        soft = w[_SOFT + j] if within > 0.0 else 0.0
        left = w[_LEFT + j]
        heat = left * (1.0 - soft)
        melting = (within > 0.0) & (within < 1.0)
        by_heat = per_span * soft / (within if melting else 1.0)
        by_heat = -left * by_heat if melting else 0.0
        counts = w[_FAST + j] > 0.0
        by_rate = c * hardening / d
        by_rate = by_rate * heat if counts else 0.0
        by_strain = n * power / strain * rate * heat
        residual = stress - hardening * rate * heat
        slope = -shear3 - by_strain - by_rate - hardening * rate * by_heat * warm * (stress - shear3 * d)
        # 2. Update the bracket.
        low, high = (d if residual > 0.0 else low), (high if residual > 0.0 else d)
        # 3. Compute the Newton step.
        new = d - residual / slope
        x = (new - d) / d
        grown = 1.0 + abs(x) + 0.5 * x * x
        grown = d * grown if x > 0.0 else d / grown
        steep = (by_rate + by_strain * d / strain > shear3) | (counts & (new < kink))
        new = grown if steep else new
        passes = counts & (new < kink)
        new = kink if passes else new
        # 4. Halve the bracket instead, if needed.
        newton = (low <= new) & (new <= high) & (slope < 0.0) & (not halve)
        new = new if newton else 0.5 * (low + high)
        # 5. Test the convergence.
        done = (newton & (not passes) & (abs(new - d) <= _CLOSE * new)) | (high - low <= _NARROW * high)
        w[_STATIC + j] = hardening * heat
        w[_D + j], w[_LOW + j], w[_HIGH + j] = new, low, high
        w[_OPEN + j] = 0.0 if done else 1.0
        going += int(not done)
    return going


@njit("int64(float64[::1], int64)", cache=True)
def _open_first(w, m):  # type: ignore[no-untyped-def]
    """Moves those of the ``m`` tets that have not converged to the front; returns their number."""
    n = 0
    for j in range(m):
        if w[_OPEN + j] > 0.0:
            if n < j:
                for row in range(_PLACE, _STATIC + CHUNK, CHUNK):
                    w[row + n], w[row + j] = w[row + j], w[row + n]
            n += 1
    return n


@njit("int64(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def increments(w, params, m, dt):  # type: ignore[no-untyped-def]
    """Computes the plastic strain increments of ``m`` tets in the scratch memory. Returns the total number of
    iterations.
    """
    sought, steps = m, 0
    for k in range(_MOST):
        steps += sought
        _factors(w, params, sought, dt)
        if _newton(w, params, sought, dt, k >= _PATIENT and k % 2 == 1) < sought:
            sought = _open_first(w, sought)
        if sought == 0:
            break
    return steps


@njit("void(float64[::1], float64[::1], float64[::1], int64, int64, float64)", cache=True, error_model="numpy")
def _return(w, s, params, m, n, dt):  # type: ignore[no-untyped-def]
    """Scales the deviatoric stress to the flow stress. Adds plastic strain, heat, and the plastic work, which is the
    work of the mean of the rotated old stress and the new stress (as in mohr_coulomb.py); with this mean the remaining
    work is equal to the elastic energy of the stress.
    """
    shear3, shear2 = 3.0 * params[SHEAR], 2.0 * params[SHEAR]
    for i in range(n):
        w[TRIAL + i] = 1.0
    for j in range(m):
        i, q, d = int(w[_PLACE + j]), w[_Q + j], w[_D + j]
        flow = max(q - shear3 * d, 0.0)
        factor = flow / q
        w[TRIAL + i] = factor
        moved = (
            s[_SXX + i] * w[D_XX + i]
            + s[_SYY + i] * w[D_YY + i]
            + s[_SZZ + i] * w[D_ZZ + i]
            + 2.0 * (s[_SYZ + i] * w[D_YZ + i] + s[_SZX + i] * w[D_ZX + i] + s[_SXY + i] * w[D_XY + i])
        )
        twice = (1.0 + factor) * _TWO_THIRDS * q * q - shear2 * dt * moved
        s[_STRAIN + i] += d
        s[_WORK + i] += w[VOLUME_MID + i] * (1.0 - factor) * max(twice, 0.0) / (2.0 * shear2)
        s[_TEMPERATURE + i] += w[_WARM + j] * flow * d
        s[_YIELD + i] = w[_STATIC + j]
        s[_FLOW + i] = flow
    for i in range(n):
        factor = w[TRIAL + i]
        s[_SXX + i], s[_SYY + i], s[_SZZ + i] = factor * s[_SXX + i], factor * s[_SYY + i], factor * s[_SZZ + i]
        s[_SYZ + i], s[_SZX + i], s[_SXY + i] = factor * s[_SYZ + i], factor * s[_SZX + i], factor * s[_SXY + i]


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def _wear(w, s, params, m, dt):  # type: ignore[no-untyped-def]
    """Adds d / fracture strain to the damage, with the plastic increment d. The damage is at most 1. The fracture
    strain is (D1 + D2 e^(D3 t)) (1 + D4 ln rate) (1 + D5 T*).

    Here t is the ratio of the tension -p to the flow stress, at most _MOST_TENSE, computed with the pressure at the
    start of the step. Source: Johnson and Cook 1985.
    """
    fast, per_span = 1.0 / (dt * params[_RATE]), 1.0 / (params[_MELT] - params[_T0])
    for j in range(m):
        i = int(w[_PLACE + j])
        tense = min(-s[_P + i] / max(s[_FLOW + i], _TINY), _MOST_TENSE)
        w[_SOFT + j] = min(max(params[_D3] * tense, -_STEEPEST), _STEEPEST)
        w[_FAST + j] = max(w[_D + j] * fast, 1.0)
        w[_T + j] = min(max((s[_TEMPERATURE + i] - params[_T0]) * per_span, 0.0), 1.0)
    powers(w, _SOFT, m, 1.0)
    logarithms(w, _FAST, m)
    for j in range(m):
        i = int(w[_PLACE + j])
        shape = (params[_D1] + params[_D2] * w[_SOFT + j]) * (1.0 + params[_D5] * w[_T + j])
        fracture = max(shape * (1.0 + params[_D4] * w[_FAST + j]), _LEAST_STRAIN)
        grown = s[_DAMAGE + i] + w[_D + j] / fracture
        s[_DAMAGE + i] = 1.0 if grown > 1.0 else grown


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def johnson_cook(w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Returns the trial stress to the flow stress, for tets above their rate-free flow stress. Heats these tets."""
    equivalent_stress(w, s, n)
    m = gather(w, s, params, n)
    if m == 0:
        return
    increments(w, params, m, dt)
    _return(w, s, params, m, n, dt)
    if params[_DAMAGED] > 0.0:
        _wear(w, s, params, m, dt)


def _constants(law: JohnsonCook) -> tuple[float, ...]:
    heat = law.taylor_quinney / law.specific_heat
    return (
        law.A, law.B, law.n, law.C, law.m, law.reference_rate, law.reference_temperature, law.melt_temperature, heat,
        *((0.0,) * 7 if (of := law.damage) is None else (1.0, of.D1, of.D2, of.D3, of.D4, of.D5, of.softening)),
    )  # fmt: skip


def initial_yield(law: JohnsonCook, temperature: float) -> float:
    """Returns the flow stress at zero plastic strain and vanishing rate, Pa."""
    span = law.melt_temperature - law.reference_temperature
    homologous = min(max((temperature - law.reference_temperature) / span, 0.0), 1.0)
    return float(law.A * (1.0 - power(homologous, law.m)))


def _rows(law: JohnsonCook) -> int:
    return (TEMPERATURE if law.damage is None else DAMAGE) + 1


def _begin(law: JohnsonCook, temperature: float) -> dict[int, float]:
    strength = initial_yield(law, temperature)
    return {YIELD: strength, FLOW: strength, TEMPERATURE: temperature}


LAW = Law("johnson_cook", BEFORE_PRESSURE, _rows, _constants, _begin, johnson_cook)
"""Johnson-Cook strength law with heat from plastic work, and with damage. Erosion removes tets by their damage."""
