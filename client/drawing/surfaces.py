"""Surfaces of a frame for a picture. The surface of each part has the values of the field; it is cut at sections and
mirrored. A section cuts the tets, and the field is interpolated on the cut surface.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from conoid.cases.figures import exacts, number

from ..errors import LookError, ViewError
from . import vtk
from .fields import FIELDS, NAMED
from .picture import Picture
from .planes import Mirror

Array: TypeAlias = "np.ndarray[Any, np.dtype[np.float64]]"

_DEBRIS = 0.003
"""Fraction of the volume of a part that lies beyond each end of its bulk (the main piece, without debris) along an
axis."""
_ASIDE = 0.25
"""Distance from the bulk of a part at which debris begins, divided by the length of the bulk. The camera frames the
bulk only; with the chosen _DEBRIS and _ASIDE a few fragments far ahead do not make the body small in the picture."""
_ONE = 1e-6
"""Distance below which two points are merged, relative to the length of a body (chosen value)."""


@dataclass(frozen=True)
class Piece:
    """A part as it is drawn. The surface has the field in the array ``shown``, by cell or by point. Each cell has
    the number of its fragment (0 in a frame without fragments), and a flag for debris far from the bulk of the part.
    """

    part: int
    surface: Any
    opacity: float


def read_mesh(path: Path) -> Any:
    """Reads the whole mesh of a frame as a pyvista.UnstructuredGrid."""
    return vtk.read(str(path))[0]


def pieces(grid: Any, picture: Picture, towards: Sequence[float]) -> list[Piece]:
    """Returns the pieces of a ``prepared`` frame for a camera in the direction ``towards``. Raises LookError if the
    sections leave no tets.
    """
    sections = [Section(plane, towards[plane.axis] >= 0.0) for plane in picture.sections]
    found = []
    for part in np.unique(grid["part"]).tolist():
        if part not in picture.hidden:
            surface = _surface(_part(grid, part, picture), picture, [] if part in picture.whole else sections)
            found += [Piece(part, surface, picture.opacity.get(part, 1.0))] if surface is not None else []
    if not found:
        raise _nothing(grid, picture)
    return _without_seams(found, picture)


def _without_seams(found: list[Piece], picture: Picture) -> list[Piece]:
    """Removes the faces that two opaque parts have in common, because these faces are not visible."""
    kept = {piece.part: piece for piece in found}
    for whole in (False, True):
        group = [piece for piece in found if piece.opacity == 1.0 and (piece.part in picture.whole) == whole]
        for piece, seam in zip(group, _seams([piece.surface for piece in group]), strict=True):
            if seam.any() and not seam.all():
                kept[piece.part] = replace(piece, surface=_left(piece.surface, seam))
    return list(kept.values())


def _seams(surfaces: Sequence[Any]) -> list[Any]:
    """Returns a mask (cells,) for each surface: True for faces that another surface also has."""
    if len(surfaces) < 2:
        return [np.zeros(surface.n_cells, bool) for surface in surfaces]
    sizes = [surface.n_cells for surface in surfaces]
    centres = np.concatenate([np.asarray(surface.cell_centers().points, float) for surface in surfaces])
    step = _ONE * max(surface.length for surface in surfaces)
    _, which = np.unique(np.round(centres / step), axis=0, return_inverse=True)
    which, owner = which.reshape(-1), np.repeat(np.arange(len(surfaces)), sizes)
    first, last = np.full(len(which), len(surfaces)), np.full(len(which), -1)
    np.minimum.at(first, which, owner)
    np.maximum.at(last, which, owner)
    return np.split((first != last)[which], np.cumsum(sizes)[:-1])


def _left(surface: Any, seam: Any) -> Any:
    return surface.extract_cells(np.flatnonzero(~seam)).extract_surface(algorithm="dataset_surface")


def bulk(grid: Any, picture: Picture) -> Array:
    """Returns the lowest and highest coordinates (3, 2), m, of the visible part of a ``prepared`` frame without
    debris.
    """
    parts = np.asarray(grid["part"])
    seen = np.isin(parts, picture.focus) if picture.focus else ~np.isin(parts, picture.hidden)
    return extent(grid, seen & (np.asarray(grid["far"]) == 0))


def extent(grid: Any, cells: Any) -> Array:
    """Returns the lowest and highest coordinates (3, 2), m, of the corners of the cells in the mask ``cells`` (n,);
    of all cells if the mask is nowhere True. Points without cells are ignored, because a frame also contains nodes
    that have left the body.
    """
    chosen = np.repeat(cells if cells.any() else np.ones(grid.n_cells, bool), np.diff(grid.offset))
    corners = np.asarray(grid.points, float)[np.asarray(grid.cell_connectivity)[chosen]]
    return np.stack([corners.min(axis=0), corners.max(axis=0)], axis=1)


def require_sections(picture: Picture, bounds: Array) -> None:
    """Raises LookError for a section that lies outside of the bodies in every frame. ``bounds``: coordinates
    (frames, 3, 2), m.
    """
    for plane in picture.sections:
        low, high = bounds[:, plane.axis, 0].min(), bounds[:, plane.axis, 1].max()
        for mirror in picture.mirrors:
            if mirror.axis == plane.axis:
                low, high = min(low, 2.0 * mirror.place - high), max(high, 2.0 * mirror.place - low)
        if not low <= plane.place <= high:
            raise _beyond("xyz"[plane.axis], plane.place, low, high)


def _nothing(grid: Any, picture: Picture) -> LookError:
    if not picture.sections:
        return LookError("hide: all parts are hidden")
    plane = picture.sections[0]
    low, high = extent(grid, np.ones(grid.n_cells, bool))[plane.axis]
    return _beyond("xyz"[plane.axis], plane.place, low, high)


def _beyond(axis: str, at: float, low: float, high: float) -> LookError:
    first, last = exacts((low, high), "", 4)
    return LookError(f"section = {axis}={number(at)}: the body is between {axis}={first} and {axis}={last} (in m)")


# The field ------------------------------------------------------------------------------------------------------------


def values(mesh: Any, name: str) -> tuple[Array, bool]:
    """Returns the field in the unit of pictures, and True if the values belong to points. Raises ViewError if the
    frame does not have the field.
    """
    field = FIELDS[name]
    array = field.array or name
    of_points = array in mesh.point_data
    data = mesh.point_data if of_points else mesh.cell_data
    if array not in data:
        raise ViewError(f"the frame has no field {array!r}; it has: {', '.join(data.keys()) or 'none'}")
    found = np.asarray(data[array])
    if found.ndim == 2:
        found = np.linalg.norm(found, axis=1) if field.component is None else found[:, field.component]
    return (found if field.kind in NAMED else found * field.factor), of_points


def prepared(mesh: Any, picture: Picture) -> Any:
    """Returns the mesh with only the arrays ``shown``, ``part``, ``fragment``, ``far`` and, if arrows are drawn,
    ``vector``. Raises ViewError for a missing field.
    """
    bare = vtk.bare(mesh)
    found, of_points = values(mesh, picture.field)
    (bare.point_data if of_points else bare.cell_data)["shown"] = found
    nothing = np.zeros(mesh.n_cells, np.int64)
    for name in ("part", "fragment"):
        bare.cell_data[name] = np.asarray(mesh.cell_data.get(name, nothing), np.int64)
    bare.cell_data["far"] = _far(bare)
    if vectors := picture.look.vectors:
        if vectors not in mesh.point_data:
            raise ViewError(f"the frame has no field {vectors} to draw as vectors")
        bare.point_data["vector"] = np.asarray(mesh.point_data[vectors], float)
    return bare


def _part(grid: Any, part: int, picture: Picture) -> Any:
    """Returns the tets of one part. The field has one value for each tet, or means at the nodes; the mean at a node
    may include tets of other parts.
    """
    own = grid.extract_cells(np.flatnonzero(grid["part"] == part))
    cells = picture.look.raw or FIELDS[picture.field].kind in NAMED
    if "shown" in own.point_data and cells:
        own.cell_data["shown"] = own.point_data_to_cell_data().cell_data["shown"]
        del own.point_data["shown"]
    elif "shown" in own.cell_data and not cells:
        own.point_data["shown"] = own.cell_data_to_point_data().point_data["shown"]
        del own.cell_data["shown"]
    return own


def _far(grid: Any) -> Any:
    """Returns a mask (cells,) that is True for tets far from the bulk of their part."""
    tets = grid.cells.reshape(-1, 5)[:, 1:] if len(grid.cells) == 5 * grid.n_cells else None
    if tets is None:
        return np.zeros(grid.n_cells, np.uint8)
    corners = np.asarray(grid.points)[tets]
    centre = corners.mean(axis=1)
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    far = np.zeros(grid.n_cells, np.uint8)
    for part in np.unique(grid["part"]):
        own = np.flatnonzero(grid["part"] == part)
        for axis in range(3):
            low, high = _bulk(centre[own, axis], volume[own])
            far[own[(centre[own, axis] < low) | (centre[own, axis] > high)]] = 1
    return far


def _bulk(places: Array, weights: Array) -> tuple[float, float]:
    order = np.argsort(places)
    shares = np.cumsum(weights[order]) / max(weights.sum(), 1e-300)
    low, high = places[order][np.minimum(np.searchsorted(shares, (_DEBRIS, 1.0 - _DEBRIS)), len(places) - 1)]
    return float(low - _ASIDE * (high - low)), float(high + _ASIDE * (high - low))


# Sections and mirrors -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Section:
    """A cut that removes one side of ``plane``: the side above it on its axis, or the side below it."""

    plane: Mirror
    below: bool

    def reflected(self, mirror: Mirror) -> "Section":
        """Returns the cut of the body whose mirror image is this cut."""
        if mirror.axis != self.plane.axis:
            return self
        return replace(self, plane=Mirror(mirror.axis, 2.0 * mirror.place - self.plane.place), below=not self.below)


def _surface(part: Any, picture: Picture, sections: Sequence[Section]) -> Any | None:
    """Returns the outer faces of a part and of its mirror images after all cuts; None if no faces are left."""
    length, images = float(part.length), []
    made: dict[tuple[Section, ...], Any] = {}
    for mirrors in _chosen(picture.mirrors):
        own = tuple(_before(section, mirrors) for section in sections)
        if own not in made:
            inner = [one for one in picture.mirrors if not any(_same(one, cut.plane, length) for cut in sections)]
            made[own] = _faces(_clipped(part, own), inner, length)
        if made[own].n_cells:
            images.append(_reflected(made[own], mirrors, picture.field))
    return (vtk.joined(images) if picture.mirrors else images[0]) if images else None


def _same(one: Mirror, other: Mirror, length: float) -> bool:
    return one.axis == other.axis and abs(one.place - other.place) < _ONE * length


def _chosen(mirrors: Sequence[Mirror]) -> Iterator[list[Mirror]]:
    """Yields all combinations of mirrors; the first combination has no mirror and stands for the body itself."""
    for flips in itertools.product((False, True), repeat=len(mirrors)):
        yield [mirror for mirror, flip in zip(mirrors, flips, strict=True) if flip]


def _before(section: Section, mirrors: Sequence[Mirror]) -> Section:
    for mirror in mirrors:
        section = section.reflected(mirror)
    return section


def _clipped(mesh: Any, sections: Sequence[Section]) -> Any:
    for section in sections:
        side, shift = (1.0 if section.below else -1.0), 0.2 * _ONE * mesh.length  # No node lies in the shifted plane.
        normal, origin = np.zeros(3), np.zeros(3)
        normal[section.plane.axis], origin[section.plane.axis] = side, section.plane.place + side * shift
        if mesh.n_cells:
            left = mesh.clip(normal=normal, origin=origin)
            thick = np.ptp(np.reshape(left.bounds, (3, 2))[section.plane.axis]) > _ONE * mesh.length
            mesh = left if thick else left.extract_cells([])  # A cut along the surface would leave tets without volume.
    return mesh


def _faces(mesh: Any, mirrors: Sequence[Mirror], length: float) -> Any:
    """Returns the outer faces of a mesh without the faces that lie in a mirror plane."""
    surface = mesh.extract_surface(algorithm="dataset_surface")
    if not mirrors or not surface.n_cells:
        return surface
    surface = surface.triangulate()  # A section leaves faces with three to six corners.
    outer = np.ones(surface.n_cells, bool)
    for mirror in mirrors:
        near = np.abs(np.asarray(surface.points)[:, mirror.axis] - mirror.place) < _ONE * length
        outer &= ~near[surface.regular_faces].all(axis=1)
    return surface.extract_cells(np.flatnonzero(outer))


def _reflected(surface: Any, mirrors: Sequence[Mirror], field: str) -> Any:
    """Returns the mirror image of a surface across all planes in ``mirrors``."""
    image = surface.copy() if mirrors else surface
    for mirror in mirrors:
        image.points[:, mirror.axis] = 2.0 * mirror.place - image.points[:, mirror.axis]
        if "vector" in image.point_data:
            image.point_data["vector"][:, mirror.axis] *= -1.0
        if FIELDS[field].turns(mirror.axis):
            data = image.point_data if "shown" in image.point_data else image.cell_data
            data["shown"] = -np.asarray(data["shown"])
    return image
