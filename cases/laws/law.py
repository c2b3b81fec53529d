"""What every law of strength states besides its constants: cost, strength, and what is odd or wrong about it.

A law is a file here, with its constants in SI and what is known of it before anything runs, and a file of the same name
in worker/materials, with its kernel; ``Strength`` in cases/model/materials.py and ``LAWS`` in
worker/materials/models.py list them.
"""

import math
from collections.abc import Iterator
from typing import ClassVar

from ..model.tables import Model

Likely = tuple[str, str, float]
"""A key of a law, what it is (``cases.plausible.LIKELY``), and its value there."""
Wrong = tuple[str, float, str]
"""A key of a law, its value, and what is wrong with it."""


class Law(Model):
    """A law of strength; a subclass has a ``model`` that names it."""

    model: str
    """Its name."""
    nanoseconds: ClassVar[float]
    """Core time per tet and step that the law takes where it flows. Measured at 10,000 to 750,000 tets."""
    own_pressure: ClassVar[bool] = False
    """Whether the law has an equation of state, and a tension cut-off, of its own."""

    @property
    def linear_pressure(self) -> bool:
        """Whether only the linear pressure of the elasticity goes with it."""
        return False

    @property
    def melting(self) -> float:
        """Temperature from which on nothing is left of the strength, K; none by default."""
        return math.inf

    @property
    def counts_damage(self) -> bool:
        """Whether the law counts damage, at which a tet can be told to leave."""
        return False

    def flow_stress(self) -> float:
        """Strength at a tenth of plastic strain, without pressure and rate, Pa."""
        raise NotImplementedError

    def problems(self) -> Iterator[Wrong]:
        """What constants say that cannot be; nothing by default."""
        yield from ()

    def likely(self, young: float) -> Iterator[Likely]:
        """Values to compare with those of any solid, ``young`` being Young's modulus, Pa; none by default."""
        yield from ()
