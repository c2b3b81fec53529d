"""The models of materials: density, elasticity, strength, equation of state, fracture. All constants are in SI units
after the case has been read.
"""

from typing import Annotated, Literal

from pydantic import Field

from ..laws.cowper_symonds import CowperSymonds
from ..laws.johnson_cook import JohnsonCook, JohnsonCookDamage
from ..laws.johnson_holmquist import JohnsonHolmquist
from ..laws.linear_hardening import LinearHardening
from ..laws.mohr_coulomb import MohrCoulomb
from ..units import Area, Density, FractureEnergy, Ratio, Speed, Stress
from .tables import Count, Model, Positive

__all__ = [
    "Brittle", "CowperSymonds", "Elastic", "JohnsonCook", "JohnsonCookDamage", "JohnsonHolmquist", "LinearHardening",
    "Material", "MieGruneisen", "MohrCoulomb", "Scatter", "Strength",
]  # fmt: skip


class Elastic(Model):
    """Isotropic elasticity."""

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


Strength = Annotated[
    LinearHardening | JohnsonCook | MohrCoulomb | JohnsonHolmquist | CowperSymonds, Field(discriminator="model")
]


class MieGruneisen(Model):
    """Mie-Grüneisen equation of state, with the Hugoniot U_s = c0 + S u_p as reference curve."""

    model: Literal["mie_gruneisen"]
    """Selects this equation of state."""
    c0: Annotated[Speed, Positive]
    """Bulk sound speed: U_s at u_p = 0."""
    S: Annotated[Ratio, Field(ge=0)]
    """Slope of the Hugoniot, dU_s/du_p."""
    gamma0: Annotated[Ratio, Field(ge=0)]
    """Grüneisen coefficient."""


class Scatter(Model):
    """Weibull scatter of the tensile strength. A facet of area A has the strength ``minimum + (strength - minimum) *
    (-ln(1 - r) * area / A)^(1 / modulus)``. The number r in [0, 1) is a hash of ``seed`` and of the global id of the
    facet, so that every run has the same strengths.
    """

    modulus: Annotated[Ratio, Positive]
    """Weibull modulus: a larger value gives less scatter of the strength."""
    area: Annotated[Area, Positive] | None = None
    """Area of the specimens on which ``strength`` was measured. Default: the strength has no size effect, area / A =
    1."""
    minimum: Annotated[Stress, Field(ge=0)] = 0.0
    """Smallest strength of a facet."""
    seed: Annotated[Count, Field(ge=0)] = 0
    """Seed of the random strengths: another seed gives other weak facets."""


class Brittle(Model):
    """Fracture of facets between tets. Material without the table ``strength`` (a law of plastic flow) breaks in
    tension only, and resists any compression.
    """

    strength: Annotated[Stress, Positive]
    """Tensile strength: normal traction at which a facet breaks."""
    energy: Annotated[FractureEnergy, Positive]
    """Fracture energy G_c per area of crack."""
    scatter: Scatter | None = None
    """Scatter of the strength between facets. Default: all facets have the strength of the key ``strength``."""


class Material(Model):
    """A material: elasticity, and optionally strength (default: elastic only), equation of state (default: linear) and
    fracture (default: cannot fracture).
    """

    density: Annotated[Density, Positive]
    """Density of the material at the start."""
    elastic: Elastic
    """Young's modulus and Poisson's ratio."""
    strength: Strength | None = None
    """Law of the flow stress; the key ``model`` selects the law. Default: no law, the material stays elastic."""
    eos: MieGruneisen | None = None
    """Equation of state. Default: the pressure is linear in the volume strain, with the bulk modulus of ``elastic``.
    Use an equation of state for pressures above some percent of the bulk modulus. The key ``eos`` must not be combined
    with ``johnson_holmquist``, which has its own equation of state."""
    spall: Annotated[Stress, Positive] | None = None
    """Spall strength: largest tensile pressure. When the tension reaches the spall strength, pores open, which absorbs
    work; under compression the pores first close without resistance. Default: the tensile pressure has no limit. The
    key ``spall`` must not be combined with ``johnson_holmquist``, which has its own limit."""
    brittle: Brittle | None = None
    """Fracture of facets; required for parts with the table ``fracture``. Default: the material cannot fracture."""
    description: str = ""
    """Description of the material, with the sources of its constants."""

    @property
    def bulk(self) -> float:
        """Bulk modulus of the undeformed material, Pa; with an equation of state it is density c0^2."""
        return self.elastic.bulk if self.eos is None else self.density * self.eos.c0**2
