"""J2 plasticity with linear hardening: constants, checks and estimates."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..model.tables import Positive
from ..units import Stress
from .law import Law, Likely


class LinearHardening(Law):
    """J2 (von Mises) plasticity with isotropic linear hardening: flow stress ``yield_stress + hardening * plastic
    strain``."""

    model: Literal["linear_hardening"]
    """Selects this law."""
    yield_stress: Annotated[Stress, Positive]
    """Initial yield stress."""
    hardening: Annotated[Stress, Field(ge=0)] = 0.0
    """Plastic modulus: increase of the flow stress per effective plastic strain."""

    nanoseconds: ClassVar[float] = 30.0

    def flow_stress(self) -> float:
        return self.yield_stress + 0.1 * self.hardening

    def likely(self, young: float) -> Iterator[Likely]:
        yield "yield_stress", "yield stress over Young's modulus", self.yield_stress / young
