"""Facets of a mesh with the two sides of each facet."""

import numpy as np

from conoid.worker.mesh.faces import FACES, across
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.state import Ints


def inner(mesh: TetMesh) -> Ints:
    """Returns (m, 2) the two sides of every facet, 4 * tet + face, the smaller side first."""
    behind = across(mesh.tets).reshape(-1).astype(np.int64)
    one = np.flatnonzero(behind > np.arange(len(behind)))
    return np.column_stack([one, behind[one]])


def corners_of(mesh: TetMesh, facets: Ints) -> Ints:
    """Returns (m, 3) the nodes of facets."""
    return np.asarray(mesh.tets[facets[:, 0, None] // 4, FACES[facets[:, 0] % 4]].astype(np.int64))


def plane(mesh: TetMesh, height: float) -> Ints:
    """Returns the facets whose nodes all start at the given height."""
    facets = inner(mesh)
    return np.asarray(facets[(mesh.points[corners_of(mesh, facets), 2] == height).all(axis=1)])
