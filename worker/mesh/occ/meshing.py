"""Meshing of a drawn model whose element sizes are set. First gmsh makes the tets. Then nodes are moved to increase the
smallest step lengths.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import MeshError
from ...model.hashing import splitmix64
from ..gmsh_session import named_mesh
from ..model import REGULAR_STEP, Ids, Names, TetMesh
from ..smooth import smoothed
from .frame import Frame
from .sliding import Cut, Sliding

WANTED = 0.75
"""Step length of a tet, divided by the step length of a regular tet with the edge ``element_size``. Smaller step
lengths are increased where possible."""
_CHORD = 0.25
"""Largest mean distance of flat faces from a round surface, divided by the element size. Faces with edges e are on
average e^2 / (8 r) from a sphere of radius r, which is e / 8 for e = r."""
_INTEGRATION = 0.02
"""Error of the volume of a body with spline surfaces that OpenCASCADE computes, relative: twice the largest error of 60
bodies made at random (see cad.py)."""
_TRIANGLE, _TET = 2, 4
"""Numbers of the triangle with 3 nodes and of the tet with 4 nodes in gmsh."""
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
    """Return a message if the tets of a volume do not fill its surface mesh, or if their volume differs from the volume
    of the model by more than flat faces and the integration of OpenCASCADE can explain; else return an empty text.

    The tests are needed because gmsh meshes some closed surfaces inside out or only in part, without an error.
    """
    occ, volumes, filled = gmsh.model.occ, gmsh.model.getEntities(3), 0.0
    if not all(_fills(gmsh, volume) for volume in volumes):
        return "gmsh's mesh does not fill the surface of the body; try another element_size"
    try:
        whole = sum(occ.getMass(*each) for each in volumes)
        skin = sum(occ.getMass(*each) for each in gmsh.model.getBoundary(volumes, oriented=False))
    except Exception:  # a volume bounded by triangles: OpenCASCADE has no surface for it
        return ""
    for volume in volumes:
        for tags in gmsh.model.mesh.getElements(*volume)[1]:
            filled += float(np.abs(gmsh.model.mesh.getElementQualities(tags, "volume")).sum())
    if abs(filled - whole) <= _CHORD * skin * gmsh.option.getNumber("Mesh.MeshSizeMax") + _INTEGRATION * whole:
        return ""
    return f"gmsh's mesh has {filled / whole:.3g} of the volume of the body; try another element_size"


def _fills(gmsh: Any, volume: tuple[int, int]) -> bool:
    """Return whether the faces that only one tet of a volume has are the triangles of its surface.

    A face has a hash that does not depend on the order of its nodes. Of a face with two tets the hashes cancel in the
    exclusive or.
    """
    of_tets, of_surface = np.uint64(0), np.uint64(0)
    for tags in gmsh.model.mesh.getElementsByType(_TET, volume[1])[1:]:
        tets = tags.reshape(-1, 4)
        for face in ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2)):
            of_tets ^= np.bitwise_xor.reduce(_hashes(tets[:, face]))
    for _, surface in gmsh.model.getBoundary([volume], oriented=False):
        triangles = gmsh.model.mesh.getElementsByType(_TRIANGLE, surface)[1].reshape(-1, 3)
        of_surface ^= np.bitwise_xor.reduce(_hashes(triangles))
    return bool(of_tets == of_surface)


def _hashes(faces: Ids) -> "np.ndarray[Any, np.dtype[np.uint64]]":
    """Return a hash of each face (n, 3)."""
    return splitmix64(splitmix64(faces, 0).sum(axis=1, dtype=np.uint64), 0)
