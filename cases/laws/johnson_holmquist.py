"""Johnson-Holmquist 2, the law of brittle materials that crumble: its constants, and what is known of it beforehand."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..model.tables import Positive
from ..units import Rate, Ratio, Stress
from .law import Law, Wrong


class JohnsonHolmquist(Law):
    """Johnson-Holmquist 2: strength between intact, A (p* + T*)^N, and fractured, B p*^M, by the damage D; pressure
    with bulking; no tension beyond T (1 - D).

    Pressures with a star are over ``pressure_hel``, strengths over that at the elastic limit, 3/2 (hel - pressure_hel);
    both grow with 1 + C ln max(rate/reference_rate, 1), and the fractured one is never above the intact one. D grows by
    the plastic strain over D1 (p* + T*)^D2. The pressure is K m + K2 m^2 + K3 m^3, m = V0/V - 1, K from ``elastic``,
    and in tension K m; of the elastic energy that damage sets free the share ``beta`` becomes pressure. Johnson and
    Holmquist 1994.
    """

    model: Literal["johnson_holmquist"]
    """The law."""
    hel: Annotated[Stress, Positive]
    """Stress at the Hugoniot elastic limit, in the direction of the impact."""
    pressure_hel: Annotated[Stress, Positive]
    """Pressure there."""
    tension: Annotated[Stress, Positive]
    """T: largest tension, as a negative pressure, of what is whole."""
    A: Annotated[Ratio, Positive]
    """Strength of what is whole."""
    N: Annotated[Ratio, Positive]
    """Exponent of the pressure there."""
    B: Annotated[Ratio, Field(ge=0)]
    """Strength of what has crumbled."""
    M: Annotated[Ratio, Positive]
    """Exponent of the pressure there."""
    C: Annotated[Ratio, Field(ge=0)] = 0.0
    """Rate dependence."""
    reference_rate: Annotated[Rate, Positive] = 1.0
    """Rate of strain at which A and B hold."""
    largest_fractured: Annotated[Ratio, Positive] | None = None
    """Largest strength of what has crumbled, over that at the elastic limit; none by default."""
    D1: Annotated[Ratio, Positive]
    """Plastic strain to fracture where p* + T* is one."""
    D2: Annotated[Ratio, Field(ge=0)]
    """Exponent of the pressure there."""
    K2: Stress = 0.0
    """Second coefficient of the pressure."""
    K3: Stress = 0.0
    """Third coefficient of the pressure."""
    beta: Annotated[Ratio, Field(ge=0, le=1)] = 1.0
    """Share of the elastic energy of the deviator that bulking turns into pressure where damage sets it free."""

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
