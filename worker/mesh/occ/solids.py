"""Meshes of combinations of shapes, solids of CAD files and closed surfaces."""

import hashlib
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from conoid.cases.model.grading import Grading
from conoid.cases.model.solids import Cad, Combination, Measured, Meshed, Solid, Stl
from conoid.cases.shapes.combined import cut_by

from ...errors import MeshError
from ..gmsh_session import OPTIONS, session
from ..model import MAX_TETS, Origin, TetMesh
from ..sources import Sources
from .cad import left_out
from .combine import Drawing, extent
from .draw import Solids
from .features import small_features
from .frame import Frame, scale_of
from .hinges import hinges
from .meshing import meshed
from .sizes import set_size
from .stl import read_stl
from .surface import enclose

T = TypeVar("T")
_BY_GMSH = "gmsh"
"""Beginning of messages about the mesher. Messages about a file begin with the key of the mesh."""
_TETS_PER_CUBE = 6.0
"""Number of tets that gmsh makes in a cube with the edge element_size."""


@dataclass(frozen=True)
class _Made:
    mesh: TetMesh
    notes: list[str]


def measured(mesh: Measured, sources: Sources, key: str) -> TetMesh:
    """Return the mesh of a body whose size is computed from its geometry. Raises MeshError, whose message contains
    ``key``.
    """
    if isinstance(mesh, Stl):
        made = _of_surface(mesh, sources, key)
    elif isinstance(mesh, Cad | Combination):
        made = with_surfaces(lambda exact: _meshed(mesh, sources, key, exact=exact), [mesh])
    else:
        raise MeshError(f"{key}: gmsh cannot draw a body of this kind")
    points = made.mesh.points
    name = hashlib.sha256(points.tobytes() + made.mesh.tets.tobytes()).hexdigest()
    return replace(made.mesh, origin=Origin(name, np.arange(len(points), dtype=np.int64), tuple(made.notes)))


def with_surfaces(make: Callable[[bool], T], bodies: Iterable[object]) -> T:
    """Return ``make(False)``. gmsh may fail to mesh the splines that it has made from the surfaces of a CAD body among
    the ``bodies``. If gmsh fails, return ``make(True)``, which keeps these surfaces.
    """
    try:
        return make(False)
    except MeshError as error:
        if not str(error).startswith(_BY_GMSH) or not any(isinstance(each, Cad) for each in bodies):
            raise
    return make(True)


def _meshed(mesh: Cad | Combination, sources: Sources, key: str, *, exact: bool) -> _Made:
    with session(OPTIONS) as gmsh:
        frame = Frame(mesh.centre, mesh.axis, scale_of(extent(gmsh, mesh, sources, key)))
        solids = draw_solid(gmsh, mesh, frame, sources, key, exact=exact)
        notes = [
            *left_out(mesh, sources, key),
            *small_features(gmsh, mesh.element_size, frame, solids),
            *hinges(gmsh, solids),
        ]
        cuts = [(k, 0.0) for k in range(len(cut_by(mesh.sector, mesh.axis)))]
        set_size(gmsh, mesh.element_size, mesh.grading, frame, cuts)
        made = meshed(gmsh, frame, mesh.element_size, cuts)
    return _Made(made, [f"{key}: {note}" for note in notes])


def draw_solid(
    gmsh: Any, mesh: Cad | Combination, frame: Frame, sources: Sources, key: str, *, exact: bool = False
) -> Solids:  # fmt: skip
    """Draw a body in the coordinates ``frame`` of the model; the origin and the axis of ``frame`` are the centre and
    the axis of the body. Return the volumes of its sector.

    Solids that touch get common faces. ``exact``: see ``cad.imported``. Raises MeshError if no solid is left, or if the
    mesh would have too many tets.
    """
    occ = gmsh.model.occ
    solids = joined(occ, sector(occ, Drawing(gmsh, frame, sources, exact).solids(mesh, key), mesh), key)
    if not solids:
        raise MeshError(f"{key}: the body is empty; check sizes and places of its shapes")
    occ.synchronize()
    _refuse_too_many(gmsh, solids, mesh, frame, key)
    return solids


def _of_surface(mesh: Stl, sources: Sources, key: str) -> _Made:
    surface = read_stl(sources[key], f"{key}.path = {mesh.path!r}")
    low, high = surface.points.min(axis=0) * mesh.unit, surface.points.max(axis=0) * mesh.unit
    frame = Frame((0.0, 0.0, 0.0), "z", scale_of(float((high - low).max())))
    _refuse_volume(surface.volume() * mesh.unit**3, mesh.element_size, mesh.grading, key)
    with session(OPTIONS) as gmsh:
        enclose(gmsh, surface, mesh.unit / frame.scale, mesh.edge_angle)
        set_size(gmsh, mesh.element_size, mesh.grading, frame)
        made = meshed(gmsh, frame, mesh.element_size, ())
    return _Made(made, [])


def sector(occ: Any, solids: Solids, mesh: Solid) -> Solids:
    """Return the sector of a solid: the part on the positive sides of the cut planes."""
    cuts = cut_by(mesh.sector, mesh.axis)
    if not cuts or not solids:
        return solids
    boxes = [occ.getBoundingBox(*each) for each in solids]
    reach = 2.0 * max(abs(x) for box in boxes for x in box) + 1.0
    low = [0.0 if d < len(cuts) else -reach for d in range(3)]
    side = [(3, occ.addBox(*low, *(reach - x for x in low)))]
    kept: Solids = occ.intersect(solids, side)[0]
    return kept


def joined(occ: Any, solids: Solids, key: str) -> Solids:
    """Return solids with common faces where they touch, so that their meshes have common nodes at these faces.

    Raises MeshError if a solid is inside of another solid.
    """
    if len(solids) < 2:
        return solids
    whole = sum(occ.getMass(*each) for each in solids)
    made, sources = occ.fragment(solids, [])
    pieces = Counter(piece for source in sources for piece in source if piece[0] == 3)
    twice = sum((count - 1) * occ.getMass(*piece) for piece, count in pieces.items() if count > 1)
    if twice > 1e-6 * whole:
        raise MeshError(f"{key}: its solids overlap each other: {twice / whole:.2g} of their volume counts twice")
    return [each for each in made if each[0] == 3]


def _refuse_too_many(gmsh: Any, solids: Solids, mesh: Meshed, frame: Frame, key: str) -> None:
    volume = sum(gmsh.model.occ.getMass(*each) for each in solids) * frame.scale**3
    _refuse_volume(volume, mesh.element_size, mesh.grading, key)


def _refuse_volume(volume: float, size: float, grading: Grading | None, key: str) -> None:
    tets = _TETS_PER_CUBE * volume / size**3
    if grading is None and tets > MAX_TETS:
        raise MeshError(f"{key}.element_size = {size:g} m: about {tets:.2g} tets; at most {MAX_TETS:,} are allowed")
    if not volume > 0.0:
        raise MeshError(f"{key}: the body has no volume")
