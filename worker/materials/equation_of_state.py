"""Pressure from the dilatation, and the tangent modulus that sets the wave speed.

Both take the volume strain of the step that the pressure sees (the tet's own, or averaged over its nodes) from row
SEEN of the scratch, and the tet's own change of volume from CHANGE, so that the work is what the nodal forces do.
"""

from conoid.cases.materials import MieGruneisen

from ..elements.tet4 import CHANGE, MODULUS, SEEN
from ..jit import njit
from ..state import CHUNK, MASS, PRESSURE, VOLUME_RATIO, WORK, WORK_VISCOUS
from .law import BULK, DENSITY, EQUATION, SHEAR, Equation

_C0, _SLOPE, _GAMMA = range(EQUATION, EQUATION + 3)
_P, _MASS, _WORK, _RATIO = PRESSURE * CHUNK, MASS * CHUNK, WORK * CHUNK, VOLUME_RATIO * CHUNK
_WORK_VISCOUS = WORK_VISCOUS * CHUNK


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def linear(w, s, params, n):  # type: ignore[no-untyped-def]
    """p -= K d(volume strain): integrates to p = -K ln(V/V0)."""
    bulk, modulus = params[BULK], params[BULK] + 4.0 / 3.0 * params[SHEAR]
    for i in range(n):
        old = s[_P + i]
        new = old - bulk * w[SEEN + i]
        s[_P + i] = new
        s[_WORK + i] -= 0.5 * (old + new) * w[CHANGE + i]
        w[MODULUS + i] = modulus


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def mie_gruneisen(w, s, params, n):  # type: ignore[no-untyped-def]
    """p = p_H(chi) (1 - gamma chi / 2) + gamma rho_0 e, chi = 1 - V/V0; in tension p_H is rho_0 c0^2 chi.

    e is the work done so far (stress, plastic and viscous) over the mass. The energy equation with the mean pressure
    of the step is linear in the new pressure and solved in closed form. The factor 1 - gamma chi / 2 applies to
    compression only.
    """
    density, shear, gamma, slope = params[DENSITY], params[SHEAR], params[_GAMMA], params[_SLOPE]
    stiffness = density * params[_C0] * params[_C0]
    for i in range(n):
        half = 0.5 * w[SEEN + i]
        ratio = s[_RATIO + i] * (1.0 + half) / (1.0 - half)
        chi = 1.0 - ratio
        squeezed = max(chi, 0.0)
        d = 1.0 / (1.0 - slope * squeezed)
        cold = stiffness * chi * d * d * (1.0 - 0.5 * gamma * squeezed)
        tangent = stiffness * d * d * d * (1.0 + (slope - gamma) * squeezed)
        change = w[CHANGE + i]
        mass, old = s[_MASS + i], s[_P + i]
        coefficient = gamma * density / mass
        known = cold + coefficient * (s[_WORK + i] + s[_WORK_VISCOUS + i] - 0.5 * old * change)
        new = known / (1.0 + 0.5 * coefficient * change)
        s[_P + i] = new
        s[_RATIO + i] = ratio
        s[_WORK + i] -= 0.5 * (old + new) * change
        w[MODULUS + i] = ratio * (tangent + gamma * new) + 4.0 / 3.0 * shear


def _gruneisen(eos: MieGruneisen) -> tuple[float, ...]:
    return eos.c0, eos.S, eos.gamma0


ELASTIC = Equation("", 0, lambda _: (), linear)
"""The pressure of the elasticity."""
GRUNEISEN = Equation("mie_gruneisen", VOLUME_RATIO + 1, _gruneisen, mie_gruneisen)
"""Compression and heat."""
