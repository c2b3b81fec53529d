"""Bodies and their meshes: primitives that Conoid meshes, and mesh files."""

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
    """Keys of all primitives."""

    element_size: Annotated[Length, Positive]
    """Approximate edge length of the tets. The edge length is at most the smallest extent of the body. Use a quarter of
    the thickness or less where a body bends: with 4 tets through the thickness the pressure forms ``nodal`` and
    ``split`` are 13 % too stiff, with 2 tets 50 % (``standard``: 26 and 100 %). The time step is proportional to
    ``element_size``; the number of tets is proportional to ``1 / element_size^3``."""
    generator: Literal["gmsh", "structured"] = "gmsh"
    """Mesh generator. ``gmsh``: unstructured, for all shapes. ``structured``: cells of a regular grid, each cut into
    tets; for verification and for ``slit``, with the shapes box, plate, cylinder and tube."""
    split: Literal[5, 6] = 6
    """With ``generator = "structured"``: number of tets per hexahedral cell."""
    sector: Literal["full", "half", "quarter"] = "full"
    """Modelled part of the body, for scenes with planes of symmetry. ``half``: only the positive side of the centre
    (box: of the origin) in the first direction across ``axis``. ``quarter``: only the positive sides in both directions
    across ``axis``. The directions across ``axis`` in cyclic order are x, y for z; y, z for x; z, x for y. Each plane
    of symmetry also needs a boundary ``symmetry``."""
    grading: Grading | None = None
    """Coarser tets far from a region of interest, with ``generator = "gmsh"``."""


class Slit(Model):
    """An initial crack: a rectangle normal to ``axis``, on a plane of nodes of the structured generator. Each side of
    the rectangle that lies inside the body is a crack front.

    ``low`` and ``high`` are the corners of the rectangle in the two directions across ``axis`` (x, y for z; y, z for x;
    z, x for y).
    """

    axis: Axis
    """Normal of the crack."""
    at: Length
    """Coordinate of the crack along ``axis``: a plane of nodes inside the body."""
    low: tuple[Length, Length]
    """Corner of the crack with the lowest coordinates."""
    high: tuple[Length, Length]
    """Corner of the crack with the highest coordinates."""


class Box(BoxForm, Primitive):
    """A rectangular block between two corners. A sector of a block is cut at the origin of the coordinates."""

    axis: Axis = "z"
    """Direction across which a sector is cut."""
    slit: Slit | None = None
    """An initial crack, with ``generator = "structured"``."""


class Symmetric(Primitive):
    """Keys of primitives that are symmetric about the planes of a sector."""

    aligned: bool | None = None
    """Whether a half or full body is meshed as quarters that have common faces, with ``generator = "gmsh"``. ``true``:
    the tets on the axis are as small as those of a quarter; ``false``: they are up to twice as large. Default: ``true``
    for parts with ``erosion``, so that a rod penetrates equally deep in a full model and in a quarter
    (docs/theory/erosion.md)."""


class Plate(PlateForm, Symmetric):
    """A rectangular plate with ``thickness`` along ``axis``, ``width`` and ``height`` across ``axis``.

    The key ``base`` is the centre of the face at the low end of ``axis``.
    """

    slit: Slit | None = None
    """An initial crack, with ``generator = "structured"``."""


class Cylinder(CylinderForm, Symmetric):
    """A solid cylinder. The key ``base`` is the centre of the end face at the low end of ``axis``."""


class Tube(TubeForm, Symmetric):
    """A hollow cylinder. The key ``base`` is the centre of the end face at the low end of ``axis``."""


class Sphere(SphereForm, Symmetric):
    """A solid sphere."""


class Drawn(Primitive):
    """Keys of a primitive that only gmsh can mesh."""

    generator: Literal["gmsh"] = "gmsh"
    """Mesh generator; gmsh is the only generator for this shape."""


class Cone(ConeForm, Drawn):
    """A cone or a truncated cone: ``radius`` at ``base``, ``top_radius`` at the high end of ``axis``."""


class Ogive(OgiveForm, Drawn):
    """A projectile: a cylindrical shank with an ogival nose; the outline of the nose is an arc of a circle.

    If only one of ``crh`` and ``nose`` is given, the nose is a tangent ogive: its arc continues the shank smoothly, and
    its length is D sqrt(crh - 1/4), D the diameter. If both ``crh`` and ``nose`` are given, the nose is a secant ogive,
    with an edge at the shank.
    """


