"""Bodies whose dimensions are measured on their mesh: combinations of shapes, CAD files and surface files."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Angle, Length
from .grading import Grading
from .operands import CadForm, DifferenceForm, IntersectionForm, UnionForm
from .tables import Axis, Model, Point, Positive, Sha256


class Measured(Model):
    """Keys of a body whose dimensions are measured on its mesh."""


class Meshed(Measured):
    """Keys of a body that gmsh meshes."""

    element_size: Annotated[Length, Positive]
    """Approximate edge length of the tets. Edges and faces of the body that are shorter than ``element_size`` have
    smaller tets, which reduce the time step; ``conoid validate`` lists these edges and faces."""
    grading: Grading | None = None
    """Coarser tets far from a region of interest."""

    @property
    def generator(self) -> Literal["gmsh"]:
        """The mesh generator."""
        return "gmsh"


class Solid(Meshed):
    """Keys of a body whose geometry OpenCASCADE makes."""

    sector: Literal["full", "half", "quarter"] = "full"
    """Modelled part of the body, for scenes with planes of symmetry. ``half``: only the positive side of ``centre`` in
    the first direction across ``axis``. ``quarter``: only the positive sides in both directions across ``axis``. The
    directions across ``axis`` in cyclic order are x, y for z; y, z for x; z, x for y. Each plane of symmetry also needs
    a boundary ``symmetry``."""
    centre: Point = (0.0, 0.0, 0.0)
    """Point through which the planes of a sector pass."""
    axis: Axis = "z"
    """Direction across which a sector is cut."""


class Union(UnionForm, Solid):
    """The union of several bodies: all points that lie in at least one of the bodies."""


class Difference(DifferenceForm, Solid):
    """The difference of several bodies: the first body without the other bodies, such as a plate with holes, or a
    jacket around a core.
    """


class Intersection(IntersectionForm, Solid):
    """The intersection of several bodies: all points that lie in every one of the bodies."""


class Cad(CadForm, Solid):
    """Solids of a STEP or BREP file."""


class Stl(Meshed):
    """The interior of a closed surface of triangles (STL). The surface is meshed again with edges of length
    ``element_size``.
    """

    shape: Literal["stl"]
    """Selects this shape."""
    path: str
    """Path of the file, text or binary, relative to the folder of the case."""
    unit: Annotated[Length, Positive]
    """Length unit of the coordinates in the file, such as ``"1 mm"``."""
    edge_angle: Annotated[Angle, Field(gt=0, lt=3.1)] = 0.6981317007977318
    """Largest angle between neighbouring triangles of a smooth surface. Where the angle is larger, the body gets an
    edge."""
    sha256: Sha256 | None = None
    """SHA-256 hash of the file, 64 hexadecimal digits. A file whose hash differs from ``sha256`` is refused. Default:
    the hash is not checked."""


Combination = Union | Difference | Intersection
