"""Bonds: two parts that hold together where they lie face to face, for ever or up to a strength and an energy."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import FractureEnergy, Length, Stress
from .tables import Model, Name, Positive

GAP = 0.1
"""Of the size of the smaller of two faces, square root of twice its area: the largest distance that is bonded where the
case names none. Chosen: chords of a circle of 16 sides are 0.05 of a side from it."""


class Bonded(Model):
    """What all bonds have in common: the two parts, and what it takes to part them."""

    parts: tuple[Name, Name]
    """The names of the two parts. A pair has one bond at most; a part may have bonds with several others."""
    strength: Annotated[Stress, Positive] | None = None
    """Traction across the interface, in tension, at which the bond breaks. Without it the bond never breaks."""
    shear_strength: Annotated[Stress, Positive] | None = None
    """Traction along the interface at which it breaks; by default ``strength``. Both together break it where
    ``(t_n / strength)^2 + (t_s / shear_strength)^2`` reaches 1; pressure across the interface does not count."""
    energy: Annotated[FractureEnergy, Field(ge=0)] = 0.0
    """Per area of the interface, that it takes to pull the parts from each other: the traction falls linearly with the
    opening from then on. At 0 the bond lets go at once."""
    shear_energy: Annotated[FractureEnergy, Field(ge=0)] | None = None
    """The same for parts that slide along each other; by default ``energy``. Both are 0, or both are above 0."""

    @property
    def breaks(self) -> bool:
        """Whether it may break."""
        return self.strength is not None

    @property
    def cohesive(self) -> bool:
        """Whether it takes energy when it breaks."""
        return self.breaks and self.energy > 0.0

    @property
    def strengths(self) -> tuple[float, float]:
        """Normal and in shear, Pa, of a bond that breaks."""
        assert self.strength is not None
        return self.strength, self.strength if self.shear_strength is None else self.shear_strength

    @property
    def energies(self) -> tuple[float, float]:
        """Normal and in shear, J/m^2."""
        return self.energy, self.energy if self.shear_energy is None else self.shear_energy


class SharedBond(Bonded):
    """Two parts whose meshes have the nodes of the interface in common: one body of two materials, without contact at
    the interface. The parts are groups of one mesh file that share nodes, or shapes, combinations and solids of CAD
    files that touch and are meshed together.
    """

    kind: Literal["shared"]
    """The meshes of the two have nodes in common."""


class TiedBond(Bonded):
    """Two parts whose meshes do not match at the interface: the nodes of the one with the smaller faces there are tied
    to faces of the other, and lie on them from the start. Where it breaks, tension and shear take their shares of
    ``1 / G = (1 - B) / energy + B / shear_energy``, B the share of the work that is done in shear. What has opened
    closes without resistance and carries tension again where it was widest; what has slid stays where it is. Contact
    sees no pair of the two that the bond ties, and what has come apart.
    """

    kind: Literal["tied"]
    """The meshes of the two have no nodes in common."""
    gap: Annotated[Length, Field(ge=0)] | None = None
    """Largest distance between faces that are bonded; by default a tenth of the smaller face, the square root of twice
    its area. The nodes of the one part are moved by it onto the other. What is further apart is not bonded, and a
    warning counts it."""


Bond = Annotated[SharedBond | TiedBond, Field(discriminator="kind")]
