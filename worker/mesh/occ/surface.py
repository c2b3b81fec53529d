"""Conversion of a closed surface of triangles into a gmsh model. The model has faces between the sharp edges of the
surface, and the volumes inside of it.
"""

import math
from typing import Any

import numpy as np

from .shells import Surface, nested

_TRIANGLE = 2
"""Number by which gmsh identifies the 3-node triangle."""


def enclose(gmsh: Any, surface: Surface, factor: float, edge_angle: float) -> None:
    """Add a surface to the current model. Its lengths are multiplied by ``factor``.

    The surface is cut at edges sharper than ``edge_angle``, rad, into smooth faces that gmsh can parametrise. The model
    gets one volume inside of each outer shell.
    """
    tags = np.arange(1, len(surface.points) + 1)
    gmsh.model.addDiscreteEntity(2, 1)
    gmsh.model.mesh.addNodes(2, 1, tags, (surface.points * factor).ravel())
    gmsh.model.mesh.addElementsByType(1, _TRIANGLE, [], (surface.faces + 1).ravel())
    gmsh.model.mesh.classifySurfaces(edge_angle, True, True, math.pi)
    gmsh.model.mesh.createGeometry()
    shells: dict[int, list[int]] = {}
    for _, tag in gmsh.model.getEntities(2):
        node = int(gmsh.model.mesh.getElementsByType(_TRIANGLE, tag)[1][0])
        shells.setdefault(int(surface.shell[node - 1]), []).append(tag)
    loops = {shell: gmsh.model.geo.addSurfaceLoop(faces) for shell, faces in shells.items()}
    for within in nested(surface):
        gmsh.model.geo.addVolume([loops[shell] for shell in within])
    gmsh.model.geo.synchronize()
