"""Meshing of several bodies together, with common nodes at their interfaces. The module runs in the child process.

OpenCASCADE cuts the bodies with each other (fragments), so that two touching bodies have one common face with one mesh.
Each part has its own element size; the smaller of two sizes is used at an interface.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from conoid.cases.model.bodies import RingSector, Symmetric
from conoid.cases.model.solids import Cad, Combination
from conoid.cases.shapes.combined import cut_by
from conoid.cases.shapes.geometry import Generated, bounds, centre, cut_directions
from conoid.cases.shapes.profile import Revolved

from ..errors import MeshError
from .frame import refuse_impossible
from .gmsh_session import OPTIONS, session
from .model import Names, Origin, TetMesh
from .occ import body as primitives
from .occ.cad import left_out
from .occ.combine import extent
from .occ.draw import Solids
from .occ.features import small_features
from .occ.frame import Frame, scale_of
from .occ.meshing import with_names
from .occ.sizes import GMSH_SIZE, graded
from .occ.sliding import Cut
from .occ.solids import draw_solid, with_surfaces
from .sources import Sources
from .unstructured import draw

_TURN = 2.0 * math.pi / 3.0
"""Rotation about the line x = y = z: x becomes y, y becomes z, z becomes x."""

_Solid = Cad | Combination
Joint = Generated | _Solid
"""Types of bodies that several parts can be meshed from together."""


@dataclass(frozen=True)
class _Model:
    """Bodies drawn into the current model of ``gmsh``."""

    gmsh: Any
    bodies: Mapping[str, Joint]
    """Bodies; the keys are the keys of their meshes in the case."""
    frame: Frame
    """Frame of all bodies: the directions x, y, z from the origin."""
    volumes: Sequence[Sequence[int]]
    """Numbers of the volumes of each body."""


def together(bodies: Mapping[str, Joint], sources: Sources, name: str) -> list[TetMesh]:
    """Return the meshes of ``bodies``, as a dictionary with the keys of the meshes in the case. All meshes use one
    numbering of nodes.

    ``name``: file name that the origin of each mesh gets. Raises MeshError, whose message contains a key, if gmsh
    cannot make the meshes.
    """
    for key, body in bodies.items():
        if not isinstance(body, _Solid):
            refuse_impossible(body, key)
    return with_surfaces(lambda exact: _meshed(bodies, sources, name, exact=exact), bodies.values())


def _meshed(bodies: Mapping[str, Joint], sources: Sources, name: str, *, exact: bool) -> list[TetMesh]:
    with session(OPTIONS) as gmsh:
        frame = Frame((0.0, 0.0, 0.0), "z", _scale(gmsh, bodies, sources))
        drawn = [_drawn(gmsh, body, frame.scale, sources, key, exact) for key, body in bodies.items()]
        model = _Model(gmsh, bodies, frame, _fragments(gmsh.model.occ, drawn, list(bodies)))
        gmsh.model.occ.synchronize()
        _sizes(model)
        cuts = sorted({cut for body in bodies.values() for cut in _cuts(body, frame)})
        made, names = with_names(gmsh, frame, min(body.element_size for body in bodies.values()), cuts)
        return [_part(model, sources, made, names, k, name) for k in range(len(bodies))]


def _scale(gmsh: Any, bodies: Mapping[str, Joint], sources: Sources) -> float:
    """Return the approximate extent of all bodies, m. The extent is the unit of length of the model."""
    known = [corners for body in bodies.values() if not isinstance(body, _Solid) and (corners := bounds(body))]
    sizes = [extent(gmsh, body, sources, key) for key, body in bodies.items() if isinstance(body, _Solid)]
    return scale_of(max([*sizes, *np.ptp(np.array(known).reshape(-1, 3), axis=0).tolist()] if known else sizes))


def _drawn(gmsh: Any, body: Joint, scale: float, sources: Sources, key: str, exact: bool) -> Solids:
    """Draw a body in its position in space, with lengths divided by ``scale``. Return the volumes of the body."""
    occ, start = gmsh.model.occ, body.centre if isinstance(body, _Solid) else centre(body)
    before = set(occ.getEntities(3))
    if isinstance(body, _Solid):
        draw_solid(gmsh, body, Frame(start, body.axis, scale), sources, key, exact=exact)
    elif isinstance(body, Revolved | RingSector):
        primitives.draw(occ, body, Frame(start, body.axis, scale))
    else:
        draw(gmsh, body.model_copy(update={"aligned": False}) if isinstance(body, Symmetric) else body, scale)
    made = [each for each in occ.getEntities(3) if each not in before]
    turns = {"z": 0, "x": 1, "y": 2}[body.axis]
    if turns:
        occ.rotate(made, 0, 0, 0, 1, 1, 1, turns * _TURN)
    occ.translate(made, *(c / scale for c in start))
    return made


def _cuts(body: Joint, frame: Frame) -> list[Cut]:
    """Return the planes on which a body is cut, in the frame of all bodies."""
    start = body.centre if isinstance(body, _Solid) else centre(body)
    across = cut_by(body.sector, body.axis) if isinstance(body, _Solid) else cut_directions(body, body.axis)
    return [(d, start[d] / frame.scale) for d in across]


def _fragments(occ: Any, drawn: list[Solids], keys: list[str]) -> list[list[int]]:
    """Cut the volumes so that touching volumes have common faces. Return the numbers of the volumes of each body.

    Raises MeshError if two bodies overlap.
    """
    every = [(of, each) for of, made in enumerate(drawn) for each in made]
    entities = [each for _, each in every]
    _, became = occ.fragment(entities[:1], entities[1:])
    owner: dict[int, int] = {}
    for (of, _), pieces in zip(every, became, strict=True):
        for _, tag in pieces:
            if (first := owner.setdefault(tag, of)) != of:
                raise MeshError(f"{keys[of]}: overlaps {keys[first]}, to which a bond joins it; they may touch only")
    return [[tag for tag, of in owner.items() if of == body] for body in range(len(drawn))]


def _sizes(model: _Model) -> None:
    """Set the element size of each body in its volumes."""
    gmsh, frame = model.gmsh, model.frame
    field, own, sizes = gmsh.model.mesh.field, [], list[float]()
    for body, tags in zip(model.bodies.values(), model.volumes, strict=True):
        sizes += [body.element_size, body.element_size if body.grading is None else body.grading.far_size]
        inside = field.add("Restrict")
        field.setNumber(inside, "InField", _size(gmsh, body, frame, tags))
        field.setNumbers(inside, "VolumesList", tags)
        own.append(inside)
    least = field.add("Min")
    field.setNumbers(least, "FieldsList", own)
    field.setAsBackgroundMesh(least)
    for name, pick in (("Min", min), ("Max", max)):
        gmsh.option.setNumber(f"Mesh.MeshSize{name}", GMSH_SIZE * frame.length(pick(sizes)))


def _size(gmsh: Any, body: Joint, frame: Frame, volumes: Sequence[int]) -> int:
    """Return the number of the gmsh field with the element size of a body. The size is constant or a grading."""
    if body.grading is not None:
        return graded(gmsh, body.element_size, body.grading, frame, volumes, _cuts(body, frame))
    field = gmsh.model.mesh.field
    size = field.add("MathEval")
    field.setString(size, "F", repr(GMSH_SIZE * frame.length(body.element_size)))
    return int(size)


def _part(model: _Model, sources: Sources, made: TetMesh, names: Names, k: int, name: str) -> TetMesh:
    """Return the mesh of body ``k``, selected from the tets ``made`` of all bodies. ``names``: numbers that gmsh gives
    to nodes and tets.
    """
    elements = [model.gmsh.model.mesh.getElements(3, tag)[1] for tag in model.volumes[k]]
    own = np.concatenate([np.concatenate(each).astype(np.int64) for each in elements if len(each)])
    nodes, tets = np.unique(made.tets[np.isin(names.tets, own)], return_inverse=True)
    origin = Origin(name, nodes.astype(np.int64), tuple(_notes(model, sources, k)))
    return TetMesh(made.points[nodes], tets.reshape(-1, 4).astype(np.int32), origin)


def _notes(model: _Model, sources: Sources, k: int) -> list[str]:
    """Return notes about a body that is made of CAD files or is a combination."""
    key, body = list(model.bodies.items())[k]
    if not isinstance(body, _Solid):
        return []
    volumes = [(3, tag) for tag in model.volumes[k]]
    small = small_features(model.gmsh, body.element_size, model.frame, volumes)
    return [f"{key}: {note}" for note in (*left_out(body, sources, key), *small)]
