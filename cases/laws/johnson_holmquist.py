"""Johnson-Holmquist 2, a law of brittle materials: constants, checks and estimates."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..model.tables import Positive
from ..units import Rate, Ratio, Stress
from .law import Law, Wrong


class JohnsonHolmquist(Law):
    """Johnson-Holmquist 2 (JH-2), a law for ceramics and glass under high pressure. The strength depends on the
    pressure. The strength decreases with the damage D from that of intact material, ``A (p* + T*)^N``, to that of
    fractured material, ``B p*^M``; damaged material increases its pressure (bulking).

    ``p*`` is the pressure divided by ``pressure_hel``, and ``T*`` is ``tension`` divided by ``pressure_hel``. Both
    strengths are divided by the strength at the Hugoniot elastic limit, ``3/2 (hel - pressure_hel)``, and are
    multiplied by ``1 + C ln max(rate/reference_rate, 1)``. The fractured strength is never above the intact strength.
    The damage D is the sum of the plastic strain increments divided by ``D1 (p* + T*)^D2``. The largest tensile
    pressure is ``tension * (1 - D)``.

    The pressure is ``K m + K2 m^2 + K3 m^3`` with ``m = V0/V - 1`` and K from ``elastic``; in tension the pressure is K
    m. The fraction ``beta`` of the elastic energy that damage releases becomes pressure. Source: Johnson and Holmquist
    1994.
    """

    model: Literal["johnson_holmquist"]
    """Selects this law."""
    hel: Annotated[Stress, Positive]
    """Axial stress at the Hugoniot elastic limit."""
    pressure_hel: Annotated[Stress, Positive]
    """Pressure at the Hugoniot elastic limit; below ``hel``."""
    tension: Annotated[Stress, Positive]
    """Constant T: largest tensile pressure of intact material."""
    A: Annotated[Ratio, Positive]
    """Coefficient of the intact strength."""
    N: Annotated[Ratio, Positive]
    """Exponent of the pressure in the intact strength."""
    B: Annotated[Ratio, Field(ge=0)]
    """Coefficient of the fractured strength."""
    M: Annotated[Ratio, Positive]
    """Exponent of the pressure in the fractured strength."""
    C: Annotated[Ratio, Field(ge=0)] = 0.0
    """Coefficient of the strain rate in the strengths."""
    reference_rate: Annotated[Rate, Positive] = 1.0
    """Strain rate at which the constants A and B were measured. Below the reference rate the strain rate has no
    effect."""
    largest_fractured: Annotated[Ratio, Positive] | None = None
    """Largest fractured strength, divided by the strength at the Hugoniot elastic limit. Default: the fractured
    strength has no limit."""
    D1: Annotated[Ratio, Positive]
    """Plastic strain to fracture at ``p* + T* = 1``."""
    D2: Annotated[Ratio, Field(ge=0)]
    """Exponent of the pressure in the plastic strain to fracture."""
    K2: Stress = 0.0
    """Coefficient K2 of the square of m in the pressure."""
    K3: Stress = 0.0
    """Coefficient K3 of the cube of m in the pressure."""
    beta: Annotated[Ratio, Field(ge=0, le=1)] = 1.0
    """Bulking: fraction of the deviatoric elastic energy released by damage that becomes pressure."""

    nanoseconds: ClassVar[float] = 60.0
    own_pressure: ClassVar[bool] = True

    @property
    def strength_hel(self) -> float:
        """Von Mises stress at the Hugoniot elastic limit, Pa."""
        return 1.5 * (self.hel - self.pressure_hel)

    @property
    def counts_damage(self) -> bool:
        return True

    def flow_stress(self) -> float:
        return float(self.strength_hel * self.A * (self.tension / self.pressure_hel) ** self.N)

    def problems(self) -> Iterator[Wrong]:
        if self.pressure_hel >= self.hel:
            yield "pressure_hel", self.pressure_hel, f"must be below hel, {self.hel:g} Pa"
