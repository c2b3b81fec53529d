"""The bodies of a case and their meshes: primitives that are generated, and mesh files."""

from typing import Annotated, Literal

from pydantic import Field

from .tables import Axis, Count, Model, Point, Positive
from .units import Length, Ratio

Edge = Annotated[Count, Field(ge=1, le=1000)]


class Grading(Model):
    """Element size grows from ``element_size`` to ``far_size`` with the distance from a point or from an axis line.

    Within ``near`` of the origin (or the line through it along ``axis``) the size is ``element_size``, beyond ``far``
    it is ``far_size``, linear between.
    """

    origin: Point = (0.0, 0.0, 0.0)
    axis: Axis | None = None
    near: Annotated[Length, Field(ge=0)]
    far: Annotated[Length, Positive]
    far_size: Annotated[Length, Positive]


class Primitive(Model):
    """What all generated meshes share. ``structured`` is the regular generator kept for verification."""

    element_size: Annotated[Length, Positive]
    generator: Literal["gmsh", "structured"] = "gmsh"
    split: Literal[5, 6] = 6
    """Tets per hexahedron of the structured generator."""
    sector: Literal["full", "half", "quarter"] = "full"
    """Which part of the body is modelled: the positive side of its centre in the first, or both, of the two directions
    across ``axis`` (in cyclic order: x, y for z; y, z for x; z, x for y)."""
    grading: Grading | None = None


class Slit(Model):
    """A crack that is there from the start: a rectangle across ``axis`` at ``at``, on planes of nodes of the structured
    generator. It ends at those of its borders that lie inside the body.

    ``low`` and ``high`` are its corners in the two directions across ``axis`` (x, y for z; y, z for x; z, x for y).
    """

    axis: Axis
    at: Length
    low: tuple[Length, Length]
    high: tuple[Length, Length]


class Box(Primitive):
    """A rectangular block between two corners. The sector is cut at the origin of the coordinates."""

    shape: Literal["box"]
    low: Point
    high: Point
    axis: Axis = "z"
    slit: Slit | None = None


class Plate(Primitive):
    """A rectangular plate: ``thickness`` along ``axis``, ``width`` x ``height`` across it, centred on ``base``'s axis.

    ``base`` is the centre of the face from which the thickness is measured in the positive direction.
    """

    shape: Literal["plate"]
    base: Point = (0.0, 0.0, 0.0)
    axis: Axis = "z"
    width: Annotated[Length, Positive]
    height: Annotated[Length, Positive]
    thickness: Annotated[Length, Positive]
    slit: Slit | None = None


class Cylinder(Primitive):
    """A solid cylinder; ``base`` is the centre of its lower end face."""

    shape: Literal["cylinder"]
    base: Point = (0.0, 0.0, 0.0)
    axis: Axis = "z"
    radius: Annotated[Length, Positive]
    length: Annotated[Length, Positive]


class Tube(Primitive):
    """A hollow cylinder."""

    shape: Literal["tube"]
    base: Point = (0.0, 0.0, 0.0)
    axis: Axis = "z"
    inner_radius: Annotated[Length, Positive]
    radius: Annotated[Length, Positive]
    length: Annotated[Length, Positive]


class Sphere(Primitive):
    """A ball."""

    shape: Literal["sphere"]
    centre: Point = (0.0, 0.0, 0.0)
    axis: Axis = "z"
    radius: Annotated[Length, Positive]


class Loose(Primitive):
    """Tets of edge ``element_size``, put one by one: there are no sectors, and one generator."""

    generator: Literal["structured"] = "structured"
    sector: Literal["full"] = "full"
    grading: None = None


class TwoTets(Loose):
    """Two tets with a common face, whose centre is ``centre`` and whose normal is ``axis``; one corner of the face lies
    in the first direction across ``axis``. The line through their free corners and the centre leans that way, too."""

    shape: Literal["two_tets"]
    centre: Point = (0.0, 0.0, 0.0)
    axis: Axis = "z"
    lean: Annotated[Ratio, Field(ge=0, le=1.1)] = 0.0
    """rad; ``"30 deg"``. The tets keep their altitude, and are regular when they do not lean."""


class Shards(Loose):
    """Tets that are not connected with each other: ``count`` of them along x, y, z from the corner ``base``, each in a
    cube of its own and turned at random."""

    shape: Literal["shards"]
    base: Point = (0.0, 0.0, 0.0)
    count: tuple[Edge, Edge, Edge]
    gap: Annotated[Length, Field(ge=0)] = 0.0
    """Smallest distance of neighbours, however they are turned."""
    perturbation: Annotated[Ratio, Field(ge=0, le=0.15)] = 0.0
    """How far each coordinate of a node is moved at most, at random, of the edge."""
    seed: Annotated[Count, Field(ge=0, lt=2**63)] = 0

    @property
    def axis(self) -> Axis:
        """Of no meaning here; every body has one."""
        return "z"


class MeshFile(Model):
    """A mesh made elsewhere: gmsh .msh 4.1 or 2.2, or Abaqus .inp. ``unit`` is the length unit of its coordinates."""

    shape: Literal["file"]
    path: str
    unit: Annotated[Length, Positive]
    group: str | None = None
    """Physical group or element set; all tets when absent."""
    sha256: str | None = None


Mesh = Annotated[Box | Plate | Cylinder | Tube | Sphere | TwoTets | Shards | MeshFile, Field(discriminator="shape")]
