"""Elements of second order: each edge has a midside node.

The module computes the volume that is lost if edges are made straight, and cuts each tet of ten nodes into eight tets.
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
"""Fraction of the volume that may be lost if edges are made straight. If more would be lost, tets are cut into eight.
Chosen value: the mass has the same error, and eight tets with half the time step take 16 times as long as one tet."""
_OFF = 0.4
"""Largest distance of a midside node from the middle of its edge, divided by the length of the edge. Chosen value: the
ratio is 0.25 for quarter points, and 0.21 for an arc of 90 degrees. A ratio of 0.5 means that the file has another
order of nodes: the node is in the middle of another edge of a regular tet."""
_CORNERS = ((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3))
_LONG = ((4, 9), (6, 8), (7, 5))
"""Pairs of opposite corners of the octahedron that remains when the four corner tets are cut off."""
_AT = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1],
                       [1, 0, 1], [0, 1, 1]])  # fmt: skip
"""Indices of the nodes of a tet with ten nodes."""


def checked(cells: Cells, points: Floats, tags: Ids) -> None:
    """Raise MeshError if a midside node is not near the middle of its edge. The nodes of ``cells`` are indices into
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
    """Return the approximate volume between curved elements and the same elements with straight edges, in cubic units
    of ``points``.

    The weight of a midside node is a third of the area of each face at its edge, which is the integral of its shape
    function. The factor of one third is exact for triangles and for quadrilaterals of eight nodes.
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
    """Return (m, 3) area vectors of triangles or quadrilaterals. The vectors point outward."""
    a, b, c, d = (*corners, corners[0])[:4]
    return np.asarray(0.5 * (np.cross(b - a, c - a) if len(corners) == 3 else np.cross(c - a, d - b)))


def eight(nodes: Ids, points: Floats) -> Ids:
    """Return (m, 8, 4) the eight tets of each of the tets (m, 10).

    Four of the eight tets are at the corners; the other four surround one of the three diagonals of the octahedron
    between the corner tets. The diagonal with the longest stable step is used; most often it is the shortest diagonal.
    """
    every = np.stack([nodes[:, [*_CORNERS, *_inner(*long)]] for long in _LONG], axis=1)
    volume, area = volume_and_area(points, every)
    length = np.where(volume > FLAT * area * np.sqrt(area), step_lengths(points, every), 0.0)
    best = length.min(axis=2).argmax(axis=1)
    return np.asarray(every[np.arange(len(nodes)), best], np.int64)


def _inner(one: int, other: int) -> list[tuple[int, int, int, int]]:
    """Return the positive tets around the diagonal between the midside nodes ``one`` and ``other``."""
    ring, found = [k for k in range(4, 10) if k not in (one, other)], []
    for p, q in combinations(ring, 2):
        volume = (np.cross(_AT[other] - _AT[one], _AT[p] - _AT[one]) * (_AT[q] - _AT[one])).sum()
        if volume:
            found.append((one, other, p, q) if volume > 0 else (one, other, q, p))
    return found


def refuse_halves(cells: Cells, tags: Ids) -> None:
    """Raise MeshError if two elements with a common edge have different midside nodes there."""
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
