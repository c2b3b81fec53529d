"""Initial cracks. The nodes on a slit are doubled, so that the faces on both sides of the slit become outer faces."""

import numpy as np

from conoid.cases.model.bodies import Box, Plate
from conoid.cases.shapes.geometry import across, bounds, index

from .model import TetMesh

_NEAR = 1e-6
"""Distance between a node and the plane of a slit, divided by the element size. A node with a smaller distance lies on
the plane."""


def opened(body: Box | Plate, mesh: TetMesh) -> TetMesh:
    """Return the mesh with the nodes on the slit of the body doubled. The copies belong to the tets on the positive
    side of the slit.

    A node on the border of the slit is not doubled, so it connects both sides. A border node on the surface of the body
    is doubled.
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
