"""What a combination is made of: forms that are placed and turned, solids of CAD files, and combinations of these."""

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
    """The kind of body."""
    path: str
    """Of the file, STEP (ISO 10303-21) or BREP (OpenCASCADE); a relative one begins in the folder of the case."""
    unit: Annotated[Length, Positive] | None = None
    """Length of 1 in the file: ``"1 mm"``. A STEP file says it itself: the key may be absent, and a file that says
    otherwise is refused. A BREP file does not, and needs the key."""
    solids: tuple[str | Annotated[Count, Field(ge=1)], ...] = ()
    """Which solids, by their names in the file or their numbers from 1 in its order; all when empty. Several are one
    body: their meshes have nodes in common where the solids touch."""
    heal: bool = False
    """Whether OpenCASCADE mends the file first: short edges, small faces, gaps between faces."""
    sha256: Sha256 | None = None
    """Of the file, 64 hexadecimal digits; a file with another one is refused. Not checked when absent."""


class UnionForm(Model):
    """Everything that lies in at least one of the bodies."""

    shape: Literal["union"]
    """The kind of body."""
    of: Annotated[tuple["Operand", ...], Field(min_length=2, max_length=100)]
    """The bodies."""


class DifferenceForm(Model):
    """What lies in the first of the bodies and in none of the others."""

    shape: Literal["difference"]
    """The kind of body."""
    of: Annotated[tuple["Operand", ...], Field(min_length=2, max_length=100)]
    """The body, and those that are cut out of it."""


class IntersectionForm(Model):
    """What lies in all of the bodies."""

    shape: Literal["intersection"]
    """The kind of body."""
    of: Annotated[tuple["Operand", ...], Field(min_length=2, max_length=100)]
    """The bodies."""


class Turned(Model):
    """What all operands have in common."""

    turn: Turn | None = None
    """How it is turned before it is combined."""


class BoxOperand(BoxForm, Turned):
    """A rectangular block between two corners."""


class PlateOperand(PlateForm, Turned):
    """A rectangular plate: ``thickness`` along ``axis``, ``width`` x ``height`` across it, centred on its axis."""


class CylinderOperand(CylinderForm, Turned):
    """A solid cylinder."""


class TubeOperand(TubeForm, Turned):
    """A hollow cylinder."""


class SphereOperand(SphereForm, Turned):
    """A ball."""


class ConeOperand(ConeForm, Turned):
    """A cone or a frustum of one."""


class OgiveOperand(OgiveForm, Turned):
    """A shank with an ogive on it."""


class HemisphereOperand(HemisphereForm, Turned):
    """Half of a ball."""


class SphericalCapOperand(SphericalCapForm, Turned):
    """What a plane cuts off a ball."""


class RingSectorOperand(RingSectorForm, Turned):
    """A piece of a tube between two half-planes through its axis."""


class CadOperand(CadForm, Turned):
    """Solids of a STEP or BREP file."""


class UnionOperand(UnionForm, Turned):
    """Everything that lies in at least one of the bodies."""


class DifferenceOperand(DifferenceForm, Turned):
    """What lies in the first of the bodies and in none of the others."""


class IntersectionOperand(IntersectionForm, Turned):
    """What lies in all of the bodies."""


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
    | UnionOperand
    | DifferenceOperand
    | IntersectionOperand,
    Field(discriminator="shape"),
]
for _form in (UnionForm, DifferenceForm, IntersectionForm, UnionOperand, DifferenceOperand, IntersectionOperand):
    _form.model_rebuild()

CombinedForm = UnionForm | DifferenceForm | IntersectionForm

Place = tuple[int | str, ...]


def leaves(form: CombinedForm, place: Place = (), depth: int = 1) -> Iterator[tuple[Place, int, Operand]]:
    """All operands that are no combinations themselves: where each stands below ``place``, how deep, and what it is."""
    for n, each in enumerate(form.of):
        if isinstance(each, CombinedForm):
            yield from leaves(each, (*place, "of", n), depth + 1)
        else:
            yield (*place, "of", n), depth, each
