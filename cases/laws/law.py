"""The base class of the laws of strength: cost, estimates and checks that every law provides besides its constants.

A law has two files of the same name: one in cases/laws with its constants in SI, its checks and its estimates, and one
in worker/materials with its kernel. The lists of laws are ``Strength`` in cases/model/materials.py and ``LAWS`` in
worker/materials/models.py.
"""

import math
from collections.abc import Iterator
from typing import ClassVar

from ..model.tables import Model

Likely = tuple[str, str, float]
"""Value of a constant for a check: key of the law, quantity of the key (``cases.warnings.plausible.LIKELY``), and
value."""
Wrong = tuple[str, float, str]
"""Error in a constant: key of the law, its value, and the error."""


class Law(Model):
    """A law of strength. A subclass names the law in its attribute ``model``."""

    model: str
    """Name of the law."""
    nanoseconds: ClassVar[float]
    """Core time per tet and step of the law in flowing material, ns. Measured with 10,000 to 750,000 tets."""
    own_pressure: ClassVar[bool] = False
    """Whether the law has its own equation of state and its own largest tensile pressure."""

    @property
    def linear_pressure(self) -> bool:
        """Whether the law requires the linear pressure of ``elastic``."""
        return False

    @property
    def melting(self) -> float:
        """Temperature from which on the strength is 0, K; infinity by default."""
        return math.inf

    @property
    def counts_damage(self) -> bool:
        """Whether the law computes damage, which ``erosion.damage`` needs."""
        return False

    def flow_stress(self) -> float:
        """Flow stress at a plastic strain of 0.1, without pressure and rate, Pa."""
        raise NotImplementedError

    def problems(self) -> Iterator[Wrong]:
        """Yields errors for constants of the law that contradict each other; none by default."""
        yield from ()

    def likely(self, young: float) -> Iterator[Likely]:
        """Yields values for the comparison with the usual range of solids; ``young``: Young's modulus, Pa. By default a
        law yields no values.
        """
        yield from ()
