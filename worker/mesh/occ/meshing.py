"""Meshing of a drawn model whose element sizes are set. gmsh makes the tets. Then the nodes are moved to increase the
smallest step lengths.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import MeshError
from ..gmsh_session import named_mesh
from ..model import REGULAR_STEP, Names, TetMesh
from ..smooth import smoothed
from .frame import Frame
from .sliding import Cut, Sliding

WANTED = 0.75
"""Step length, as a share of the step length of a regular tet with edge ``element_size``, below which step lengths
are raised where possible."""
_CHORD = 0.25
"""Largest mean distance of flat faces from a round surface, over the element size: faces of edges e are e^2 / (8 r)
from a sphere of radius r on average, e / 8 where e = r."""
_OTHERS = ({"Mesh.Algorithm3D": 1}, {"Mesh.Algorithm3D": 1, "Mesh.Algorithm": 1})
"""Further attempts if gmsh fails: first its Delaunay mesher in place of HXT, then also triangles by MeshAdapt."""


def meshed(gmsh: Any, frame: Frame, element_size: float, cuts: Sequence[Cut]) -> TetMesh:
    """Return the tets of the current model, m, in space. The model is cut on the planes ``cuts`` of the frame."""
    return with_names(gmsh, frame, element_size, cuts)[0]


def with_names(gmsh: Any, frame: Frame, element_size: float, cuts: Sequence[Cut]) -> tuple[TetMesh, Names]:
    """Return the tets of the current model, and gmsh's numbers of its nodes and tets."""
    _generate(gmsh)
    found = named_mesh(gmsh)
    mesh = found.mesh
    if mesh.volumes().sum() < 0:
        mesh = TetMesh(mesh.points, mesh.tets[:, [0, 2, 1, 3]])
    sliding, points = Sliding.of(gmsh, np.asarray(found.names.nodes), mesh.points, cuts)
    wanted = WANTED * REGULAR_STEP * frame.length(element_size)
    mesh = smoothed(TetMesh(points, mesh.tets), sliding, wanted)
    return TetMesh(frame.to_space(mesh.points), mesh.tets), found.names


def _generate(gmsh: Any) -> None:
    """Make tets in every volume, by another of gmsh's meshers if one fails. Raises MeshError if all fail."""
    problem = "gmsh leaves a volume without tets; is the surface of it damaged, or element_size too large?"
    for n, options in enumerate(({}, *_OTHERS)):
        for name, value in options.items():
            gmsh.option.setNumber(name, value)
        try:
            gmsh.model.mesh.generate(3)
        except Exception:
            if n == len(_OTHERS):
                raise
        else:
            if all(len(gmsh.model.mesh.getElements(*volume)[0]) for volume in gmsh.model.getEntities(3)):
                if not (off := _off(gmsh)):
                    return
                problem = off
        gmsh.model.mesh.clear()
    raise MeshError(problem)


def _off(gmsh: Any) -> str:
    """Return a message if the tets do not have the volume of the model, within what flat faces can change; else "".

    gmsh meshes some closed surfaces inside out or only in part, without an error.
    """
    occ, volumes, filled = gmsh.model.occ, gmsh.model.getEntities(3), 0.0
    try:
        whole = sum(occ.getMass(*each) for each in volumes)
        skin = sum(occ.getMass(*each) for each in gmsh.model.getBoundary(volumes, oriented=False))
    except Exception:  # a volume inside of triangles, of which OpenCASCADE has no surface
        return ""
    for volume in volumes:
        for tags in gmsh.model.mesh.getElements(*volume)[1]:
            filled += float(np.abs(gmsh.model.mesh.getElementQualities(tags, "volume")).sum())
    if abs(filled - whole) <= _CHORD * skin * gmsh.option.getNumber("Mesh.MeshSizeMax"):
        return ""
    return f"gmsh's mesh has {filled / whole:.3g} of the volume of the body; try another element_size"
