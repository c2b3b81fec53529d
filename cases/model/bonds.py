"""The models of bonds: two parts that are joined at an interface, permanently or up to a strength and a fracture
energy.
"""

from typing import Annotated, Literal

from pydantic import Field

from ..units import FractureEnergy, Length, Stress
from .tables import Model, Name, Positive

GAP = 0.1
"""Largest distance of bonded faces, divided by the size of the smaller face (square root of twice its area), for a bond
whose case gives no ``gap``. The chosen value is twice the largest distance between a circle and the sides of a polygon
of 16 sides in it, which is 0.05 of a side."""


class Bonded(Model):
    """Keys of all bonds: the two parts, and the strength and fracture energy of the interface."""

    parts: tuple[Name, Name]
    """Names of the two parts of the bond. A pair of parts has at most one bond; a part may have bonds with several
    other parts."""
    strength: Annotated[Stress, Positive] | None = None
    """Tensile strength: the interface breaks at this normal traction. Default: the bond never breaks."""
    shear_strength: Annotated[Stress, Positive] | None = None
    """Shear strength of the interface. Default: ``strength``. Under combined tension and shear the interface breaks
    where ``(t_n / strength)^2 + (t_s / shear_strength)^2`` reaches 1, with the normal traction t_n and the shear
    traction t_s. Compression has no effect."""
    energy: Annotated[FractureEnergy, Field(ge=0)] = 0.0
    """Fracture energy in tension, per area of the interface: after the break the traction falls linearly with the
    opening. 0: the traction is 0 as soon as the interface breaks."""
    shear_energy: Annotated[FractureEnergy, Field(ge=0)] | None = None
    """Fracture energy in shear, per area of the interface. Default: ``energy``. Either both fracture energies
    (``energy`` and ``shear_energy``) are 0, or both are above 0."""

    @property
    def breaks(self) -> bool:
        """Whether the bond can break."""
        return self.strength is not None

    @property
    def cohesive(self) -> bool:
        """Whether the bond absorbs fracture energy when it breaks."""
        return self.breaks and self.energy > 0.0

    @property
    def strengths(self) -> tuple[float, float]:
        """Returns the tensile strength and the shear strength, Pa, of a bond that can break."""
        assert self.strength is not None
        return self.strength, self.strength if self.shear_strength is None else self.shear_strength

    @property
    def energies(self) -> tuple[float, float]:
        """Returns the fracture energy in tension and the fracture energy in shear, J/m^2."""
        return self.energy, self.energy if self.shear_energy is None else self.shear_energy


class SharedBond(Bonded):
    """A bond of two parts whose meshes have the nodes of the interface in common: one body of two materials, without
    contact at the interface. The parts are groups of one mesh file that share nodes; or shapes, combinations and CAD
    solids that touch and are meshed together. A bond with common nodes is cheaper and more accurate than a tied bond.
    """

    kind: Literal["shared"]
    """Selects a bond with common nodes."""


class TiedBond(Bonded):
    """A bond of two parts whose meshes do not match at the interface. The nodes of the part with the smaller faces are
    tied to faces of the other part, and are moved onto these faces at the start. One of the parts may be rigid: the
    nodes of the deformable part are then tied to the faces of the rigid part, and follow its motion. Two parts whose
    meshes match at the interface may be tied as well, such as two groups of one file with common nodes, one of them
    rigid.

    After the interface has broken, the fracture energy G of mixed tension and shear is given by ``1 / G = (1 - B) /
    energy + B / shear_energy``, where B is the fraction of the work that is done in shear. After the break, an open
    interface closes without resistance; it carries tension again beyond its largest opening; slip is permanent. Contact
    ignores the pairs of nodes and faces that the bond ties.
    """

    kind: Literal["tied"]
    """Selects a bond with tied nodes."""
    gap: Annotated[Length, Field(ge=0)] | None = None
    """Largest distance between bonded faces. The nodes of one part are moved by up to this distance onto the faces of
    the other part. Default: a tenth of the size of the smaller face; the size of a face is the square root of twice its
    area. Faces at a larger distance are not bonded, and a warning gives their number."""


Bond = Annotated[SharedBond | TiedBond, Field(discriminator="kind")]
