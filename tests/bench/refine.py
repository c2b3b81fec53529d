"""Refinement of a tet mesh: each tet is cut into eight tets at its corners and edge midpoints; nodal values are
interpolated."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from conoid.worker.mesh.model import TetMesh

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
_CHILDREN = np.array([
    (0, 4, 5, 6), (1, 7, 4, 8), (2, 5, 7, 9), (3, 8, 6, 9), (4, 7, 5, 9), (4, 8, 7, 9), (4, 6, 8, 9), (4, 5, 6, 9),
])  # fmt: skip
"""Corners of the eight tets: numbers 0-3 are the corners of the old tet, numbers 4-9 its midpoints in the order of
_EDGES. The inner octahedron is cut along the diagonal 4-9."""


@dataclass(frozen=True)
class Refined:
    """A refined mesh, and its relation to the old mesh."""

    mesh: TetMesh
    ends: Ints
    """Ends (nodes, 2) of the edge of the old mesh on which each new node lies; for an old node both ends are this
    node."""
    parent: Ints
    """Old tet (tets,) that contains each new tet."""

    def nodal(self, values: Floats) -> Floats:
        """Returns values at the new nodes, interpolated from the values (old, ...) at the old nodes."""
        mean: Floats = 0.5 * (values[self.ends[:, 0]] + values[self.ends[:, 1]])
        return mean


def refined(mesh: TetMesh) -> Refined:
    """Cuts every tet into eight tets of equal volume. The new nodes are numbered in the order in which the tets use
    them.
    """
    n, tets = len(mesh.points), mesh.tets.astype(np.int64)
    pairs = np.sort(np.stack([tets[:, list(edge)] for edge in _EDGES], axis=1), axis=2).reshape(-1, 2)
    edges, number = np.unique(pairs, axis=0, return_inverse=True)
    corners = np.concatenate([tets, n + number.reshape(-1, 6)], axis=1)
    fine = corners[:, _CHILDREN].reshape(-1, 4)
    ends = np.concatenate([np.repeat(np.arange(n)[:, None], 2, axis=1), edges])
    _, first = np.unique(fine, return_index=True)
    order = fine.reshape(-1)[np.sort(first)]
    place = np.empty(len(ends), np.int64)
    place[order] = np.arange(len(order))
    ends = ends[order]
    points = 0.5 * (mesh.points[ends[:, 0]] + mesh.points[ends[:, 1]])
    made = TetMesh(points, place[fine].astype(np.int32))
    turned = made.volumes() < 0
    made.tets[turned] = made.tets[turned][:, [0, 2, 1, 3]]
    return Refined(made, ends, np.repeat(np.arange(len(tets)), 8))
