"""The bodies of a case and their meshes: primitives that are generated, and mesh files."""

from typing import Annotated, Literal

from pydantic import Field

from .tables import Axis, Model, Point, Positive
from .units import Length


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


class Box(Primitive):
    """A rectangular block between two corners. The sector is cut at the origin of the coordinates."""

    shape: Literal["box"]
    low: Point
    high: Point
    axis: Axis = "z"


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


class MeshFile(Model):
    """A mesh made elsewhere: gmsh .msh 4.1 or 2.2, or Abaqus .inp. ``unit`` is the length unit of its coordinates."""

    shape: Literal["file"]
    path: str
    unit: Annotated[Length, Positive]
    group: str | None = None
    """Physical group or element set; all tets when absent."""
    sha256: str | None = None


Mesh = Annotated[Box | Plate | Cylinder | Tube | Sphere | MeshFile, Field(discriminator="shape")]
