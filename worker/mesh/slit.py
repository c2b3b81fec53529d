"""Initial cracks: the nodes on a slit are doubled, so that the faces on both sides are exposed."""

import numpy as np

from conoid.cases.model.bodies import Box, Plate
from conoid.cases.shapes.geometry import across, bounds, index

from .model import TetMesh

_NEAR = 1e-6
"""Distance from a plane, as a share of the element size, below which a node is on the plane."""


def opened(body: Box | Plate, mesh: TetMesh) -> TetMesh:
    """Return the mesh with the nodes of the body's slit doubled. The copies belong to the tets on the positive side.

    Nodes on the border of the slit are not doubled and connect both sides, unless this border is on the surface of
    the body.
    """
    slit = body.slit
    if slit is None:
        return mesh
    near, normal = _NEAR * body.element_size, index(slit.axis)
    lowest, highest = bounds(body) or ((0.0,) * 3, (0.0,) * 3)
    doubled = np.abs(mesh.points[:, normal] - slit.at) < near
    for low, high, d in zip(slit.low, slit.high, across(slit.axis), strict=True):
        x = mesh.points[:, d]
        doubled &= (x > low + near) | (low < lowest[d] + near)
        doubled &= (x < high - near) | (high > highest[d] - near)
    nodes = np.flatnonzero(doubled)
    copies = np.arange(len(mesh.points), dtype=np.int32)
    copies[nodes] = len(mesh.points) + np.arange(len(nodes))
    behind = mesh.points[mesh.tets, normal].mean(axis=1) > slit.at
    return TetMesh(
        np.concatenate([mesh.points, mesh.points[nodes]]), np.where(behind[:, None], copies[mesh.tets], mesh.tets)
    )
