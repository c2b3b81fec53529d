"""What bodies are made of: density, elasticity, strength, equation of state, fracture. Constants in SI once read."""

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from .tables import Count, Model, Positive
from .units import Angle, Area, Density, FractureEnergy, Rate, Ratio, SpecificHeat, Speed, Stress, Temperature


def _acute(angle: float) -> float:
    if not 0.0 <= angle < 0.5 * math.pi:
        raise ValueError("must be at least 0 and below 90 deg; without a unit it is in rad, write it like '55 deg'")
    return angle


class Elastic(Model):
    """Isotropic elasticity: Young's modulus, Pa, and Poisson's ratio."""

    young: Annotated[Stress, Positive]
    """Young's modulus."""
    poisson: Annotated[Ratio, Field(gt=-1, lt=0.5)]
    """Poisson's ratio."""


class LinearHardening(Model):
    """J2 plasticity: yield stress ``yield + hardening * plastic strain``, Pa."""

    model: Literal["linear_hardening"]
    """The law."""
    yield_stress: Annotated[Stress, Positive]
    """Flow stress before any plastic strain."""
    hardening: Annotated[Stress, Field(ge=0)] = 0.0
    """Rise of the flow stress with the plastic strain."""


class JohnsonCook(Model):
    """Flow stress (A + B e^n)(1 + C ln max(rate/reference_rate, 1))(1 - T*^m), adiabatic heating.

    T* = (T - reference_temperature) / (melt_temperature - reference_temperature), clamped to [0, 1].
    """

    model: Literal["johnson_cook"]
    """The law."""
    A: Annotated[Stress, Positive]
    """Flow stress before any plastic strain."""
    B: Annotated[Stress, Field(ge=0)]
    """Hardening."""
    n: Annotated[Ratio, Field(gt=0, le=1)]
    """Exponent of the hardening."""
    C: Annotated[Ratio, Field(ge=0)]
    """Rate dependence."""
    m: Annotated[Ratio, Positive]
    """Exponent of the thermal softening."""
    reference_rate: Annotated[Rate, Positive] = 1.0
    """Rate of plastic strain at which A, B and n were measured."""
    reference_temperature: Annotated[Temperature, Field(ge=0)] = 293.15
    """Temperature below which nothing softens."""
    melt_temperature: Annotated[Temperature, Positive]
    """Temperature at which nothing is left of the strength; above the reference."""
    specific_heat: Annotated[SpecificHeat, Positive]
    """Heat that warms the material."""
    taylor_quinney: Annotated[Ratio, Field(ge=0, le=1)] = 0.9
    """Share of the plastic work that becomes heat."""


class MohrCoulomb(Model):
    """Brittle strength (s1 - s3) + (s1 + s3) sin(friction_angle) <= 2 cohesion cos(friction_angle), s1 >= s2 >= s3.

    Tension is positive. Flow keeps the volume: there is no dilation. Tension beyond the apex takes the deviatoric
    stress and leaves the pressure as it is.
    """

    model: Literal["mohr_coulomb"]
    """The law."""
    cohesion: Annotated[Stress, Positive]
    """Shear strength without pressure."""
    friction_angle: Annotated[Angle, AfterValidator(_acute)]
    """How fast strength grows with pressure: ``"55 deg"``, at least 0 and below 90 deg."""
    strength_cap: Annotated[Stress, Positive] | None = None
    """Largest s1 - s3, however high the pressure; none by default."""
    failure_strain: Annotated[Ratio, Positive] | None = None
    """Effective plastic strain beyond which the residual values hold; without it material never fails."""
    residual_cohesion: Annotated[Stress, Field(ge=0)] | None = None
    """Cohesion after failure; 0 by default."""
    residual_friction_angle: Annotated[Angle, AfterValidator(_acute)] | None = None
    """Friction angle after failure; 30 deg by default, or the friction angle if that is smaller."""


Strength = Annotated[LinearHardening | JohnsonCook | MohrCoulomb, Field(discriminator="model")]


class MieGruneisen(Model):
    """Mie-Grueneisen equation of state on the Hugoniot U_s = c0 + S u_p."""

    model: Literal["mie_gruneisen"]
    """The equation."""
    c0: Annotated[Speed, Positive]
    """Bulk speed of sound."""
    S: Annotated[Ratio, Field(ge=0)]
    """Slope of the Hugoniot."""
    gamma0: Annotated[Ratio, Field(ge=0)]
    """Grüneisen's coefficient."""


class Scatter(Model):
    """Weibull's scatter of the strength over facets of area A: ``minimum + (strength - minimum) *
    (-ln(1 - r) * area / A)^(1 / modulus)``, r from a hash of ``seed`` and the facet's global id.
    """

    modulus: Annotated[Ratio, Positive]
    """Weibull's modulus: a larger one scatters less."""
    area: Annotated[Area, Positive] | None = None
    """Of the specimens that ``strength`` was measured with; without it every facet counts alike, whatever its area."""
    minimum: Annotated[Stress, Field(ge=0)] = 0.0
    """Strength that every facet has."""
    seed: Annotated[Count, Field(ge=0)] = 0
    """Another one gives other facets the weak places."""


class Brittle(Model):
    """What breaks facets between tets: tensile strength, Pa, and fracture energy G_c, J/m^2, of the crack."""

    strength: Annotated[Stress, Positive]
    """Tensile strength: the traction at which a facet breaks."""
    energy: Annotated[FractureEnergy, Positive]
    """Fracture energy G_c of the crack, per area of the crack."""
    scatter: Scatter | None = None
    """Scatter of the strength from facet to facet; none by default."""


class Material(Model):
    """Density, kg/m^3; elasticity; strength (none: elastic); equation of state (none: linear, from the elasticity);
    brittle (none: a part of it cannot fracture)."""

    density: Annotated[Density, Positive]
    """At the start."""
    elastic: Elastic
    """Young's modulus and Poisson's ratio."""
    strength: Strength | None = None
    """Where it stops being elastic; without it it never does. ``model`` says which law."""
    eos: MieGruneisen | None = None
    """Pressure of compression and heat; without it linear, from the elasticity."""
    brittle: Brittle | None = None
    """What breaks facets; without it a part of this material cannot fracture."""
    description: str = ""
    """For people, with the sources of the constants."""
