"""Shapes meshed together, so that parts that touch have the nodes of their interface in common. In the child process.

OpenCASCADE cuts the shapes with each other (fragments): a face of two shapes is one face, and has one mesh. Each part
has its element size in its own volume, the smaller one at the interface.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from conoid.cases.bodies import Symmetric
from conoid.cases.geometry import AXES, Generated, bounds, centre, index

from ..errors import MeshError
from .frame import refuse_impossible
from .gmsh_session import OPTIONS, session
from .model import Ids, Origin, TetMesh
from .named import gathered
from .occ.sizes import GMSH_SIZE
from .unstructured import draw

_TET = 4
"""gmsh's element type of the 4-node tet."""
_TURN = 2.0 * math.pi / 3.0
"""About the line x = y = z: x becomes y, y becomes z, z becomes x."""

Entities = list[tuple[int, int]]
"""gmsh's dimension and tag of some volumes."""


def together(bodies: Sequence[Generated], key: str, name: str) -> list[TetMesh]:
    """The meshes of ``bodies``, of nodes of one numbering: ``name`` stands for the file that they come from. MeshError,
    naming ``key``, when gmsh cannot make them.
    """
    for body in bodies:
        refuse_impossible(body, key)
    corners = np.array([bounds(body) for body in bodies])
    scale = math.ldexp(1.0, math.frexp(float(np.ptp(corners.reshape(-1, 3), axis=0).max()))[1])
    with session(OPTIONS) as gmsh:
        drawn = [_drawn(gmsh, body, scale) for body in bodies]
        volumes = _fragments(gmsh.model.occ, drawn, key)
        gmsh.model.occ.synchronize()
        _sizes(gmsh, bodies, volumes, scale)
        gmsh.model.mesh.generate(3)
        return [_mesh(gmsh, tags, scale, name) for tags in volumes]


def _drawn(gmsh: Any, body: Generated, scale: float) -> Entities:
    """The volumes of a body where it lies in space, lengths over ``scale``."""
    occ = gmsh.model.occ
    before = set(occ.getEntities(3))
    draw(gmsh, body.model_copy(update={"aligned": False}) if isinstance(body, Symmetric) else body, scale)
    made = [each for each in occ.getEntities(3) if each not in before]
    turns = {"z": 0, "x": 1, "y": 2}[body.axis]
    if turns:
        occ.rotate(made, 0, 0, 0, 1, 1, 1, turns * _TURN)
    occ.translate(made, *(c / scale for c in centre(body)))
    return made


def _fragments(occ: Any, drawn: list[Entities], key: str) -> list[list[int]]:
    """Tags of the volumes of each body, cut so that they have faces in common. Raises MeshError where two overlap."""
    every = [(of, each) for of, made in enumerate(drawn) for each in made]
    entities = [each for _, each in every]
    _, became = occ.fragment(entities[:1], entities[1:])
    owner: dict[int, int] = {}
    for (of, _), pieces in zip(every, became, strict=True):
        for _, tag in pieces:
            if owner.setdefault(tag, of) != of:
                raise MeshError(f"{key}: shapes that a bond joins overlap; they may touch only")
    return [[tag for tag, of in owner.items() if of == body] for body in range(len(drawn))]


def _sizes(gmsh: Any, bodies: Sequence[Generated], volumes: list[list[int]], scale: float) -> None:
    """The element size of each body in its volumes."""
    field, own = gmsh.model.mesh.field, []
    largest = max(GMSH_SIZE * _largest(body) / scale for body in bodies)
    for body, tags in zip(bodies, volumes, strict=True):
        inside = field.add("Restrict")
        field.setNumber(inside, "InField", _size(field, body, scale))
        field.setNumbers(inside, "VolumesList", tags)
        own.append(inside)
    least = field.add("Min")
    field.setNumbers(least, "FieldsList", own)
    field.setAsBackgroundMesh(least)
    gmsh.option.setNumber("Mesh.MeshSizeMin", min(GMSH_SIZE * body.element_size / scale for body in bodies))
    gmsh.option.setNumber("Mesh.MeshSizeMax", largest)


def _largest(body: Generated) -> float:
    return body.element_size if body.grading is None else max(body.element_size, body.grading.far_size)


def _size(field: Any, body: Generated, scale: float) -> int:
    """The tag of the field of a body's element size: one number, or by its grading."""
    size, grading = field.add("MathEval"), body.grading
    if grading is None:
        field.setString(size, "F", repr(GMSH_SIZE * body.element_size / scale))
        return int(size)
    along = None if grading.axis is None else index(grading.axis)
    squares = [f"({AXES[i]}-({grading.origin[i] / scale!r}))^2" for i in range(3) if i != along]
    field.setString(size, "F", f"Abs(Sqrt({'+'.join(squares)})-{grading.radius / scale!r})")
    graded = field.add("Threshold")
    values = ("DistMin", grading.near), ("DistMax", grading.far)
    sizes = ("SizeMin", GMSH_SIZE * body.element_size), ("SizeMax", GMSH_SIZE * grading.far_size)
    for name, value in (*values, *sizes):
        field.setNumber(graded, name, value / scale)
    field.setNumber(graded, "InField", size)
    return int(graded)


def _mesh(gmsh: Any, tags: list[int], scale: float, name: str) -> TetMesh:
    """The tets of some volumes."""
    ids, corners = list[Ids](), list[Ids]()
    for tag in tags:
        kinds, elements, nodes = gmsh.model.mesh.getElements(3, tag)
        at = list(kinds).index(_TET)
        ids.append(np.asarray(elements[at], np.int64))
        corners.append(np.asarray(nodes[at], np.int64).reshape(-1, 4))
    node_tags, coordinates, _ = gmsh.model.mesh.getNodes()
    every, points = np.asarray(node_tags, np.int64), scale * coordinates.reshape(-1, 3)
    found = gathered(every, points, np.concatenate(ids), np.concatenate(corners))
    mesh = TetMesh(found.mesh.points, found.mesh.tets, Origin(name, found.places))
    if mesh.volumes().sum() < 0:
        mesh = TetMesh(mesh.points, mesh.tets[:, [0, 2, 1, 3]], mesh.origin)
    return mesh
