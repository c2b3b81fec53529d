"""Equations of state, which compute the pressure from the volume strain, and the tangent modulus for the wave speed.

The scratch row SEEN has the volume strain of the step, which is that of the tet or a mean over its nodes. The scratch
row CHANGE has the change of the volume of the tet, so that the computed work is equal to the work of the nodal forces.
"""

import numpy as np

from conoid.cases.model.materials import MieGruneisen

from ..elements.scratch import CHANGE, MODULUS, NODAL, SEEN, VOLUME_SEEN
from ..kernels.jit import njit
from ..model.rows import (
    DILATION,
    HEAT,
    MASS,
    NODAL_WORK,
    PORES,
    PRESSURE,
    VOLUME_RATIO,
    WORK,
    WORK_PLASTIC,
    WORK_VISCOUS,
)
from ..model.state import CHUNK, Floats
from .elastic import sheared, squeezed
from .elementary import exp
from .law import BULK, DENSITY, DILATES, EQUATION, FROM_SHAPE, ORDER, SHEAR, SPALL, Equation

_C0, _SLOPE, _GAMMA = range(EQUATION, EQUATION + 3)
_P, _MASS, _WORK, _RATIO = PRESSURE * CHUNK, MASS * CHUNK, WORK * CHUNK, VOLUME_RATIO * CHUNK
_WORK_VISCOUS, _WORK_PLASTIC, _PORES = WORK_VISCOUS * CHUNK, WORK_PLASTIC * CHUNK, PORES * CHUNK
_HEAT, _GROWN = HEAT * CHUNK, DILATION * CHUNK
_OLD, _KNOWN, _FACTOR = NODAL, NODAL + CHUNK, NODAL + 2 * CHUNK
"""Scratch rows: pressure before the step, Pa; and the coefficients factor and known of the energy equation factor *
(new pressure) = cold part + known."""
_LEAST = 0.05
"""Smallest bulk modulus in the wave speed, divided by the bulk modulus at rest. Chosen value: a limit of the bulk
modulus from below can only decrease the stable step."""


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def linear(w, s, params, n):  # type: ignore[no-untyped-def]
    """Computes the linear pressure p -= K d(volume strain), which integrates to p = -K ln(V/V0)."""
    bulk, stiff = params[BULK], params[BULK] + 4.0 / 3.0 * params[SHEAR]
    for i in range(n):
        old = s[_P + i]
        new = old - bulk * w[SEEN + i]
        s[_P + i] = new
        s[_WORK + i] -= 0.5 * (old + new) * w[CHANGE + i]
        w[MODULUS + i] = stiff
    if params[SPALL] < np.inf:
        _tear_linear(w, s, params, n)


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64, float64)", cache=True, error_model="numpy")
def _book_pores(w, s, params, i, strain, mean):  # type: ignore[no-untyped-def]
    """Adds the plastic work of pores that have grown by the volume strain ``strain``. In the same way as for the total
    work, it is the ``mean`` pressure of the step times ``strain``. Corrects the elastic energy, because its density
    belongs to another volume after the growth.
    """
    stored = squeezed(s, params, i)
    if params[ORDER] != FROM_SHAPE:
        stored += sheared(s, params, i)
    s[_WORK_PLASTIC + i] -= w[VOLUME_SEEN + i] * strain * (mean + stored)


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def _tear_linear(w, s, params, n):  # type: ignore[no-untyped-def]
    """Limits the pressure p by moving volume strain between solid and pores: p >= -spall always, and p <= 0 while the
    tet has pores. If the averaged pressure forms have subtracted a dilation (row DILATION below zero), the pressure
    before the step contains this dilation.
    """
    bulk, spall, dilates = params[BULK], params[SPALL], params[DILATES] > 0.0
    for i in range(n):
        p, pores = s[_P + i], s[_PORES + i]
        if not (p < -spall or (pores > 0.0 and p > 0.0)):
            continue
        strain = max((-spall - p) / bulk if p < 0.0 else -p / bulk, -pores)
        s[_P + i] = p + bulk * strain
        s[_PORES + i] = pores + strain
        s[_WORK + i] -= 0.5 * bulk * strain * w[CHANGE + i]
        subtracted = max(-s[_GROWN + i], 0.0) if dilates else 0.0
        _book_pores(w, s, params, i, strain, 0.5 * (p + bulk * (w[SEEN + i] + subtracted) + s[_P + i]))


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def volumes_by_ratio(w, s, params, n):  # type: ignore[no-untyped-def]
    """Sets the row VOLUME_SEEN to its value at step n, m^3, for tets that store the volume ratio of their solid."""
    per_density, porous = 1.0 / params[DENSITY], params[SPALL] < np.inf
    for i in range(n):
        whole = 1.0 + s[_PORES + i] if porous else 1.0
        w[VOLUME_SEEN + i] = s[_MASS + i] * per_density * s[_RATIO + i] * whole


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def volumes_by_pressure(w, s, params, n):  # type: ignore[no-untyped-def]
    """Sets the row VOLUME_SEEN to its value at step n, m^3, for the linear pressure: V0 exp(pores - p / K)."""
    per_density, per_bulk, porous = 1.0 / params[DENSITY], 1.0 / params[BULK], params[SPALL] < np.inf
    for i in range(n):
        pores = s[_PORES + i] if porous else 0.0
        w[VOLUME_SEEN + i] = s[_MASS + i] * per_density * exp(pores - s[_P + i] * per_bulk)


