"""Boolean combinations of bodies, drawn into the frame of a model."""

from dataclasses import dataclass
from typing import Any

from conoid.cases.model.operands import CadForm, CadOperand, CombinedForm, DifferenceForm, Operand, StlForm, UnionForm
from conoid.cases.shapes.combined import box_of

from ...errors import MeshError
from ..sources import Sources
from . import draw
from .cad import imported, size_of
from .draw import Solids
from .facets import extent_of, faceted
from .frame import Frame

AnyForm = Operand | CadForm | CombinedForm


@dataclass(frozen=True)
class Drawing:
    """Drawing of forms into the current model of ``gmsh``, in the coordinates ``frame``. The files of the forms are in
    ``sources``.

    Several parts can be drawn into one model by several calls of ``solids``, which returns the volumes of a part. The
    function ``occ.fragment``, applied to all volumes, gives their meshes common nodes and returns a map from old to new
    volumes.
    """

    gmsh: Any
    frame: Frame
    sources: Sources
    exact: bool = False
    """True if CAD bodies keep their surfaces (``cad.imported``). CAD operands of a combination always keep their
    surfaces. Otherwise a body that a general transformation damages would not be cut off, and no error would be
    reported."""

    def solids(self, form: AnyForm, key: str) -> Solids:
        """Draw the form at the key ``key`` of the case, with its rotation. Return the volumes of the form, or no volume
        if the form is empty.
        """
        occ = self.gmsh.model.occ
        if isinstance(form, CombinedForm):
            made = self._combined(form, key)
        elif isinstance(form, CadForm):
            head = f"{key}.path = {form.path!r}"
            exact = self.exact or isinstance(form, CadOperand)
            made = imported(self.gmsh, form, self.sources[key], self.frame, head, exact=exact)
        elif isinstance(form, StlForm):
            made = faceted(self.gmsh, form, self.sources[key], self.frame, f"{key}.path = {form.path!r}")
        else:
            made = draw.drawn(occ, form, self.frame)
        draw.turn(occ, made, getattr(form, "turn", None), self.frame)
        return made

    def _combined(self, form: CombinedForm, key: str) -> Solids:
        occ = self.gmsh.model.occ
        parts = [self.solids(each, f"{key}.of[{n}]") for n, each in enumerate(form.of)]
        first, rest = parts[0], [solid for part in parts[1:] for solid in part]
        if isinstance(form, UnionForm):
            every = [*first, *rest]
            return _three(occ.fuse(every[:1], every[1:])) if len(every) > 1 else every
        if first and isinstance(form, DifferenceForm):
            return _three(occ.cut(first, rest)) if rest else first
        for part in parts[1:]:
            if not (first and part):
                occ.remove([*first, *part], recursive=True)
                first = []
            else:
                first = _three(occ.intersect(first, part))
        return first


def _three(made: Any) -> Solids:
    """Return the volumes among the results of a boolean operation."""
    return [each for each in made[0] if each[0] == 3]


def extent(gmsh: Any, form: AnyForm, sources: Sources, key: str) -> float:
    """Return an upper estimate of the largest extent of a form, m. The estimate is used as the unit of lengths of the
    model.
    """
    if isinstance(form, CadForm):
        return size_of(gmsh, form, sources[key], f"{key}.path = {form.path!r}")
    if isinstance(form, StlForm):
        return extent_of(form, sources[key], f"{key}.path = {form.path!r}")
    if isinstance(form, CombinedForm):
        found = [extent(gmsh, each, sources, f"{key}.of[{n}]") for n, each in enumerate(form.of)]
        if isinstance(form, DifferenceForm):
            return found[0]
        return max(found) if isinstance(form, UnionForm) else min(found)
    box = box_of(form)
    if box is None:
        raise MeshError(f"{key}: a shape of this kind has no bounding box")
    return max(b - a for a, b in zip(*box, strict=True))
