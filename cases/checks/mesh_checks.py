"""Checks of a mesh that involve several of its keys: sizes that fit each other, slits on planes of nodes."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from ..estimates.mesh_size import Row, grid, slit_lines
from ..model.bodies import Box, Loose, Mesh, Plate
from ..model.solids import Measured
from ..model.tables import Axis
from ..reading.files import located
from ..reading.problems import Location, Problem, problem
from ..shapes.geometry import AXES, across, cut_directions, index, thinnest
from .form_checks import check_form
from .measured_checks import check_grading, check_measured, files_in


def check_mesh(mesh: Mesh, location: Location) -> Iterator[Problem]:
    """Yields every problem of a mesh at ``location``."""
    if isinstance(mesh, Measured):
        yield from check_measured(mesh, location)
        return
    yield from check_grading(mesh, location)
    if mesh.grading is not None and mesh.generator == "structured":
        message = "needs generator = 'gmsh'; the structured generator has one element size"
        yield problem((*location, "grading"), ..., message)
    wrong = list(check_form(mesh, location))
    yield from wrong
    if wrong:
        return
    if isinstance(mesh, Box):
        away = [d for d in cut_directions(mesh, mesh.axis) if mesh.high[d] <= 0]
        for d in away:
            yield problem((*location, "high", d), mesh.high[d], f"a {mesh.sector} box keeps the side {AXES[d]} > 0")
        if away:
            return
    if not isinstance(mesh, Loose) and mesh.element_size > thinnest(mesh) * (1 + 1e-9):
        message = f"must not be above the smallest extent of the modelled part, {thinnest(mesh):g} m"
        yield problem((*location, "element_size"), mesh.element_size, message)
    elif isinstance(mesh, Box | Plate):
        yield from _slit(mesh, (*location, "slit"))


def missing_files(parts: Iterable[Mesh], folder: Path) -> Iterator[Problem]:
    """Yields a problem for each missing file of the ``parts``. Relative paths start in ``folder``, the folder of the
    case.
    """
    for i, mesh in enumerate(parts):
        for place, file in files_in(mesh):
            path = located(file.path, file.sha256, folder)
            if not path.is_file():
                yield problem(("parts", i, "mesh", *place, "path"), file.path, f"no such file ({path.absolute()})")


def _slit(mesh: Box | Plate, location: Location) -> Iterator[Problem]:
    slit = mesh.slit
    if slit is None:
        return
    if mesh.generator != "structured":
        yield problem(location, ..., "needs generator = 'structured'")
        return
    rows = grid(mesh)
    if not (_between(rows[index(slit.axis)], slit.at) and _on_plane(rows[index(slit.axis)], slit.at)):
        yield problem(
            (*location, "at"), slit.at, f"must be a plane of nodes inside the body; {_planes(mesh, slit.axis)}"
        )
    for k, d in enumerate(across(slit.axis)):
        if slit.low[k] >= slit.high[k]:
            yield problem((*location, "high", k), slit.high[k], f"must be above low[{k}], {slit.low[k]}")
            return
        for key, x in (("low", slit.low[k]), ("high", slit.high[k])):
            if _between(rows[d], x) and not _on_plane(rows[d], x):
                message = f"must be a plane of nodes, or outside the body; {_planes(mesh, AXES[d])}"
                yield problem((*location, key, k), x, message)
    if 0 in slit_lines(mesh):
        yield problem(location, ..., "is outside the body or too narrow: no node lies inside its border")


def _planes(mesh: Box | Plate, axis: Axis) -> str:
    row = grid(mesh)[index(axis)]
    return f"they are {row.spacing:g} m apart, from {axis} = {row.start:g} m"


def _between(row: Row, x: float) -> bool:
    return 0 < row.place(x) < row.cells


def _on_plane(row: Row, x: float) -> bool:
    return row.place(x) == round(row.place(x))
