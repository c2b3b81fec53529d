"""All cuts of a hexahedron into tets, for given diagonals of its faces.

The node order is that of gmsh, Abaqus, LS-DYNA and VTK. A wedge or a pyramid is a hexahedron with repeated nodes::

        7-------6
       /|      /|
      4-------5 |       wedge   0 1 2 2 4 5 6 6  of  (0, 1, 2) and (4, 5, 6)
      | 3-----|-2       pyramid 0 1 2 3 4 4 4 4
      |/      |/
      0-------1
"""

from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from .faces import FACES

QUADS = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
"""Faces of a hexahedron: four nodes each, anticlockwise seen from outside."""
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
"""Edges of a hexahedron: two nodes each."""
MOST = 6
"""Largest number of tets of a cut. A hexahedron that is cut into five tets has a tet in the middle; a hexahedron that
is cut into six tets has a long diagonal."""
_CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
"""Coordinates of the nodes of a hexahedron."""

Triangle = tuple[int, int, int]
Tet = tuple[int, int, int, int]


@cache
def cuts(pattern: int) -> NDArray[np.int64]:
    """Return (n, MOST, 4) the cuts of a hexahedron without additional nodes.

    If bit f of ``pattern`` is 1, the diagonal of face f connects its second and fourth node, else its first and third
    node. If a cut has five tets, its last row is 0, 0, 0, 0. For some patterns there is no cut, and n is 0.
    """
    found = sorted(set(_completed(frozenset(_turned(face) for face in skin(pattern)), ())))
    table = np.zeros((len(found), MOST, 4), np.int64)
    for row, cut in zip(table, found, strict=True):
        row[: len(cut)] = cut
    return table


def skin(pattern: int) -> list[Triangle]:
    """Return the twelve triangles of the faces, anticlockwise seen from outside, two triangles for each face."""
    found = []
    for bit, (a, b, c, d) in enumerate(QUADS.tolist()):
        found += [(b, c, d), (b, d, a)] if pattern >> bit & 1 else [(a, b, c), (a, c, d)]
    return found


def _completed(front: frozenset[Triangle], made: tuple[Tet, ...]) -> Iterator[tuple[Tet, ...]]:
    """Yield all cuts that begin with the tets ``made``. The cuts fill the volume that is enclosed by the triangles of
    the ``front``.

    Positive tets whose inner faces cancel fill a body exactly once, so no other test is needed.
    """
    if not front:
        yield tuple(sorted(made))
    if not front or len(made) == MOST:
        return
    a, b, c = min(front)
    for d in range(8):
        tet = (a, c, b, d)
        if _positive(tet):
            left, fits = set(front), True
            for face in (_turned(tuple(tet[i] for i in row)) for row in FACES.tolist()):
                if face in left:
                    left.remove(face)
                else:
                    fits = fits and _turned(face[::-1]) not in left
                    left.add(_turned(face[::-1]))
            if fits:
                yield from _completed(frozenset(left), (*made, tet))


def _positive(tet: Tet) -> bool:
    (a, b, c), (d, e, f), (g, h, i) = ([x - y for x, y in zip(_CUBE[k], _CUBE[tet[0]], strict=True)] for k in tet[1:])
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) > 0


def _turned(face: tuple[int, ...]) -> Triangle:
    """Return the face with its nodes rotated so that the smallest node is the first."""
    first = face.index(min(face))
    a, b, c = face[first:] + face[:first]
    return a, b, c
