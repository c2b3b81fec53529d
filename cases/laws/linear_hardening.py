"""J2 plasticity with linear hardening: its constants, and what is known of it before anything runs."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..model.tables import Positive
from ..units import Stress
from .law import Law, Likely


class LinearHardening(Law):
    """J2 plasticity: yield stress ``yield + hardening * plastic strain``, Pa."""

    model: Literal["linear_hardening"]
    """The law."""
    yield_stress: Annotated[Stress, Positive]
    """Flow stress before any plastic strain."""
    hardening: Annotated[Stress, Field(ge=0)] = 0.0
    """Rise of the flow stress with the plastic strain."""

    nanoseconds: ClassVar[float] = 30.0

    def flow_stress(self) -> float:
        return self.yield_stress + 0.1 * self.hardening

    def likely(self, young: float) -> Iterator[Likely]:
        yield "yield_stress", "yield stress over Young's modulus", self.yield_stress / young
