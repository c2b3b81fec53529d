"""Which constants a material carries into the kernels: one flat vector a block, at fixed places.

A strength model or an equation of state is a number here, a declaration of constants, and a function over a chunk of
elements in a file of its own; the sweep picks the function once a chunk.
"""

import math

import numpy as np

from conoid.cases.materials import JohnsonCook, LinearHardening, Material, MieGruneisen, MohrCoulomb
from conoid.cases.schema import Viscosity

from .. import state
from ..state import Floats

# Strength models.
ELASTIC, LINEAR_HARDENING, JOHNSON_COOK, MOHR_COULOMB = range(4)

# Equations of state.
LINEAR, MIE_GRUNEISEN = range(2)

# Places in the vector.
DENSITY, BULK, SHEAR, Q_LINEAR, Q_QUADRATIC = range(5)
C0, SLOPE, GAMMA = range(5, 8)
YIELD_0, HARDENING = range(8, 10)
JC_A, JC_B, JC_N, JC_C, JC_M, JC_RATE, JC_T0, JC_MELT, JC_HEAT = range(8, 17)
MC_SINE, MC_COHESION, MC_CAP, MC_FAILURE = 8, 9, 12, 13
MC_RESIDUAL = 2
"""How far behind MC_SINE and MC_COHESION those of failed material stand."""
SIZE = 17
"""Length of the vector."""


def strength_of(material: Material) -> int:
    """The number of the material's strength model."""
    if isinstance(material.strength, JohnsonCook):
        return JOHNSON_COOK
    if isinstance(material.strength, MohrCoulomb):
        return MOHR_COULOMB
    return LINEAR_HARDENING if isinstance(material.strength, LinearHardening) else ELASTIC


def eos_of(material: Material) -> int:
    """The number of the material's equation of state."""
    return MIE_GRUNEISEN if isinstance(material.eos, MieGruneisen) else LINEAR


def moduli(material: Material) -> tuple[float, float]:
    """Bulk and shear modulus, Pa; with a Mie-Grueneisen equation of state the bulk modulus is density * c0^2."""
    young, poisson = material.elastic.young, material.elastic.poisson
    shear = young / (2.0 * (1.0 + poisson))
    if material.eos is not None:
        return material.density * material.eos.c0**2, shear
    return young / (3.0 * (1.0 - 2.0 * poisson)), shear


def parameters(material: Material, viscosity: Viscosity | None) -> Floats:
    """(SIZE,) constants of a material, SI; ``viscosity`` None switches the bulk viscosity off."""
    params = np.zeros(SIZE)
    params[DENSITY] = material.density
    params[BULK], params[SHEAR] = moduli(material)
    if viscosity is not None:
        params[Q_LINEAR], params[Q_QUADRATIC] = viscosity.linear, viscosity.quadratic
    if material.eos is not None:
        params[C0 : GAMMA + 1] = material.eos.c0, material.eos.S, material.eos.gamma0
    strength = material.strength
    if isinstance(strength, LinearHardening):
        params[YIELD_0], params[HARDENING] = strength.yield_stress, strength.hardening
    elif isinstance(strength, JohnsonCook):
        heat = strength.taylor_quinney / strength.specific_heat
        params[JC_A : JC_HEAT + 1] = (
            strength.A, strength.B, strength.n, strength.C, strength.m, strength.reference_rate,
            strength.reference_temperature, strength.melt_temperature, heat,
        )  # fmt: skip
    elif isinstance(strength, MohrCoulomb):
        params[MC_SINE : MC_FAILURE + 1] = _mohr_coulomb(strength)
    return params


def _mohr_coulomb(strength: MohrCoulomb) -> tuple[float, ...]:
    """The six constants from MC_SINE on; what is not given never happens."""
    residual = strength.residual_friction_angle
    angle = min(math.radians(30.0), strength.friction_angle) if residual is None else residual
    return (
        *_sine_and_cohesion(strength.cohesion, strength.friction_angle),
        *_sine_and_cohesion(strength.residual_cohesion or 0.0, angle),
        math.inf if strength.strength_cap is None else strength.strength_cap,
        math.inf if strength.failure_strain is None else strength.failure_strain,
    )


def _sine_and_cohesion(cohesion: float, angle: float) -> tuple[float, float]:
    """sin(phi) and 2 c cos(phi), Pa."""
    return math.sin(angle), 2.0 * cohesion * math.cos(angle)


def rows_of(material: Material, pressure: str) -> int:
    """How many rows of state an element of this material needs (worker/state.py)."""
    strength, eos = strength_of(material), eos_of(material)
    if strength == JOHNSON_COOK:
        return state.TEMPERATURE + 1
    if strength == MOHR_COULOMB:
        return state.WORK_PLASTIC + 1
    if strength == LINEAR_HARDENING:
        return state.YIELD + 1
    if eos == MIE_GRUNEISEN:
        return state.VOLUME_RATIO + 1
    return state.DISTORTION + 1 if pressure == "standard" else state.VOLUME_FLUX + 1


def initial_yield(material: Material, temperature: float) -> float:
    """Flow stress at zero plastic strain and vanishing rate, Pa."""
    strength = material.strength
    if isinstance(strength, LinearHardening):
        return strength.yield_stress
    if isinstance(strength, JohnsonCook):
        span = strength.melt_temperature - strength.reference_temperature
        homologous = min(max((temperature - strength.reference_temperature) / span, 0.0), 1.0)
        return float(strength.A * (1.0 - homologous**strength.m))
    return 0.0
