"""J2 plasticity with linear hardening and the rate factor of Cowper and Symonds. The stress is returned radially to the
yield surface.

sigma = (Y + H e) (1 + (rate / D)^(1/q)); Source: Cowper and Symonds 1957. Derived in docs/theory/materials.md.

The yielding tets of a chunk are copied side by side into the scratch memory and solved together, as in johnson_cook.py.
"""

from conoid.cases.laws.cowper_symonds import CowperSymonds

from ..elements.scratch import NODAL, TRIAL
from ..kernels.jit import njit
from ..model.rows import PLASTIC_STRAIN, YIELD
from ..model.state import CHUNK
from .elementary import LEAST, MOST, exp, log
from .law import BEFORE_PRESSURE, FIRST, SHEAR, Law
from .plastic import FACTOR, equivalent_stress, return_radially

_HARDENING, _RATE, _Q = FIRST, FIRST + 1, FIRST + 2
_STRAIN, _YIELD = PLASTIC_STRAIN * CHUNK, YIELD * CHUNK
PLACE, OVER, STATIC, ROOT, STEP = (NODAL + k * CHUNK for k in range(1, 6))
"""Scratch rows with one value for each yielding tet: place in the chunk; trial stress less static flow stress, Pa;
static flow stress before the step, Pa; u = (d / (dt D))^(1/q); last Newton step in u, which is positive while u has not
converged, and then 0."""
_MOST_ITERATIONS = 60
"""Largest number of iterations. Random states need at most 11 iterations (tests/worker/test_cowper_symonds.py)."""
_CLOSE = 1e-6
"""Relative Newton step at which the iteration ends. The relative error of the strain increment is then q^2/2 times the
square of this step: 1e-11 with q = 5."""
_LARGE = 1e300
"""Largest start value of u^q; it replaces the infinite start value of a step with dt = 0."""


@njit("int64(float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def _gather(w, s, n):  # type: ignore[no-untyped-def]
    """Copies the tets above their static flow stress side by side into the scratch memory. Returns their number."""
    m = 0
    for i in range(n):
        w[FACTOR + i] = 1.0
        if w[TRIAL + i] > s[_YIELD + i]:
            w[PLACE + m], w[OVER + m], w[STATIC + m] = i, w[TRIAL + i] - s[_YIELD + i], s[_YIELD + i]
            m += 1
    return m


@njit("int64(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def _newton(w, params, m, fast):  # type: ignore[no-untyped-def]
    """Executes one iteration for ``m`` tets; returns the number of tets that have not converged."""
    shear3, hardening, q, going = 3.0 * params[SHEAR], params[_HARDENING], params[_Q], 0
    for j in range(m):
        u, strength = w[ROOT + j], w[STATIC + j]
        d = fast * exp(max(min(q * log(u), MOST), LEAST))
        stiffness = shear3 + hardening * (1.0 + u)
        excess = stiffness * d + strength * u - w[OVER + j]
        slope = stiffness * q * d / u + strength + hardening * d
        change = excess / slope if w[STEP + j] > 0.0 else 0.0
        w[ROOT + j] = u - change
        is_open = abs(change) > _CLOSE * u
        w[STEP + j] = 1.0 if is_open else 0.0
        going += int(is_open)
    return going


@njit("int64(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def increments(w, params, m, fast):  # type: ignore[no-untyped-def]
    """Replaces row ROOT by the plastic strain increments d = fast u^q of the ``m`` tets in the scratch; returns the
    number of iterations. ``fast`` is dt D, with the time step dt and the constant D of the law; u is the root of

        OVER = 3 G d + STATIC u + H d (1 + u)

    The right side increases with u and is convex, so that Newton's method converges from above without a bracket. The
    iteration begins at the smaller of the two roots of the equation with only the term STATIC u and with only the term
    (3 G + H) d; this value is above the root.
    """
    stiffness, q, count = 3.0 * params[SHEAR] + params[_HARDENING], params[_Q], 0
    for j in range(m):
        power = min(w[OVER + j] / (stiffness * fast), _LARGE)
        w[ROOT + j] = min(w[OVER + j] / w[STATIC + j], exp(log(power) / q))
        w[STEP + j] = 1.0
    for _ in range(_MOST_ITERATIONS):
        count += 1
        if _newton(w, params, m, fast) == 0:
            break
    for j in range(m):
        w[ROOT + j] = fast * exp(max(min(q * log(w[ROOT + j]), MOST), LEAST))
    return count


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def cowper_symonds(w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Returns the trial stress radially to the flow stress at the strain rate of the step, for tets above their static
    flow stress.
    """
    equivalent_stress(w, s, n)
    m = _gather(w, s, n)
    if m == 0:
        return
    increments(w, params, m, dt * params[_RATE])
    shear3, hardening = 3.0 * params[SHEAR], params[_HARDENING]
    for j in range(m):
        i, d = int(w[PLACE + j]), w[ROOT + j]
        w[FACTOR + i] = (w[TRIAL + i] - shear3 * d) / w[TRIAL + i]
        s[_YIELD + i] += hardening * d
        s[_STRAIN + i] += d
    return_radially(w, s, params, n, dt)


def _begin(law: CowperSymonds, _: float) -> dict[int, float]:
    return {YIELD: law.yield_stress}


LAW = Law(
    "cowper_symonds", BEFORE_PRESSURE, lambda _: YIELD + 1, lambda law: (law.hardening, law.D, law.q), _begin,
    cowper_symonds,
)  # fmt: skip
"""J2 strength law with linear hardening and a power law of the strain rate. The static flow stress is a state row."""
