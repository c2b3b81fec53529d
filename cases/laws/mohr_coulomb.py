"""Mohr-Coulomb strength: its constants, and what is known of it before anything runs."""

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from ..model.tables import Positive
from ..units import Angle, Ratio, Stress
from .law import Law, Wrong


def _acute(angle: float) -> float:
    if not 0.0 <= angle < 0.5 * math.pi:
        raise ValueError("must be at least 0 and below 90 deg; without a unit it is in rad, write it like '55 deg'")
    return angle


class MohrCoulomb(Law):
    """Brittle strength (s1 - s3) + (s1 + s3) sin(friction_angle) <= 2 cohesion cos(friction_angle), s1 >= s2 >= s3.

    Tension is positive. Flow keeps the volume, but for a dilation that is asked for. Tension beyond the apex takes the
    deviatoric stress and leaves the pressure as it is. Next to a face at which a shock begins the first 20 tets flow
    too far, by half of their plastic strain where the pressure is averaged: ``pressure = "standard"`` and a load that
    rises have less of that.
    """

    model: Literal["mohr_coulomb"]
    """The law."""
    cohesion: Annotated[Stress, Positive]
    """Shear strength without pressure."""
    friction_angle: Annotated[Angle, AfterValidator(_acute)]
    """How fast strength grows with pressure: ``"55 deg"``, at least 0 and below 90 deg."""
    dilation_angle: Annotated[Angle, AfterValidator(_acute)] = 0.0
    """psi: flow lets the volume grow by sin(psi) of its shear, until it fails; at most the friction angle. 0 keeps the
    volume, the friction angle makes the flow associated. Needs the linear pressure: no table ``eos``."""
    strength_cap: Annotated[Stress, Positive] | None = None
    """Largest s1 - s3, however high the pressure; none by default."""
    failure_strain: Annotated[Ratio, Positive] | None = None
    """Effective plastic strain beyond which the residual values hold; without it material never fails."""
    residual_cohesion: Annotated[Stress, Field(ge=0)] | None = None
    """Cohesion after failure; 0 by default."""
    residual_friction_angle: Annotated[Angle, AfterValidator(_acute)] | None = None
    """Friction angle after failure; 30 deg by default, or the friction angle if that is smaller."""

    nanoseconds: ClassVar[float] = 60.0

    @property
    def linear_pressure(self) -> bool:
        return self.dilation_angle > 0.0

    def flow_stress(self) -> float:
        free = 2.0 * self.cohesion * math.cos(self.friction_angle) / (1.0 - math.sin(self.friction_angle))
        return min(free, self.strength_cap or math.inf)

    def problems(self) -> Iterator[Wrong]:
        if self.dilation_angle > self.friction_angle:
            message = f"must not be above {self.friction_angle:g} rad, the friction angle: flow would give work"
            yield "dilation_angle", self.dilation_angle, message
        for key in ("cohesion", "friction_angle"):
            value, intact = getattr(self, f"residual_{key}"), getattr(self, key)
            here = f"residual_{key}"
            if value is not None and self.failure_strain is None:
                yield here, value, "needs failure_strain, beyond which it holds"
            elif value is not None and value > intact:
                unit = "Pa" if key == "cohesion" else "rad"
                yield here, value, f"must not be above {intact:g} {unit}, the {key} of what has not failed"
