"""Mohr-Coulomb strength: constants, checks and estimates."""

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
    """Mohr-Coulomb strength of brittle materials: ``(s1 - s3) + (s1 + s3) sin(friction_angle) <= 2 cohesion
    cos(friction_angle)``, with principal stresses s1 >= s2 >= s3, tension positive.

    Plastic flow preserves the volume, except with ``dilation_angle``. Tension beyond the apex of the yield surface sets
    the deviatoric stress to 0 and leaves the pressure unchanged. Next to a face at which a shock starts, the first 20
    tets flow too much: with averaged nodal pressure up to half of their plastic strain is an error. The error is
    smaller with ``pressure = "standard"``, and with a load that increases over some time steps.
    """

    model: Literal["mohr_coulomb"]
    """Selects this law."""
    cohesion: Annotated[Stress, Positive]
    """Cohesion: shear strength at zero pressure."""
    friction_angle: Annotated[Angle, AfterValidator(_acute)]
    """Angle of internal friction, such as ``"55 deg"``; at least 0 and below 90 deg."""
    dilation_angle: Annotated[Angle, AfterValidator(_acute)] = 0.0
    """Dilation angle psi: plastic flow increases the volume by sin(psi) times the shear strain, until failure. 0: the
    volume does not change. The largest value, ``friction_angle``, makes the flow associated. The key ``dilation_angle``
    must not be combined with ``eos``."""
    strength_cap: Annotated[Stress, Positive] | None = None
    """Largest difference s1 - s3 of the principal stresses, at any pressure. Default: s1 - s3 has no limit."""
    failure_strain: Annotated[Ratio, Positive] | None = None
    """Effective plastic strain at failure; at larger strains the residual values apply. Default: the material has no
    failure."""
    residual_cohesion: Annotated[Stress, Field(ge=0)] | None = None
    """Cohesion after failure; at most ``cohesion``. Default: 0. The key ``residual_cohesion`` needs
    ``failure_strain``."""
    residual_friction_angle: Annotated[Angle, AfterValidator(_acute)] | None = None
    """Angle of internal friction after failure; at most ``friction_angle``. Default: the smaller of 30 deg and
    ``friction_angle``. The key ``residual_friction_angle`` needs ``failure_strain``."""

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
                yield here, value, "needs failure_strain; it applies at larger strains"
            elif value is not None and value > intact:
                unit = "Pa" if key == "cohesion" else "rad"
                yield here, value, f"must not be above {intact:g} {unit}, the {key} before failure"
