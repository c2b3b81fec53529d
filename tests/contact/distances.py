"""Exact distances in numpy, for brute-force tests of the search."""

import numpy as np

from ..worker.meshes import Floats


def _along(p: Floats, a: Floats, b: Floats) -> Floats:
    """Returns distances of points from segments; all arrays have the same shape (..., 3)."""
    along = b - a
    length = np.maximum((along * along).sum(axis=-1), 1e-300)
    share = np.clip(((p - a) * along).sum(axis=-1) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(p - a - share[..., None] * along, axis=-1))


def above(p: Floats, a: Floats, b: Floats, c: Floats) -> Floats:
    """Returns distances of points from triangles abc, all of one shape (..., 3). The distance is the height above the
    triangle if the foot of the point is inside, else the distance from the border of the triangle.
    """
    rim = np.minimum(np.minimum(_along(p, a, b), _along(p, b, c)), _along(p, c, a))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1), 1e-300)[..., None]
    inside = np.ones(rim.shape, bool)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(normal, end - start) * (p - start)).sum(axis=-1) >= 0.0
    height = np.abs(((p - a) * normal).sum(axis=-1))
    return np.where(inside, height, rim)


def across(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Returns distances between segments ab and cd that are not parallel, all of one shape (..., 3): at an end of a
    segment, or along the common normal.
    """
    ends = np.minimum(np.minimum(_along(a, c, d), _along(b, c, d)), np.minimum(_along(c, a, b), _along(d, a, b)))
    u, w, r = b - a, d - c, c - a
    normal = np.cross(u, w)
    area = np.maximum((normal * normal).sum(axis=-1), 1e-300)
    s = (np.cross(r, w) * normal).sum(axis=-1) / area
    t = (np.cross(r, u) * normal).sum(axis=-1) / area
    crossed = (np.minimum(s, t) >= 0.0) & (np.maximum(s, t) <= 1.0)
    return np.where(crossed, np.abs((r * normal).sum(axis=-1)) / np.sqrt(area), ends)


def point_triangle(points: Floats, triangles: Floats) -> Floats:
    """Returns (n, m) distances of points (n, 3) from triangles (m, 3, 3)."""
    a, b, c = (triangles[None, :, k] for k in range(3))
    return above(points[:, None, :], a, b, c)


def segment_segment(segments: Floats) -> Floats:
    """Returns (n, n) distances between segments (n, 2, 3), no two of which are parallel."""
    a, b = segments[:, None, 0], segments[:, None, 1]
    c, d = segments[None, :, 0], segments[None, :, 1]
    return across(a, b, c, d)
