"""Loads of tractions on the faces of the meshes, and nodes of prescribed velocities."""

import numpy as np

from conoid.cases.model import schema

from ..bonds.pieces import Pieces
from ..boundaries import surface_pressure
from ..errors import InputError
from ..mesh.faces import FACES, across, normals
from ..model.loads import Load, LoadedFaces
from ..model.state import Floats, Indices, Ints
from . import selection
from .marks import Marks
from .selection import Members, Nearness, Selected


def loads(
    case: schema.Case,
    x: Floats,
    members: Members,
    of_tets: tuple[Indices, Indices],
    near: Nearness,
    known: list[bool],
    marked: Marks,
    tied: Pieces,
) -> tuple[list[Load | LoadedFaces], list[Selected], list[str]]:
    """Return three things: the loads of the tractions of a case, the faces that each traction selects, and warnings.

    A traction gives a third of the force on each face to each node of the face, in the order of the tets. A pressure
    that follows the surface stores the faces instead of the forces. ``of_tets``: (m, 4) tets, and (m,) their parts. A
    traction whose flag ``known`` is False gets no face. Raises InputError for another traction that selects no face.
    """
    tractions = case.boundaries_of(schema.Traction)
    loads, found, warnings = list[Load | LoadedFaces](), list[Selected](), list[str]()
    tets, tet_part = of_tets
    tet, face = np.nonzero(across(tets) < 0) if tractions else (np.zeros(0, np.int64), np.zeros(0, np.int64))
    faces = tets[tet[:, None], FACES[face]]
    for index, spec in tractions:
        if not known[index]:
            none = np.zeros(0, np.int64)
            loads.append(_load(spec, none, np.zeros((0, 3), np.int64), np.zeros((0, 3))))
            continue
        selected, chosen = selection.counted(case, index, x, members, (faces, tet_part[tet]), near, marked)
        loaded = faces[chosen]
        if not len(loaded):
            where = "its box and its parts" if spec.cylinder is None else "its cylinder, its box and its parts"
            where = where if spec.on is None else f"whether the faces of {spec.on!r} are on the surface, and its box"
            cut = "; faces on a plane of symmetry carry no load" if case.boundaries_of(schema.Symmetry) else ""
            raise InputError(f"boundaries[{index}]: acts on no face; check {where}{cut}")
        found.append(selected)
        took = np.isin(np.arange(len(case.parts)), tet_part[tet[chosen]])
        warnings += selection.missed(case, index, x, members, near, took)
        warnings += _bonded(index, 4 * tet[chosen].astype(np.int64) + face[chosen], tied)
        loads.append(_load(spec, tet[chosen].astype(np.int64), loaded.astype(np.int64), 0.5 * normals(x, loaded)))
    return loads, found, warnings


def _bonded(index: int, faces: Ints, tied: Pieces) -> list[str]:
    """Return a warning for a traction that loads bonded interfaces. An interface is not a free surface. ``faces``: (m,)
    numbers of the loaded faces, 4 * tet + local face.
    """
    areas = tied.weights.sum(axis=1)
    area = float(areas[np.isin(tied.slave, faces)].sum() + areas[np.isin(tied.master, faces)].sum())
    if not area > 0.0:
        return []
    return [
        f"boundaries[{index}]: {1e6 * area:.6g} mm^2 of its faces are bonded to another part and carry the load, too; "
        "leave them out by its box, its cylinder or its parts"
    ]


def _load(spec: schema.Traction, tets: Ints, faces: Ints, outward: Floats) -> Load | LoadedFaces:
    """Return the load of a traction on ``faces`` (m, 3) of ``tets`` (m,) with area vectors ``outward`` (m, 3), m^2."""
    if spec.follows:
        return LoadedFaces(tets, faces, surface_pressure.scale(spec, outward))
    if spec.stress is not None:
        force = np.linalg.norm(outward, axis=1)[:, None] / 3.0 * np.array(spec.stress)
    else:
        force = -(spec.pressure or 0.0) / 3.0 * outward
    of = np.repeat(tets, 3)
    return Load(np.arange(len(of)), of, faces.reshape(-1), np.repeat(force, 3, axis=0))


def driven(
    case: schema.Case, x: Floats, members: Members, near: Nearness, known: list[bool], marked: Marks
) -> tuple[list[Selected], list[str]]:
    """Return the nodes that the prescribed velocities select, and warnings. Only velocities whose flag ``known`` is
    True are processed.
    """
    found, warnings = list[Selected](), list[str]()
    for index in (index for index, _ in case.boundaries_of(schema.Prescribed) if known[index]):
        selected, held = selection.counted(case, index, x, members, selection.NO_FACES, near, marked)
        found.append(selected)
        if held.any():
            took = np.isin(np.arange(len(case.parts)), members[1][held[members[0]]])
            warnings += selection.missed(case, index, x, members, near, took)
    return found, warnings
