"""Bodies of which only a mesh tells the sizes: combinations of shapes, and files with surfaces of bodies."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Angle, Length
from .grading import Grading
from .operands import CadForm, DifferenceForm, IntersectionForm, UnionForm
from .tables import Axis, Model, Point, Positive, Sha256


class Measured(Model):
    """A body whose sizes are measured on its mesh."""


class Meshed(Measured):
    """One whose mesh gmsh makes."""

    element_size: Annotated[Length, Positive]
    """Edge of a tet, about. Edges and faces of the body that are smaller have smaller tets, which hold the time step
    down: ``conoid validate`` names them."""
    grading: Grading | None = None
    """Coarser tets away from a place."""

    @property
    def generator(self) -> Literal["gmsh"]:
        """What makes its mesh."""
        return "gmsh"


class Solid(Meshed):
    """One that OpenCASCADE draws."""

    sector: Literal["full", "half", "quarter"] = "full"
    """Which part of the body is modelled: the positive side of ``centre`` in the first, or both, of the two directions
    across ``axis`` (in cyclic order: x, y for z; y, z for x; z, x for y)."""
    centre: Point = (0.0, 0.0, 0.0)
    """A point of the planes at which a sector is cut."""
    axis: Axis = "z"
    """The direction across which a sector is cut."""


class Union(UnionForm, Solid):
    """Everything that lies in at least one of several bodies."""


class Difference(DifferenceForm, Solid):
    """What lies in the first of several bodies and in none of the others: a jacket round a core, a plate with holes."""


class Intersection(IntersectionForm, Solid):
    """What lies in all of several bodies."""


class Cad(CadForm, Solid):
    """Solids of a STEP or BREP file."""


class Stl(Meshed):
    """The inside of a closed surface of triangles. It is meshed anew with the element size, on the triangles."""

    shape: Literal["stl"]
    """The kind of body."""
    path: str
    """Of the file, text or binary; a relative one begins in the folder of the case."""
    unit: Annotated[Length, Positive]
    """Length of 1 in the file: ``"1 mm"``."""
    edge_angle: Annotated[Angle, Field(gt=0, lt=3.1)] = 0.6981317007977318
    """Edges at which two triangles meet at a larger angle are edges of the body, 40 degrees; others are smooth."""
    sha256: Sha256 | None = None
    """Of the file, 64 hexadecimal digits; a file with another one is refused. Not checked when absent."""


Combination = Union | Difference | Intersection