class Hemisphere(HemisphereForm, Drawn):
    """Half of a sphere."""


class SphericalCap(SphericalCapForm, Drawn):
    """A segment of a sphere, cut off by a plane."""


class RingSector(RingSectorForm, Drawn):
    """A segment of a tube between two half-planes through its axis; a segment of a cylinder with ``inner_radius =
    0``."""


class Loose(Primitive):
    """Single tets with edges of length ``element_size``; sectors, grading and choice of the generator are not
    available.
    """

    generator: Literal["structured"] = "structured"
    """Mesh generator. The key has no effect on this shape."""
    sector: Literal["full"] = "full"
    """Modelled part of the body. This shape is always modelled completely."""
    grading: None = None
    """This key is not available for this shape."""


class TwoTets(Loose):
    """Two tets with a common face, for verification. ``centre`` is the centre of the common face, and ``axis`` is the
    normal of this face; one corner of the face lies in the first direction across ``axis``. With ``lean`` the line from
    the centre to the free corners is inclined in the first direction across ``axis``.
    """

    shape: Literal["two_tets"]
    """Selects this shape."""
    centre: Point = (0.0, 0.0, 0.0)
    """Centre of the common face."""
    axis: Axis = "z"
    """Normal of the common face."""
    lean: Annotated[Angle, Field(ge=0, le=1.1)] = 0.0
    """Inclination of the tets, such as ``"30 deg"``. The altitude of the tets stays unchanged; with 0 the tets are
    regular."""


class Shards(Loose):
    """Separate tets, for verification: ``count`` tets along x, y, z from the corner ``base``; each tet has a separate
    cube and a random orientation.
    """

    shape: Literal["shards"]
    """Selects this shape."""
    base: Point = (0.0, 0.0, 0.0)
    """Corner with the lowest coordinates of the group of tets."""
    count: tuple[Edge, Edge, Edge]
    """Number of tets along x, y, z."""
    gap: Annotated[Length, Field(ge=0)] = 0.0
    """Smallest distance between neighbouring tets for any orientation of the tets."""
    perturbation: Annotated[Ratio, Field(ge=0, le=0.15)] = 0.0
    """Largest random displacement of each coordinate of a node, divided by the edge length."""
    seed: Annotated[Count, Field(ge=0, lt=2**63)] = 0
    """Seed of the random orientations and displacements."""

    @property
    def axis(self) -> Axis:
        """Axis of the shape, which all shapes have; the axis of single tets has no effect."""
        return "z"


class MeshFile(Measured):
    """A tet mesh from a file: gmsh .msh 4.1 or 2.2, Abaqus .inp, LS-DYNA .k, .key or .dyn, Radioss .rad, VTK .vtu. The
    page docs/howto/meshes.md describes which elements and sets are read.
    """

    shape: Literal["file"]
    """Selects a mesh file."""
    path: str
    """Path of the file, relative to the folder of the case. Commands that submit the case to a server also send the
    file, which the server finds by its ``sha256`` (docs/howto/meshes.md)."""
    unit: Annotated[Length, Positive]
    """Length unit of the coordinates in the file, such as ``"1 mm"``."""
    group: str | None = None
    """Group of elements that forms the part; default: all elements of the file. gmsh: a physical group by name or
    number. Abaqus: an element set (``Bar-1.Set-1`` for a set of an instance or a part), an instance or a part. LS-DYNA
    and Radioss: a part, a set or a subset."""
    second_order: Literal["auto", "corners", "eight"] = "auto"
    """Treatment of tets with 10 nodes. ``corners``: each tet with 10 nodes becomes one tet of its 4 corners. ``eight``:
    each tet with 10 nodes becomes eight tets of 4 nodes. ``auto``: ``eight`` if the corners alone would lose more than
    0.1 % of the volume, otherwise ``corners``; a warning reports the choice."""
    sha256: Sha256 | None = None
    """SHA-256 hash of the file, 64 hexadecimal digits. A file with another hash is refused. Commands that send the file
    to a server add this key, because a server requires it. Default: the hash is not checked."""


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
