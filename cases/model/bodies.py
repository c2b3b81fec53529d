"""The bodies of a case and their meshes: primitives that are generated, and mesh files."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Angle, Length, Ratio
from .forms import (
    BoxForm,
    ConeForm,
    CylinderForm,
    HemisphereForm,
    OgiveForm,
    PlateForm,
    RingSectorForm,
    SphereForm,
    SphericalCapForm,
    TubeForm,
)
from .grading import Grading
from .solids import Cad, Difference, Intersection, Measured, Stl, Union
from .tables import Axis, Count, Model, Point, Positive, Sha256

Edge = Annotated[Count, Field(ge=1, le=1000)]


class Primitive(Model):
    """What all generated meshes share. ``structured`` is the regular generator kept for verification."""

    element_size: Annotated[Length, Positive]
    """Edge of a tet, about; not above the smallest extent of the body, and a quarter of the thickness where it bends:
    with 4 tets through it the averaged forms are 13 % too stiff, with 2 50 %, ``standard`` is 26 and 100 %."""
    generator: Literal["gmsh", "structured"] = "gmsh"
    """``gmsh`` makes unstructured meshes; ``structured`` cuts the cells of a regular grid into tets, but
    for spheres."""
    split: Literal[5, 6] = 6
    """Tets per hexahedron of the structured generator."""
    sector: Literal["full", "half", "quarter"] = "full"
    """Which part of the body is modelled: the positive side of its centre (of a box: of the origin) in the first, or
    both, of the two directions across ``axis`` (in cyclic order: x, y for z; y, z for x; z, x for y)."""
    grading: Grading | None = None
    """Coarser tets away from a place, with ``generator = "gmsh"``."""


class Slit(Model):
    """A crack that is there from the start: a rectangle across ``axis`` at ``at``, on planes of nodes of the structured
    generator. It ends at those of its borders that lie inside the body.

    ``low`` and ``high`` are its corners in the two directions across ``axis`` (x, y for z; y, z for x; z, x for y).
    """

    axis: Axis
    """The normal of the rectangle."""
    at: Length
    """Where its plane cuts the axis: on a plane of nodes inside the body."""
    low: tuple[Length, Length]
    """Lowest corner."""
    high: tuple[Length, Length]
    """Highest corner."""


class Box(BoxForm, Primitive):
    """A rectangular block between two corners. The sector is cut at the origin of the coordinates."""

    axis: Axis = "z"
    """The direction across which a sector is cut."""
    slit: Slit | None = None
    """A crack that is there from the start, with ``generator = "structured"``."""


class Symmetric(Primitive):
    """What bodies have in common that are symmetric about the planes at which sectors are cut."""

    aligned: bool | None = None
    """Whether a half or a whole is meshed as quarters that have faces in common, with ``generator = "gmsh"``: the tets
    at the axis are those of a quarter then, else up to twice as large. By default where the part erodes: the hole of a
    rod is as deep in a whole as in a quarter (docs/theory/erosion.md)."""


class Plate(PlateForm, Symmetric):
    """A rectangular plate: ``thickness`` along ``axis``, ``width`` x ``height`` across it, centred on ``base``'s axis.

    ``base`` is the centre of the face from which the thickness is measured in the positive direction.
    """

    slit: Slit | None = None
    """A crack that is there from the start, with ``generator = "structured"``."""


class Cylinder(CylinderForm, Symmetric):
    """A solid cylinder; ``base`` is the centre of its lower end face."""


class Tube(TubeForm, Symmetric):
    """A hollow cylinder."""


class Sphere(SphereForm, Symmetric):
    """A ball."""


class Drawn(Primitive):
    """A primitive that only gmsh meshes."""

    generator: Literal["gmsh"] = "gmsh"
    """gmsh alone makes these."""


class Cone(ConeForm, Drawn):
    """A cone or a frustum of one: ``radius`` at ``base``, ``top_radius`` at the high end of ``axis``."""


class Ogive(OgiveForm, Drawn):
    """A shank with an ogive on it, as bullets and projectiles have: the outline of the nose is an arc of a circle.

    The nose is a tangent ogive, whose arc goes on smoothly from the shank, of the length D sqrt(crh - 1/4) for the
    diameter D, where one of ``crh`` and ``nose`` is given; a secant ogive, which has an edge there, where both are.
    """


class Hemisphere(HemisphereForm, Drawn):
    """Half of a ball."""


class SphericalCap(SphericalCapForm, Drawn):
    """What a plane cuts off a ball."""


class RingSector(RingSectorForm, Drawn):
    """A piece of a tube between two half-planes through its axis; of a solid cylinder with ``inner_radius = 0``."""


class Loose(Primitive):
    """Tets of edge ``element_size``, put one by one: there are no sectors, and one generator."""

    generator: Literal["structured"] = "structured"
    """Of no meaning here."""
    sector: Literal["full"] = "full"
    """There are none here."""
    grading: None = None
    """There is none here."""


class TwoTets(Loose):
    """Two tets with a common face, whose centre is ``centre`` and whose normal is ``axis``; one corner of the face lies
    in the first direction across ``axis``. The line through their free corners and the centre leans that way, too."""

    shape: Literal["two_tets"]
    """The kind of body."""
    centre: Point = (0.0, 0.0, 0.0)
    """Of the common face."""
    axis: Axis = "z"
    """Normal of the common face."""
    lean: Annotated[Angle, Field(ge=0, le=1.1)] = 0.0
    """``"30 deg"``: the tets keep their altitude, and are regular when they do not lean."""


class Shards(Loose):
    """Tets that are not connected with each other: ``count`` of them along x, y, z from the corner ``base``, each in a
    cube of its own and turned at random."""

    shape: Literal["shards"]
    """The kind of body."""
    base: Point = (0.0, 0.0, 0.0)
    """Corner with the lowest coordinates."""
    count: tuple[Edge, Edge, Edge]
    """Tets along x, y, z."""
    gap: Annotated[Length, Field(ge=0)] = 0.0
    """Smallest distance of neighbours, however they are turned."""
    perturbation: Annotated[Ratio, Field(ge=0, le=0.15)] = 0.0
    """How far each coordinate of a node is moved at most, at random, of the edge."""
    seed: Annotated[Count, Field(ge=0, lt=2**63)] = 0
    """Another one turns and moves the tets otherwise."""

    @property
    def axis(self) -> Axis:
        """Of no meaning here; every body has one."""
        return "z"


class MeshFile(Measured):
    """A mesh made elsewhere: gmsh .msh 4.1 or 2.2, Abaqus .inp, LS-DYNA .k, .key or .dyn, Radioss .rad, VTK
    .vtu. ``unit`` is the length unit of its coordinates.
    """

    shape: Literal["file"]
    """The kind of body."""
    path: str
    """Of the file; a relative one begins in the folder of the case. Commands that hand the case to a server send the
    file with it: there the path is a name, and ``sha256`` says which file is meant (docs/howto/meshes.md)."""
    unit: Annotated[Length, Positive]
    """Length of 1 in the file: ``"1 mm"``."""
    group: str | None = None
    """Of elements: a physical group of gmsh by its name or number; of Abaqus an element set, ``Bar-1.Set-1`` (a set of
    an instance or a part), an instance or a part; of LS-DYNA and Radioss a part, a set or a subset. All when absent.
    docs/howto/meshes.md has what is read of a file."""
    second_order: Literal["auto", "corners", "eight"] = "auto"
    """Tets of 10 nodes as the tets of their 4 corners, or as eight tets of 4 nodes each. ``auto`` is ``eight`` where
    the corners alone would lose more than a thousandth of the volume, else ``corners``; a warning says which."""
    sha256: Sha256 | None = None
    """Of the file, 64 hexadecimal digits; a file with another one is refused. Commands that send the file fill it in;
    a server needs it. Not checked when absent."""


Mesh = Annotated[
    Box
    | Plate
    | Cylinder
    | Tube
    | Sphere
    | Cone
    | Ogive
    | Hemisphere
    | SphericalCap
    | RingSector
    | TwoTets
    | Shards
    | Union
    | Difference
    | Intersection
    | Cad
    | Stl
    | MeshFile,
    Field(discriminator="shape"),
]
