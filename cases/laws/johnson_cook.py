"""Johnson-Cook plasticity: constants, checks and estimates."""

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..model.tables import Model, Positive
from ..units import Rate, Ratio, SpecificHeat, Stress, Temperature
from .law import Law, Likely, Wrong


class JohnsonCookDamage(Model):
    """Johnson-Cook damage: the sum of the plastic strain increments divided by the fracture strain ``(D1 + D2 e^(D3 t))
    (1 + D4 ln max(rate/reference_rate, 1)) (1 + D5 T*)``, where t is the mean stress divided by the flow stress.

    A tet is deleted when its damage reaches ``erosion.damage``. The flow stress is multiplied by ``1 - softening *
    damage``. Sources: Johnson and Cook 1985 for the damage; Borvik, Hopperstad, Berstad and Langseth 2001 for the
    softening.
    """

    D1: Ratio
    """Constant D1: fracture strain at high tension."""
    D2: Ratio
    """Constant D2: increase of the fracture strain from high tension to zero mean stress."""
    D3: Ratio
    """Exponent of the mean stress; negative if tension reduces the fracture strain."""
    D4: Ratio = 0.0
    """Coefficient of the strain rate in the fracture strain."""
    D5: Ratio = 0.0
    """Coefficient of the temperature in the fracture strain."""
    softening: Annotated[Ratio, Field(ge=0, lt=1)] = 0.0
    """Fraction of the flow stress that is lost at damage 1 (critical damage of Borvik and others). 0: damage does not
    change the flow stress."""

    @property
    def in_tension(self) -> float:
        """Fracture strain in a tensile test (t = 1/3) at the reference rate and the reference temperature."""
        return self.D1 + self.D2 * math.exp(min(self.D3 / 3.0, 300.0))


class JohnsonCook(Law):
    """Johnson-Cook plasticity: flow stress ``(A + B e^n) (1 + C ln max(rate/reference_rate, 1)) (1 - T*^m)``, with
    adiabatic heating.

    ``T* = (T - reference_temperature) / (melt_temperature - reference_temperature)``, limited to [0, 1]; e is the
    effective plastic strain. Source: Johnson and Cook 1983.
    """

    model: Literal["johnson_cook"]
    """Selects this law."""
    A: Annotated[Stress, Positive]
    """Initial yield stress."""
    B: Annotated[Stress, Field(ge=0)]
    """Hardening coefficient."""
    n: Annotated[Ratio, Field(gt=0, le=1)]
    """Hardening exponent."""
    C: Annotated[Ratio, Field(ge=0)]
    """Coefficient of the strain rate in the flow stress."""
    m: Annotated[Ratio, Positive]
    """Exponent of the thermal softening."""
    reference_rate: Annotated[Rate, Positive] = 1.0
    """Plastic strain rate at which the constants A, B and n were measured. Below the reference rate the strain rate has
    no effect."""
    reference_temperature: Annotated[Temperature, Field(ge=0)] = 293.15
    """Temperature at which A, B and n were measured; below this temperature the flow stress has no softening."""
    melt_temperature: Annotated[Temperature, Positive]
    """Temperature at which the flow stress is 0; above ``reference_temperature``."""
    specific_heat: Annotated[SpecificHeat, Positive]
    """Specific heat, for the temperature rise by plastic work."""
    taylor_quinney: Annotated[Ratio, Field(ge=0, le=1)] = 0.9
    """Taylor-Quinney coefficient: fraction of the plastic work that becomes heat."""
    damage: JohnsonCookDamage | None = None
    """Damage of the material. Default: no damage is computed."""

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
