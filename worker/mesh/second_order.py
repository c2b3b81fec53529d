"""Elements of second order, with a node in the middle of each edge.

The module computes the volume that straight edges lose, and cuts each tet of ten nodes into eight tets.
"""

from collections.abc import Sequence
from itertools import combinations, pairwise
from typing import Literal

import numpy as np

from ..errors import MeshError
from .cells import Cells, sides
from .model import FLAT, Floats, Ids, step_lengths, volume_and_area

Way = Literal["eight", "corners"]

LOST = 1e-3
"""Share of the volume that straight edges may lose. If more is lost, tets are cut into eight. Chosen value: the mass
has the same error, and eight tets with half the step cost 16 times as much as one tet."""
_OFF = 0.4
"""Largest distance of a node from the middle of its edge, divided by the length of the edge. Chosen value: this ratio
is 0.25 for quarter points, and 0.21 for an arc of 90 degrees. For the middle of another edge of a regular tet the ratio
is 0.5; such a value means that the file has another order of nodes."""
_CORNERS = ((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3))
_LONG = ((4, 9), (6, 8), (7, 5))
"""Opposite corners of the octahedron that remains between the four corner tets."""
_AT = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1],
                       [1, 0, 1], [0, 1, 1]])  # fmt: skip
"""Indices of the nodes of a tet of ten nodes."""


def checked(cells: Cells, points: Floats, tags: Ids) -> None:
    """Raise MeshError if a node is not near the middle of its edge. The nodes of ``cells`` are indices into
    ``points``.
    """
    for (a, b), middle in zip(cells.kind.edges, cells.middles.T, strict=True):
        one, other = points[cells.corners[:, a]], points[cells.corners[:, b]]
        off, along = points[middle] - 0.5 * (one + other), other - one
        far = np.flatnonzero((off * off).sum(axis=1) > _OFF * _OFF * (along * along).sum(axis=1))
        if len(far):
            k = far[0]
            raise MeshError(
                f"{cells.called(k)}: node {tags[middle[k]]} is not near the middle of the edge between nodes "
                f"{tags[cells.corners[k, a]]} and {tags[cells.corners[k, b]]}"
            )


def lost(cells: Cells, points: Floats) -> float:
    """Return the approximate volume between curved elements and elements with straight edges, in the unit of
    ``points``.

    A node in the middle of an edge has a third of the area of each face with this edge: the integral of its shape
    function. The third is exact on triangles and on quadrilaterals of eight nodes.
    """
    total = 0.0
    for side in sides(cells.kind.form):
        area = _area([points[cells.corners[:, k]] for k in side])
        for a, b in pairwise([*side, side[0]]):
            for k in (k for k, edge in enumerate(cells.kind.edges) if set(edge) == {a, b}):
                off = points[cells.middles[:, k]] - 0.5 * (points[cells.corners[:, a]] + points[cells.corners[:, b]])
                total += float((area * off).sum()) / 3.0
    return total


def _area(corners: Sequence[Floats]) -> Floats:
    """Return (m, 3) area vectors of triangles or quadrilaterals; the vectors point outward."""
    a, b, c, d = (*corners, corners[0])[:4]
    return np.asarray(0.5 * (np.cross(b - a, c - a) if len(corners) == 3 else np.cross(c - a, d - b)))


def eight(nodes: Ids, points: Floats) -> Ids:
    """Return (m, 8, 4) the eight tets of each of the tets (m, 10).

    Four of the tets are at the corners. Four tets surround one of three diagonals of the octahedron between the corner
    tets. The chosen diagonal has the longest stable step; most often it is the shortest diagonal.
    """
    every = np.stack([nodes[:, [*_CORNERS, *_inner(*long)]] for long in _LONG], axis=1)
    volume, area = volume_and_area(points, every)
    length = np.where(volume > FLAT * area * np.sqrt(area), step_lengths(points, every), 0.0)
    best = length.min(axis=2).argmax(axis=1)
    return np.asarray(every[np.arange(len(nodes)), best], np.int64)


def _inner(one: int, other: int) -> list[tuple[int, int, int, int]]:
    """Return the positive tets round the diagonal between two nodes in the middle of edges."""
    ring, found = [k for k in range(4, 10) if k not in (one, other)], []
    for p, q in combinations(ring, 2):
        volume = (np.cross(_AT[other] - _AT[one], _AT[p] - _AT[one]) * (_AT[q] - _AT[one])).sum()
        if volume:
            found.append((one, other, p, q) if volume > 0 else (one, other, q, p))
    return found


def refuse_halves(cells: Cells, tags: Ids) -> None:
    """Raise MeshError if two elements have a common edge with different middle nodes."""
    rows = np.concatenate([
        np.column_stack([np.sort(cells.corners[:, edge], axis=1), middle])
        for edge, middle in zip(cells.kind.edges, cells.middles.T, strict=True)
    ])  # fmt: skip
    different = np.unique(rows, axis=0)
    for columns in ([0, 1], [2]):
        _, first, times = np.unique(different[:, columns], axis=0, return_index=True, return_counts=True)
        if len(twice := first[times > 1]):
            a, b, middle = tags[different[twice[0]]]
            raise MeshError(
                f"node {middle} is in the middle of the edge between nodes {a} and {b}, but not in every element that "
                "has this edge, or in the middle of another edge, too"
            )
