"""Triangles of a surface that cross each other. Candidate pairs are found by cells and tested by separating axes.

Two convex bodies do not overlap if their projections on some axis do not overlap. For two triangles only some axes must
be tested: their normals, the cross products of an edge of one with an edge of the other, and the normals of the edges
in the planes of both triangles (Gottschalk, Lin and Manocha 1996, SIGGRAPH, 171).
"""

import math

import numpy as np
from numpy.typing import NDArray

from ..model import Floats

_DEEP = 1e-6
"""Largest overlap of the projections of two triangles that only touch, divided by the extent of the surface. Chosen
value: the coordinates in files have six or seven digits."""
_MOST = 10_000_000
"""Largest number of cell entries. The cells are enlarged until the number of entries is below this limit. Chosen value:
the entries need a quarter of a GiB."""
_CHUNK = 200_000
"""Number of pairs that are tested at once."""

Pairs = NDArray[np.int64]


def crossing(points: Floats, faces: Pairs) -> Pairs:
    """Return (k, 2) pairs of ``faces`` (m, 3) over ``points`` (n, 3) that have more than corners and edges in
    common.
    """
    corners = points[faces]
    deep = _DEEP * float(np.ptp(points, axis=0).max())
    pairs = _near(corners, deep)
    found = [
        chunk[_overlap(corners[chunk[:, 0]], corners[chunk[:, 1]], deep)]
        for chunk in (pairs[k : k + _CHUNK] for k in range(0, len(pairs), _CHUNK))
    ]
    return np.concatenate(found) if found else np.zeros((0, 2), np.int64)


def _near(corners: Floats, deep: float) -> Pairs:
    """Yield (k, 2) pairs of triangles whose bounding boxes overlap, each pair once. The boxes of a pair touch a common
    cell.
    """
    low, high = corners.min(axis=1), corners.max(axis=1)
    start, extent = low.min(axis=0), float((high.max(axis=0) - low.min(axis=0)).max())
    many = max(1, math.isqrt(len(corners)) // 2)
    while True:
        first, last = (np.floor((x - start) / extent * many).clip(0, many - 1).astype(np.int64) for x in (low, high))
        counts = (last - first + 1).prod(axis=1)
        if counts.sum() <= _MOST or many == 1:
            break
        many = max(1, many // 2)
    owner = np.repeat(np.arange(len(corners)), counts)
    inside = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    spans = (last - first + 1)[owner]
    wide, broad = spans[:, 0], spans[:, 1]
    steps = np.stack([inside % wide, inside // wide % broad, inside // (wide * broad)], axis=1)
    cell = ((first[owner] + steps) * np.array([1, many, many * many])).sum(axis=1)
    order = np.argsort(cell, kind="stable")
    cell, owner = cell[order], owner[order]
    found, off = [], 1
    while True:
        together = np.flatnonzero(cell[off:] == cell[:-off]) if off < len(cell) else np.zeros(0, np.int64)
        if not len(together):
            break
        one, other = owner[together], owner[together + off]
        meets = ((low[one] <= high[other] - deep) & (low[other] <= high[one] - deep)).sum(axis=1) >= 2
        meets &= ((low[one] <= high[other]) & (low[other] <= high[one])).all(axis=1)
        found.append(np.stack([one[meets], other[meets]], axis=1))
        off += 1
    if not found:
        return np.zeros((0, 2), np.int64)
    return np.unique(np.sort(np.concatenate(found), axis=1), axis=0)


def _overlap(a: Floats, b: Floats, deep: float) -> NDArray[np.bool_]:
    """Return (k,) True for each pair of triangles (k, 3, 3) that overlap by more than ``deep`` along every axis that
    could separate the two triangles.
    """
    sides_a, sides_b = (np.roll(t, -1, axis=1) - t for t in (a, b))
    normal_a, normal_b = (_unit(np.cross(s[:, 0], s[:, 1])) for s in (sides_a, sides_b))
    flat = (np.abs(((b - a[:, :1]) * normal_a[:, None]).sum(axis=2)) <= deep).all(axis=1)
    overlap = np.ones(len(a), bool)
    for axis in (normal_a, normal_b):
        overlap &= flat | (_depth(a, b, axis) > deep)
    for i in range(3):
        for j in range(3):
            axis = _unit(np.cross(sides_a[:, i], sides_b[:, j]))
            overlap &= flat | (axis == 0.0).all(axis=1) | (_depth(a, b, axis) > deep)
        for sides, normal in ((sides_a, normal_a), (sides_b, normal_b)):
            overlap &= ~flat | (_depth(a, b, _unit(np.cross(normal, sides[:, i]))) > deep)
    return overlap


def _depth(a: Floats, b: Floats, axis: Floats) -> Floats:
    """Return (k,) the overlap of the projections of two triangles on an axis; negative if the projections do not
    overlap.
    """
    p, q = ((t * axis[:, None]).sum(axis=2) for t in (a, b))
    depth: Floats = np.minimum(p.max(axis=1) - q.min(axis=1), q.max(axis=1) - p.min(axis=1))
    return depth


def _unit(vectors: Floats) -> Floats:
    """Return vectors of length 1. If the length of a vector is zero within round-off, the result is a zero vector."""
    length = np.sqrt((vectors**2).sum(axis=1, keepdims=True))
    tiny = length <= 1e-12 * max(float(length.max(initial=0.0)), 1e-300)
    unit: Floats = np.divide(vectors, length, out=np.zeros_like(vectors), where=~tiny)
    return unit