@njit("UniTuple(float64, 2)(float64[::1], float64)", cache=True, error_model="numpy", forceinline=True)
def cold(params, ratio):  # type: ignore[no-untyped-def]
    """Returns the pressure without heat at a volume ratio, p = p_H (1 - gamma chi / 2), and its derivative dp/dchi.

    The result is NaN if the Hugoniot curve does not exist: at and beyond the pole of p_H, chi = 1 / S, and for a volume
    that is not positive.
    """
    gamma, slope = params[_GAMMA], params[_SLOPE]
    stiffness = params[DENSITY] * params[_C0] * params[_C0]
    chi = 1.0 - ratio
    squeezed = max(chi, 0.0)
    gap = min(1.0 - slope * squeezed, ratio)
    d = 1.0 / (1.0 - slope * squeezed) if gap > 0.0 else np.nan
    return (
        stiffness * chi * d * d * (1.0 - 0.5 * gamma * squeezed),
        stiffness * d * d * d * (1.0 + (slope - gamma) * squeezed),
    )


@njit("float64(float64[::1], float64, float64, float64)", cache=True, error_model="numpy", forceinline=True)
def modulus(params, ratio, tangent, pressure):  # type: ignore[no-untyped-def]
    """Returns rho c^2, Pa, with the wave speed c. The bulk modulus in this formula is at least _LEAST times the bulk
    modulus at rest, because strong tension makes the tangent negative. If the tangent modulus is NaN, the result is
    NaN.
    """
    bulk, least = ratio * (tangent + params[_GAMMA] * pressure), _LEAST * params[BULK]
    return (least if bulk < least else bulk) + 4.0 / 3.0 * params[SHEAR]


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def mie_gruneisen(w, s, params, n):  # type: ignore[no-untyped-def]
    """Computes the Mie-Grueneisen pressure p = p_H(chi) (1 - gamma chi / 2) + gamma rho_0 e, with chi = 1 - V/V0. In
    tension p_H is rho_0 c0^2 chi.

    The specific energy e is the work so far (of stress, plastic and viscous) divided by the mass. The energy equation
    uses the mean pressure of the step, is linear in the new pressure, and is solved in closed form. The factor 1 -
    gamma chi / 2 applies to compression only. In the averaged pressure forms e is HEAT, a mean over nodes except for
    flat tets, plus the work of the pressure in this step, which is then the work on the averaged volume.
    """
    gamma, heating = params[_GAMMA], params[_GAMMA] * params[DENSITY]
    averaged, bulk = len(s) > NODAL_WORK * CHUNK, params[BULK]
    for i in range(n):
        half = 0.5 * w[SEEN + i]
        ratio = s[_RATIO + i] * (1.0 + half) / (1.0 - half)
        base, tangent = cold(params, ratio)
        change = w[CHANGE + i]
        mass, old = s[_MASS + i], s[_P + i]
        if averaged:
            moved = ratio - s[_RATIO + i]
            known, factor = gamma * (bulk * s[_HEAT + i] - 0.5 * old * moved), 1.0 + 0.5 * gamma * moved
        else:
            coefficient = heating / mass
            known = coefficient * (s[_WORK + i] + s[_WORK_VISCOUS + i] - 0.5 * old * change)
            factor = 1.0 + 0.5 * coefficient * change
        new = (base + known) / factor
        w[_OLD + i], w[_KNOWN + i], w[_FACTOR + i] = old, known, factor
        s[_P + i] = new
        s[_RATIO + i] = ratio
        s[_WORK + i] -= 0.5 * (old + new) * change
        w[MODULUS + i] = modulus(params, ratio, tangent, new)
    if params[SPALL] < np.inf:
        _tear(w, s, params, n)


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def _tear(w, s, params, n):  # type: ignore[no-untyped-def]
    """Limits the pressure of Mie-Grueneisen in the same way as ``_tear_linear``. At the cut-off, and at zero pressure
    while pores close, the cold pressure is linear in the volume ratio of the solid; in these two states the ratio is
    computed from the pressure. After the pores have closed, the pressure is computed from the ratio.
    """
    spall, stiffness = params[SPALL], params[BULK]
    for i in range(n):
        p, pores = s[_P + i], s[_PORES + i]
        if not (p < -spall or (pores > 0.0 and p > 0.0)):
            continue
        old, change, known, factor = w[_OLD + i], w[CHANGE + i], w[_KNOWN + i], w[_FACTOR + i]
        before = s[_WORK + i] + 0.5 * (old + p) * change
        whole = (1.0 + pores) * s[_RATIO + i]
        new = -spall if p < 0.0 else 0.0
        ratio = 1.0 - (new * factor - known) / stiffness
        if ratio > whole:
            ratio = whole
            new = (cold(params, ratio)[0] + known) / factor
        s[_P + i], s[_RATIO + i], s[_PORES + i] = new, ratio, whole / ratio - 1.0
        s[_WORK + i] = before - 0.5 * (old + new) * change
        _book_pores(w, s, params, i, 1.0 - (1.0 + pores) * ratio / whole, 0.5 * (old + new))
        w[MODULUS + i] = modulus(params, ratio, cold(params, ratio)[1], new)


def _gruneisen(eos: MieGruneisen) -> tuple[float, ...]:
    return eos.c0, eos.S, eos.gamma0


def pole(params: Floats) -> float:
    """Returns the compression 1 - V/V0 at which p_H is infinite, which is 1 / S. The result is at most 1, where the
    volume is zero.
    """
    return 1.0 / max(float(params[_SLOPE]), 1.0)


ELASTIC = Equation("", 0, lambda _: (), linear, volumes_by_pressure)
"""Linear pressure. Its bulk modulus is that of the elastic constants."""
GRUNEISEN = Equation("mie_gruneisen", VOLUME_RATIO + 1, _gruneisen, mie_gruneisen, volumes_by_ratio, NODAL_WORK + 1)
"""Mie-Grueneisen equation of state. The pressure depends on compression and on heat."""
