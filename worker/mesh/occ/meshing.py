"""Meshing of a drawn model whose element sizes are set. First gmsh makes the tets. Then nodes are moved to increase the
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
"""Step length of a tet, divided by the step length of a regular tet with the edge ``element_size``. Smaller step
lengths are increased where possible."""
_CHORD = 0.25
"""Largest mean distance of flat faces from a round surface, divided by the element size. Faces with edges e are on
average e^2 / (8 r) from a sphere of radius r, which is e / 8 for e = r."""
_OTHERS = ({"Mesh.Algorithm3D": 1}, {"Mesh.Algorithm3D": 1, "Mesh.Algorithm": 1})
"""Further meshers that are used if gmsh fails: first the Delaunay mesher in place of HXT, then the Delaunay mesher with
triangles by MeshAdapt."""


def meshed(gmsh: Any, frame: Frame, element_size: float, cuts: Sequence[Cut]) -> TetMesh:
    """Return the tets of the current model, with points in space, m. ``cuts``: planes of the frame on which the model
    is cut.
    """
    return with_names(gmsh, frame, element_size, cuts)[0]


def with_names(gmsh: Any, frame: Frame, element_size: float, cuts: Sequence[Cut]) -> tuple[TetMesh, Names]:
    """Return the tets of the current model, and the numbers that gmsh gives to nodes and tets."""
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
    """Make tets in every volume. If one mesher of gmsh fails, another one is used. Raises MeshError if all meshers
    fail.
    """
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
    """Return a message if the volume of the tets differs from the volume of the model by more than flat faces can
    explain; else return an empty text.

    The test of the volume is needed because gmsh meshes some closed surfaces inside out or only in part, without an
    error.
    """
    occ, volumes, filled = gmsh.model.occ, gmsh.model.getEntities(3), 0.0
    try:
        whole = sum(occ.getMass(*each) for each in volumes)
        skin = sum(occ.getMass(*each) for each in gmsh.model.getBoundary(volumes, oriented=False))
    except Exception:  # a volume bounded by triangles: OpenCASCADE has no surface for it
        return ""
    for volume in volumes:
        for tags in gmsh.model.mesh.getElements(*volume)[1]:
            filled += float(np.abs(gmsh.model.mesh.getElementQualities(tags, "volume")).sum())
    if abs(filled - whole) <= _CHORD * skin * gmsh.option.getNumber("Mesh.MeshSizeMax"):
        return ""
    return f"gmsh's mesh has {filled / whole:.3g} of the volume of the body; try another element_size"
