"""Johnson-Cook plasticity: its constants, and what is known of it before anything runs."""

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..model.tables import Model, Positive
from ..units import Rate, Ratio, SpecificHeat, Stress, Temperature
from .law import Law, Likely, Wrong


class JohnsonCookDamage(Model):
    """Damage: the sum of plastic strain over (D1 + D2 e^(D3 t)) (1 + D4 ln max(rate/reference_rate, 1)) (1 + D5 T*).

    t is the mean stress over the flow stress. At ``erosion.damage`` a tet leaves. Johnson and Cook 1985. The flow
    stress is multiplied by 1 - softening * damage: Borvik, Hopperstad, Berstad and Langseth 2001.
    """

    D1: Ratio
    """Fracture strain at high tension."""
    D2: Ratio
    """How much more it is without tension."""
    D3: Ratio
    """How fast that goes with the tension; negative where tension shortens the strain."""
    D4: Ratio = 0.0
    """Rate dependence."""
    D5: Ratio = 0.0
    """Dependence on the temperature."""
    softening: Annotated[Ratio, Field(ge=0, lt=1)] = 0.0
    """Share of the flow stress that damage 1 takes: the critical damage of Borvik and others. 0: damage takes none."""

    @property
    def in_tension(self) -> float:
        """Fracture strain of a tensile test, t = 1/3, at the reference rate and temperature."""
        return self.D1 + self.D2 * math.exp(min(self.D3 / 3.0, 300.0))


class JohnsonCook(Law):
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
    damage: JohnsonCookDamage | None = None
    """What counts as damage; none by default."""

    nanoseconds: ClassVar[float] = 40.0

    @property
    def melting(self) -> float:
        return self.melt_temperature

    @property
    def counts_damage(self) -> bool:
        return self.damage is not None

    def flow_stress(self) -> float:
        return self.A + self.B * math.pow(0.1, self.n)

    def problems(self) -> Iterator[Wrong]:
        if self.melt_temperature <= self.reference_temperature:
            message = f"must be above {self.reference_temperature} K, the reference"
            yield "melt_temperature", self.melt_temperature, message
        if self.damage is not None and not self.damage.in_tension > 0.0:
            message = (
                f"a tensile test would break at a plastic strain of {self.damage.in_tension:.3g}, D1 + D2 e^(D3/3)"
            )
            yield "damage.D1", self.damage.D1, message

    def likely(self, young: float) -> Iterator[Likely]:
        yield "A", "yield stress over Young's modulus", self.A / young
        yield "specific_heat", "specific heat", self.specific_heat
        yield "melt_temperature", "temperature", self.melt_temperature
