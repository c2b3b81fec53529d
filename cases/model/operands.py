"""Operands of a combination: shapes that are placed and turned, solids of CAD files, and combinations of operands."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from ..units import Length
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
from .motion import Turn
from .tables import Count, Model, Positive, Sha256


class CadForm(Model):
    """Solids of a STEP or BREP file."""

    shape: Literal["cad"]
    """Selects a CAD file."""
    path: str
    """Path of the file, STEP (ISO 10303-21) or BREP (OpenCASCADE), relative to the folder of the case."""
    unit: Annotated[Length, Positive] | None = None
    """Length unit of the coordinates in the file, such as ``"1 mm"``. A BREP file requires the key ``unit``. A STEP
    file contains its unit, so that ``unit`` may be absent; a value that differs from the unit of the file is refused.
    """
    solids: tuple[str | Annotated[Count, Field(ge=1)], ...] = ()
    """Solids to use, by their names in the file or by their numbers from 1 in its order; all solids if empty. Several
    solids are one body: their meshes have common nodes where the solids touch."""
    heal: bool = False
    """Whether OpenCASCADE repairs the file first: short edges, small faces, gaps between faces."""
    sha256: Sha256 | None = None
    """SHA-256 hash of the file, 64 hexadecimal digits. A file whose hash differs from ``sha256`` is refused. Default:
    the hash is not checked."""


class StlForm(Model):
    """The interior of a closed surface of triangles (STL)."""

    shape: Literal["stl"]
    """Selects an STL file."""
    path: str
    """Path of the file, text or binary, relative to the folder of the case."""
    unit: Annotated[Length, Positive]
    """Length unit of the coordinates in the file, such as ``"1 mm"``."""
    sha256: Sha256 | None = None
    """SHA-256 hash of the file, 64 hexadecimal digits. A file whose hash differs from ``sha256`` is refused. Default:
    the hash is not checked."""


class UnionForm(Model):
    """The union of bodies: all points that lie in at least one of the bodies."""

    shape: Literal["union"]
    """Selects this shape."""
    of: Annotated[tuple["Operand", ...], Field(min_length=2, max_length=100)]
    """The bodies that are united."""


class DifferenceForm(Model):
    """The difference of bodies: the first body without the other bodies."""

    shape: Literal["difference"]
    """Selects this shape."""
    of: Annotated[tuple["Operand", ...], Field(min_length=2, max_length=100)]
    """The first body, followed by the bodies that are removed from it."""


class IntersectionForm(Model):
    """The intersection of bodies: all points that lie in every one of the bodies."""

    shape: Literal["intersection"]
    """Selects this shape."""
    of: Annotated[tuple["Operand", ...], Field(min_length=2, max_length=100)]
    """The bodies that are intersected."""


class Turned(Model):
    """Keys of all operands."""

    turn: Turn | None = None
    """Rotation of this body before it is combined with other bodies."""


class BoxOperand(BoxForm, Turned):
    """A rectangular block between two corners."""


class PlateOperand(PlateForm, Turned):
    """A rectangular plate with ``thickness`` along ``axis``, ``width`` and ``height`` across ``axis``."""


class CylinderOperand(CylinderForm, Turned):
    """A solid cylinder."""


class TubeOperand(TubeForm, Turned):
    """A hollow cylinder."""


class SphereOperand(SphereForm, Turned):
    """A solid sphere."""


class ConeOperand(ConeForm, Turned):
    """A cone or a truncated cone."""


class OgiveOperand(OgiveForm, Turned):
    """A projectile: a cylindrical shank with an ogival nose."""


class HemisphereOperand(HemisphereForm, Turned):
    """Half of a sphere."""


class SphericalCapOperand(SphericalCapForm, Turned):
    """A segment of a sphere, cut off by a plane."""


class RingSectorOperand(RingSectorForm, Turned):
    """A segment of a tube between two half-planes through its axis."""


class CadOperand(CadForm, Turned):
    """Solids of a STEP or BREP file."""


class StlOperand(StlForm, Turned):
    """The interior of a closed surface of triangles (STL). Each triangle stays a face of the body, so that no element
    is larger than the triangles. The surface has at most 1,500 triangles.
    """


class UnionOperand(UnionForm, Turned):
    """The union of bodies: all points that lie in at least one of the bodies."""


class DifferenceOperand(DifferenceForm, Turned):
    """The difference of bodies: the first body without the other bodies."""


class IntersectionOperand(IntersectionForm, Turned):
    """The intersection of bodies: all points that lie in every one of the bodies."""


Operand = Annotated[
    BoxOperand
    | PlateOperand
    | CylinderOperand
    | TubeOperand
    | SphereOperand
    | ConeOperand
    | OgiveOperand
    | HemisphereOperand
    | SphericalCapOperand
    | RingSectorOperand
    | CadOperand
    | StlOperand
    | UnionOperand
    | DifferenceOperand
    | IntersectionOperand,
    Field(discriminator="shape"),
]
for _form in (UnionForm, DifferenceForm, IntersectionForm, UnionOperand, DifferenceOperand, IntersectionOperand):
    _form.model_rebuild()

FileForm = CadForm | StlForm
"""Shapes that are read from a file; their dimensions are known only after the file has been read."""
CombinedForm = UnionForm | DifferenceForm | IntersectionForm

Place = tuple[int | str, ...]


def leaves(form: CombinedForm, place: Place = (), depth: int = 1) -> Iterator[tuple[Place, int, Operand]]:
    """Yields all operands that are not combinations, each with its key below ``place``, its depth and the operand."""
    for n, each in enumerate(form.of):
        if isinstance(each, CombinedForm):
            yield from leaves(each, (*place, "of", n), depth + 1)
        else:
            yield (*place, "of", n), depth, each
