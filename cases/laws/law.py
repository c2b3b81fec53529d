"""The base class of the laws of strength: the checks, the estimates and the computing cost that every law provides in
addition to its constants.

Each law has two files of the same name: the file in cases/laws has its constants in SI units, its checks and its
estimates; the file in worker/materials has its kernel. The lists of laws are ``Strength`` in cases/model/materials.py
and ``LAWS`` in worker/materials/models.py.
"""

import math
from collections.abc import Iterator
from typing import ClassVar

from ..model.tables import Model

Likely = tuple[str, str, float]
"""A value to be compared with its usual range: key of the law, quantity of the key
(``cases.warnings.plausible.LIKELY``), and value."""
Wrong = tuple[str, float, str]
"""An error in a constant: key of the law, value of the key, and text of the error."""


class Law(Model):
    """A law of strength. Each subclass has an attribute ``model`` with the name of the law."""

    model: str
    """Name of the law."""
    nanoseconds: ClassVar[float]
    """CPU time of the law per tet and time step while the material flows, ns. The CPU time was measured with 10,000 to
    750,000 tets."""
    own_pressure: ClassVar[bool] = False
    """Whether the law has its own equation of state and its own largest tensile pressure."""

    @property
    def linear_pressure(self) -> bool:
        """Whether the law requires the linear pressure of ``elastic``."""
        return False

    @property
    def melting(self) -> float:
        """Lowest temperature at which the strength is 0, K; infinity by default."""
        return math.inf

    @property
    def counts_damage(self) -> bool:
        """Whether the law computes damage, which ``erosion.damage`` needs."""
        return False

    def flow_stress(self) -> float:
        """Flow stress, Pa, at a plastic strain of 0.1, at zero pressure and at the reference rate."""
        raise NotImplementedError

    def problems(self) -> Iterator[Wrong]:
        """Yields an error for each constant of the law that contradicts another constant; by default the law has no
        errors.
        """
        yield from ()

    def likely(self, young: float) -> Iterator[Likely]:
        """Yields the values of the law that are compared with the usual ranges of solids. ``young``: Young's modulus,
        Pa. By default a law yields no values.
        """
        yield from ()
