"""Checks of bodies whose sizes are measured on their mesh (combination, CAD, STL, mesh file), and of the files that
these bodies name.
"""

from collections.abc import Iterator

from ..model.bodies import Mesh, MeshFile, Primitive
from ..model.operands import CadForm, CombinedForm, FileForm, Place, StlForm, leaves
from ..model.solids import Cad, Measured, Meshed, Stl
from ..reading.problems import Location, Problem, problem
from .form_checks import check_form

_DEEPEST, _MOST = 8, 200
"""Largest depth of nested combinations, and largest number of shapes in a combination (chosen values, larger than
practical models need)."""

File = MeshFile | FileForm | Stl
"""Tables of a mesh that name a file by the keys ``path`` and ``sha256``."""


def files_in(mesh: Mesh) -> Iterator[tuple[Place, File]]:
    """Yields every file that a mesh names, and the key of its table below the mesh."""
    if isinstance(mesh, File):
        yield (), mesh
    elif isinstance(mesh, CombinedForm):
        yield from ((place, each) for place, _, each in leaves(mesh) if isinstance(each, FileForm))


def check_measured(mesh: Measured, location: Location) -> Iterator[Problem]:
    """Yields every problem of a mesh at ``location``."""
    if isinstance(mesh, Meshed):
        yield from check_grading(mesh, location)
    if isinstance(mesh, MeshFile):
        yield from _path(mesh, "a mesh file", location)
    elif isinstance(mesh, Cad):
        yield from _path(mesh, "a STEP or BREP file", location)
    elif isinstance(mesh, Stl):
        yield from _path(mesh, "an STL file", location)
    elif isinstance(mesh, CombinedForm):
        yield from _combination(mesh, location)


def _combination(mesh: CombinedForm, location: Location) -> Iterator[Problem]:
    found = list(leaves(mesh))
    if len(found) > _MOST:
        yield problem((*location, "of"), ..., f"{len(found)} shapes in all; allowed: up to {_MOST}")
        return
    if max(depth for _, depth, _ in found) > _DEEPEST:
        yield problem((*location, "of"), ..., f"combinations are nested more than {_DEEPEST} deep")
        return
    for place, _, each in found:
        if isinstance(each, CadForm):
            yield from _path(each, "a STEP or BREP file", (*location, *place))
        elif isinstance(each, StlForm):
            yield from _path(each, "an STL file", (*location, *place))
        else:
            yield from check_form(each, (*location, *place))


def _path(file: File, wanted: str, location: Location) -> Iterator[Problem]:
    if "://" in file.path or not file.path.strip():
        yield problem((*location, "path"), file.path, f"expected the path of {wanted}")


def check_grading(mesh: Primitive | Meshed, location: Location) -> Iterator[Problem]:
    """Yields every problem of the grading of a mesh."""
    if mesh.grading is None:
        return
    grading, location = mesh.grading, (*location, "grading")
    if grading.near >= grading.far:
        yield problem((*location, "near"), grading.near, f"must be below far, {grading.far} m")
    if grading.far_size < mesh.element_size:
        message = f"must not be below the element size, {mesh.element_size} m"
        yield problem((*location, "far_size"), grading.far_size, message)
    if grading.normal is not None and (grading.axis is not None or grading.radius):
        yield problem((*location, "normal"), grading.normal, "a plane has no axis and no radius; remove them or normal")
    if grading.surface and grading.model_fields_set & {"origin", "axis", "normal", "radius"}:
        message = "distances are measured from the surface of the body; remove origin, axis, normal and radius"
        yield problem((*location, "surface"), "true", message)
