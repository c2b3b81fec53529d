"""What bodies are made of: density, elasticity, strength, equation of state, fracture. Constants in SI once read."""

from typing import Annotated, Literal

from pydantic import Field

from ..laws.johnson_cook import JohnsonCook, JohnsonCookDamage
from ..laws.johnson_holmquist import JohnsonHolmquist
from ..laws.linear_hardening import LinearHardening
from ..laws.mohr_coulomb import MohrCoulomb
from ..units import Area, Density, FractureEnergy, Ratio, Speed, Stress
from .tables import Count, Model, Positive

__all__ = [
    "Brittle", "Elastic", "JohnsonCook", "JohnsonCookDamage", "JohnsonHolmquist", "LinearHardening", "Material",
    "MieGruneisen", "MohrCoulomb", "Scatter", "Strength",
]  # fmt: skip


class Elastic(Model):
    """Isotropic elasticity: Young's modulus, Pa, and Poisson's ratio."""

    young: Annotated[Stress, Positive]
    """Young's modulus."""
    poisson: Annotated[Ratio, Field(gt=-1, lt=0.5)]
    """Poisson's ratio."""

    @property
    def shear(self) -> float:
        """Shear modulus, Pa."""
        return self.young / (2.0 * (1.0 + self.poisson))

    @property
    def bulk(self) -> float:
        """Bulk modulus, Pa."""
        return self.young / (3.0 * (1.0 - 2.0 * self.poisson))


Strength = Annotated[LinearHardening | JohnsonCook | MohrCoulomb | JohnsonHolmquist, Field(discriminator="model")]


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
    """What breaks facets between tets: tensile strength, Pa, and fracture energy G_c, J/m^2, of the crack. Without
    ``strength`` the material breaks in tension alone and bears any compression."""

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
    spall: Annotated[Stress, Positive] | None = None
    """Tension cut-off: no pressure is below minus this. Beyond it pores open, which take up the work, and they close
    without resistance before anything is compressed again; without it tension of the pressure has no limit."""
    brittle: Brittle | None = None
    """What breaks facets; without it a part of this material cannot fracture."""
    description: str = ""
    """For people, with the sources of the constants."""

    @property
    def bulk(self) -> float:
        """Bulk modulus at rest, Pa: density c0^2 where there is an equation of state."""
        return self.elastic.bulk if self.eos is None else self.density * self.eos.c0**2
