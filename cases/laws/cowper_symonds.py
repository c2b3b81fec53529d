"""J2 plasticity with linear hardening and the rate factor of Cowper and Symonds: constants, checks and estimates."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..model.tables import Positive
from ..units import Rate, Ratio, Stress
from .law import Law, Likely


class CowperSymonds(Law):
    """J2 plasticity with isotropic linear hardening and the rate factor of Cowper and Symonds: flow stress
    ``(yield_stress + hardening * plastic strain) * (1 + (rate/D)^(1/q))``.

    The rate is the plastic strain rate; no heat is computed. Published pairs of D and q: mild steel 40.4 1/s and 5
    (Cowper and Symonds 1957), aluminium alloys 6500 1/s and 4, stainless steel 304 100 1/s and 10 (Jones, Structural
    Impact). The constants D and q are the constants C and P of LS-DYNA.
    """

    model: Literal["cowper_symonds"]
    """Selects this law."""
    yield_stress: Annotated[Stress, Positive]
    """Initial yield stress at vanishing strain rate."""
    hardening: Annotated[Stress, Field(ge=0)] = 0.0
    """Plastic modulus at vanishing strain rate: increase of the flow stress per effective plastic strain."""
    D: Annotated[Rate, Positive]
    """Plastic strain rate at which the flow stress is twice that at vanishing strain rate."""
    q: Annotated[Ratio, Field(ge=1)]
    """Exponent of the rate factor: with a larger exponent the flow stress depends less on the strain rate."""

    nanoseconds: ClassVar[float] = 40.0

    def flow_stress(self) -> float:
        return self.yield_stress + 0.1 * self.hardening

    def likely(self, young: float) -> Iterator[Likely]:
        yield "yield_stress", "yield stress over Young's modulus", self.yield_stress / young
