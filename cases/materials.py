"""What bodies are made of: density, elasticity, strength, equation of state, fracture. Constants in SI once read."""

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from .tables import Count, Model, Positive
from .units import Area, Density, FractureEnergy, Rate, Ratio, SpecificHeat, Speed, Stress, Temperature


def _acute(angle: float) -> float:
    if not 0.0 <= angle < 0.5 * math.pi:
        raise ValueError("must be at least 0 and below 90 deg; without a unit it is in rad, write it like '55 deg'")
    return angle


class Elastic(Model):
    """Isotropic elasticity: Young's modulus, Pa, and Poisson's ratio."""

    young: Annotated[Stress, Positive]
    poisson: Annotated[Ratio, Field(gt=-1, lt=0.5)]


class LinearHardening(Model):
    """J2 plasticity: yield stress ``yield + hardening * plastic strain``, Pa."""

    model: Literal["linear_hardening"]
    yield_stress: Annotated[Stress, Positive]
    hardening: Annotated[Stress, Field(ge=0)] = 0.0


class JohnsonCook(Model):
    """Flow stress (A + B e^n)(1 + C ln max(rate/reference_rate, 1))(1 - T*^m), adiabatic heating.

    T* = (T - reference_temperature) / (melt_temperature - reference_temperature), clamped to [0, 1].
    """

    model: Literal["johnson_cook"]
    A: Annotated[Stress, Positive]
    B: Annotated[Stress, Field(ge=0)]
    n: Annotated[Ratio, Field(gt=0, le=1)]
    C: Annotated[Ratio, Field(ge=0)]
    m: Annotated[Ratio, Positive]
    reference_rate: Annotated[Rate, Positive] = 1.0
    reference_temperature: Annotated[Temperature, Field(ge=0)] = 293.15
    melt_temperature: Annotated[Temperature, Positive]
    specific_heat: Annotated[SpecificHeat, Positive]
    taylor_quinney: Annotated[Ratio, Field(ge=0, le=1)] = 0.9
    """Share of the plastic work that becomes heat."""


class MohrCoulomb(Model):
    """Brittle strength (s1 - s3) + (s1 + s3) sin(friction_angle) <= 2 cohesion cos(friction_angle), s1 >= s2 >= s3.

    Tension is positive. Flow keeps the volume: there is no dilation. Tension beyond the apex takes the deviatoric
    stress and leaves the pressure as it is.
    """

    model: Literal["mohr_coulomb"]
    cohesion: Annotated[Stress, Positive]
    friction_angle: Annotated[Ratio, AfterValidator(_acute)]
    """``"55 deg"``."""
    strength_cap: Annotated[Stress, Positive] | None = None
    """Largest s1 - s3, however high the pressure; none by default."""
    failure_strain: Annotated[Ratio, Positive] | None = None
    """Effective plastic strain beyond which the residual values hold; without it material never fails."""
    residual_cohesion: Annotated[Stress, Field(ge=0)] | None = None
    """0 by default."""
    residual_friction_angle: Annotated[Ratio, AfterValidator(_acute)] | None = None
    """30 deg by default, or the friction angle if that is smaller."""


Strength = Annotated[LinearHardening | JohnsonCook | MohrCoulomb, Field(discriminator="model")]


class MieGruneisen(Model):
    """Mie-Grueneisen equation of state on the Hugoniot U_s = c0 + S u_p."""

    model: Literal["mie_gruneisen"]
    c0: Annotated[Speed, Positive]
    S: Annotated[Ratio, Field(ge=0)]
    gamma0: Annotated[Ratio, Field(ge=0)]


class Scatter(Model):
    """Weibull's scatter of the strength over facets of area A: ``minimum + (strength - minimum) *
    (-ln(1 - r) * area / A)^(1 / modulus)``, r from a hash of ``seed`` and the facet's global id.
    """

    modulus: Annotated[Ratio, Positive]
    area: Annotated[Area, Positive] | None = None
    """Of the specimens that ``strength`` was measured with; without it every facet counts alike, whatever its area."""
    minimum: Annotated[Stress, Field(ge=0)] = 0.0
    seed: Annotated[Count, Field(ge=0)] = 0


class Brittle(Model):
    """What breaks facets between tets: tensile strength, Pa, and fracture energy G_c, J/m^2, of the crack."""

    strength: Annotated[Stress, Positive]
    energy: Annotated[FractureEnergy, Positive]
    scatter: Scatter | None = None


class Material(Model):
    """Density, kg/m^3; elasticity; strength (none: elastic); equation of state (none: linear, from the elasticity);
    brittle (none: a part of it cannot fracture)."""

    density: Annotated[Density, Positive]
    elastic: Elastic
    strength: Strength | None = None
    eos: MieGruneisen | None = None
    brittle: Brittle | None = None
    description: str = ""
