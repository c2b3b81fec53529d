"""Barrier pressure against the collapse of tets in the averaged pressure forms.

The averaged pressure of a tet depends on the mean volume strain of its nodes; only the deviatoric stress resists a
change of the own volume of the tet. After yield, the volume of a tet at an edge of a body, whose nodes have few other
tets, may decrease to zero while the mean volume strain stays constant. If the volume V of a tet is below SQUEEZED times
its initial volume V0, the additional pressure b acts in the tet (K: bulk modulus):

    b(J) = STIFF K (SQUEEZED / J - 1)^2,    J = V / V0 < SQUEEZED

The energy of the barrier is elastic. Parts with erosion have no barrier, because erosion removes squeezed tets
(docs/theory/elements.md, Pressure forms).
"""

import numpy as np

from ..kernels.jit import njit
from ..materials.law import BULK, DENSITY, Q_LINEAR, Q_QUADRATIC, Q_SHOCK
from ..model.rows import MASS, VISCOUS, WORK, WORK_VISCOUS
from ..model.state import CHUNK
from .scratch import CHANGE, LIMIT, MODULUS, VOLUME

SQUEEZED = 0.2
"""Ratio of the volume of a tet to its initial volume, below which the barrier pressure acts. Chosen value: the smallest
volume ratio of tets is 0.56 in Taylor bars, and 0.28 in a long rod without erosion."""
STIFF = 0.1
"""Stiffness of the barrier, divided by the bulk modulus. Chosen value: compression to half of SQUEEZED requires a
pressure of 10 % of the bulk modulus, which is far more than the yield stress of metals."""

_ROUNDING = 1e-9
"""Relative tolerance of a volume ratio. The tolerance is far above the round-off difference between two ways of
computing the same ratio."""
_Q, _MASS, _WORK, _WORK_VISCOUS = VISCOUS * CHUNK, MASS * CHUNK, WORK * CHUNK, WORK_VISCOUS * CHUNK


@njit("UniTuple(float64, 2)(float64, float64)", cache=True, error_model="numpy")
def _barrier(ratio, bulk):  # type: ignore[no-untyped-def]
    """Returns the barrier pressure b and -J db/dJ, Pa. If the volume of the tet is not positive, b and its derivative
    are zero; the stable step of such a tet is NaN.
    """
    if not 0.0 < ratio < SQUEEZED:
        return 0.0, 0.0
    times = SQUEEZED / ratio
    depth = times - 1.0
    return STIFF * bulk * depth * depth, 2.0 * STIFF * bulk * depth * times


@njit("boolean(float64[::1], float64[::1], float64, int64)", cache=True, error_model="numpy")
def _any_squeezed(w, s, density, n):  # type: ignore[no-untyped-def]
    """Returns True if the volume of a tet, before or after the step, is below SQUEEZED times its initial volume, or
    equal to this limit within round-off. The loop uses vector instructions.
    """
    per_mass, found = density / (SQUEEZED * (1.0 + _ROUNDING)), 0
    for i in range(n):
        volume, before, mass = w[VOLUME + i] * per_mass, (w[VOLUME + i] - w[CHANGE + i]) * per_mass, s[_MASS + i]
        found += (volume < mass) | (before < mass)
    return found > 0


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def resist(w, s, params, n):  # type: ignore[no-untyped-def]
    """Adds the barrier pressure to the row VISCOUS, which is recomputed in every step. Adds the work of the barrier to
    the row WORK, and the stiffness of the barrier to the row LIMIT.

    The function for the viscosity has added half of the work of the old row VISCOUS to its own account. The function
    ``resist`` subtracts the part of the viscous work that is due to the barrier.
    """
    if not _any_squeezed(w, s, params[DENSITY], n):
        return
    viscous = max(params[Q_LINEAR], params[Q_SHOCK], params[Q_QUADRATIC]) > 0.0
    for i in range(n):
        whole = s[_MASS + i] / params[DENSITY]
        ratio, before = w[VOLUME + i] / whole, (w[VOLUME + i] - w[CHANGE + i]) / whole
        if min(ratio, before) >= SQUEEZED:
            continue
        new, stiff = _barrier(ratio, params[BULK])
        old, _ = _barrier(before, params[BULK])
        s[_WORK + i] -= 0.5 * (old + new) * w[CHANGE + i]
        if viscous:
            s[_WORK_VISCOUS + i] += 0.5 * old * w[CHANGE + i]
            s[_Q + i] += new
        else:
            s[_Q + i] = new
        w[LIMIT + i] *= np.sqrt(1.0 + stiff / w[MODULUS + i])
