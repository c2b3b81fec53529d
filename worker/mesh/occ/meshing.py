"""From a drawn model, with its sizes set, to tets, whose nodes are moved from where they hold the time step down."""

from typing import Any

import numpy as np

from ..gmsh_session import named_mesh
from ..model import REGULAR_STEP, TetMesh
from ..smooth import smoothed
from .frame import Frame
from .sliding import Sliding

WANTED = 0.75
"""Step lengths below this share of a regular tet's with edge ``element_size`` are raised where possible."""


def meshed(gmsh: Any, frame: Frame, element_size: float, cuts: int) -> TetMesh:
    """The tets of the current model, m, in space. The first ``cuts`` directions of the frame are those across which it
    is cut at 0.
    """
    gmsh.model.mesh.generate(3)
    found = named_mesh(gmsh)
    mesh = found.mesh
    if mesh.volumes().sum() < 0:
        mesh = TetMesh(mesh.points, mesh.tets[:, [0, 2, 1, 3]])
    sliding, points = Sliding.of(gmsh, np.asarray(found.names.nodes), mesh.points, cuts)
    wanted = WANTED * REGULAR_STEP * frame.length(element_size)
    mesh = smoothed(TetMesh(points, mesh.tets), sliding, wanted)
    return TetMesh(frame.to_space(mesh.points), mesh.tets)
