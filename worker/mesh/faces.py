"""Triangular faces of tets. Face ``i`` is opposite to node ``i``. The nodes of a face run anticlockwise seen from
outside.
"""

import numpy as np
from numpy.typing import NDArray

from .model import Floats, Ints

FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]], np.int32)
"""Local nodes of the four faces of a tet."""


def boundary_faces(tets: Ints) -> Ints:
    """Return (k, 3) nodes of the faces that belong to one tet only, in the order of tet and local face. The normals of
    the faces point outward.
    """
    faces = tets[:, FACES].reshape(-1, 3)
    group, size = _groups(faces)
    outer: Ints = faces[size[group] == 1]
    return outer


def same_side(tets: Ints) -> NDArray[np.int64]:
    """Return (k, 2) pairs of overlapping tets. The two tets of a pair are positively oriented and lie on the same side
    of a common face.

    If more than two tets are on one side, every two successive tets form a pair.
    """
    faces = tets[:, FACES].reshape(-1, 3)
    a, b, c = faces.T
    odd = (a > b) ^ (b > c) ^ (a > c)
    side = _groups(faces)[0] * 2 + odd
    if np.bincount(side).max(initial=0) <= 1:
        return np.zeros((0, 2), np.int64)
    order = np.argsort(side, kind="stable")
    again = np.flatnonzero(np.diff(side[order]) == 0)
    return np.column_stack([order[again], order[again + 1]]) // 4


def across(tets: Ints) -> Ints:
    """Return (n, 4) the neighbour of each face: 4 * tet + local face of the neighbour; -1 if the face has no
    neighbour.
    """
    group, size = _groups(tets[:, FACES].reshape(-1, 3))
    order = np.argsort(group, kind="stable")
    first = order[np.concatenate([[0], np.cumsum(size)[:-1]])]
    inner = size == 2
    partner = np.full(len(group), -1, np.int32)
    one = first[inner]
    other = order[np.cumsum(size)[inner] - 1]
    partner[one], partner[other] = other, one
    return partner.reshape(-1, 4)


def areas(points: Floats, faces: Ints) -> Floats:
    """Return (k,) areas, m^2, of ``faces``, (k, 3)."""
    return np.asarray(np.linalg.norm(normals(points, faces), axis=1) / 2)


def normals(points: Floats, faces: NDArray[np.integer]) -> Floats:
    """Return (k, 3) outward normals of ``faces``, (k, 3), with length twice the area, m^2."""
    a, b, c = (points[faces[:, i]] for i in range(3))
    return np.asarray(np.cross(b - a, c - a))


def _groups(faces: Ints) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return, for each row, the number of its face among the distinct faces; also return the number of rows of each
    distinct face.
    """
    low, middle, high = np.sort(faces, axis=1).astype(np.int64).T
    order = np.lexsort((high, low << 32 | middle))
    pair, last = (low << 32 | middle)[order], high[order]
    new = np.ones(len(order), bool)
    new[1:] = (pair[1:] != pair[:-1]) | (last[1:] != last[:-1])
    group = np.empty(len(order), np.int64)
    group[order] = np.cumsum(new) - 1
    return group, np.bincount(group)
