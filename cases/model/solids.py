"""Bodies whose dimensions are measured on their mesh: combinations of shapes, CAD files and surface files."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Angle, Length
from .grading import Grading
from .operands import CadForm, DifferenceForm, IntersectionForm, UnionForm
from .tables import Axis, Model, Point, Positive, Sha256


class Measured(Model):
    """A body whose dimensions are measured on its mesh."""


class Meshed(Measured):
    """A body that gmsh meshes."""

    element_size: Annotated[Length, Positive]
    """Edge length of the tets, approximately. Edges and faces of the body that are shorter have smaller tets, which
    reduce the time step; ``conoid validate`` lists them."""
    grading: Grading | None = None
    """Coarser tets away from a region of interest."""

    @property
    def generator(self) -> Literal["gmsh"]:
        """The mesh generator."""
        return "gmsh"


class Solid(Meshed):
    """A body whose geometry OpenCASCADE makes."""

    sector: Literal["full", "half", "quarter"] = "full"
    """Modelled part of the body, for scenes with planes of symmetry. ``half``: the positive side of ``centre`` in
    the first direction across ``axis``; ``quarter``: in both. The directions across ``axis`` in cyclic order are x,
    y for z; y, z for x; z, x for y. Each plane also needs a boundary ``symmetry``."""
    centre: Point = (0.0, 0.0, 0.0)
    """Point through which the planes of a sector pass."""
    axis: Axis = "z"
    """Direction across which a sector is cut."""


class Union(UnionForm, Solid):
    """The union of several bodies: all that lies in at least one of them."""


class Difference(DifferenceForm, Solid):
    """The first of several bodies without the others: a plate with holes, a jacket around a core."""


class Intersection(IntersectionForm, Solid):
    """The intersection of several bodies: all that lies in every one of them."""


class Cad(CadForm, Solid):
    """Solids of a STEP or BREP file."""


class Stl(Meshed):
    """The interior of a closed surface of triangles (STL). The surface is meshed again with ``element_size``."""

    shape: Literal["stl"]
    """Selects this shape."""
    path: str
    """Path of the file, text or binary, relative to the folder of the case."""
    unit: Annotated[Length, Positive]
    """Length unit of the coordinates in the file, such as ``"1 mm"``."""
    edge_angle: Annotated[Angle, Field(gt=0, lt=3.1)] = 0.6981317007977318
    """Largest angle between neighbouring triangles of a smooth surface; a larger angle is an edge of the body."""
    sha256: Sha256 | None = None
    """SHA-256 hash of the file, 64 hexadecimal digits. A file with another hash is refused. Default: not checked."""


Combination = Union | Difference | Intersection
