"""Geometry of points, faces and edges for kernels. A vector is a tuple of three floats. Therefore it is kept in
registers, and no array is allocated.
"""

import numpy as np

from ..kernels.jit import njit

MARGIN = 1e-3
"""Tolerance of the area coordinates: if the foot of a node is outside of a face by less than the tolerance, the foot
counts as being on the face."""
VECTOR = "UniTuple(float64, 3)"
"""Type of a vector in numba's notation."""


@njit(f"{VECTOR}(float64[:, :], int64)", cache=True)
def at(x, s):  # type: ignore[no-untyped-def]
    """Returns row ``s`` of ``x`` (n, 3) as a vector."""
    return x[s, 0], x[s, 1], x[s, 2]


@njit(f"{VECTOR}({VECTOR}, {VECTOR})", cache=True)
def minus(a, b):  # type: ignore[no-untyped-def]
    """Returns the vector a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(f"{VECTOR}({VECTOR}, {VECTOR})", cache=True)
def plus(a, b):  # type: ignore[no-untyped-def]
    """Returns the vector a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@njit(f"{VECTOR}({VECTOR})", cache=True)
def half(a):  # type: ignore[no-untyped-def]
    """Returns the vector a / 2."""
    return 0.5 * a[0], 0.5 * a[1], 0.5 * a[2]


@njit(f"{VECTOR}({VECTOR}, float64, {VECTOR})", cache=True)
def beyond(a, t, b):  # type: ignore[no-untyped-def]
    """Returns the vector a + t b."""
    return a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]


@njit(f"float64({VECTOR}, {VECTOR})", cache=True)
def dot(a, b):  # type: ignore[no-untyped-def]
    """Returns the scalar product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(f"{VECTOR}({VECTOR}, {VECTOR})", cache=True)
def cross(a, b):  # type: ignore[no-untyped-def]
    """Returns the vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(f"float64({VECTOR}, {VECTOR})", cache=True)
def distance(a, b):  # type: ignore[no-untyped-def]
    """Returns the distance |a - b|."""
    r = minus(a, b)
    return np.sqrt(dot(r, r))


@njit(f"Tuple((float64, {VECTOR}))({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR})", cache=True, error_model="numpy")
def height(s, i, j, k):  # type: ignore[no-untyped-def]
    """Height of the point s above the face i, j, k, m, and the unit normal of the face. The height is NaN if the face
    has zero area.
    """
    n = cross(minus(j, i), minus(k, i))
    r = 1.0 / np.sqrt(dot(n, n))
    return dot(n, minus(s, i)) * r, (n[0] * r, n[1] * r, n[2] * r)


@njit(f"Tuple((boolean, {VECTOR}))({VECTOR}, {VECTOR}, {VECTOR})", cache=True, error_model="numpy")
def foot(r, e, f):  # type: ignore[no-untyped-def]
    """Returns two values for a point and the face with the edges e and f: True if the foot of the point is on the face;
    and the area coordinates of the foot. ``r``: vector from the common corner of e and f to the point.
    """
    ee, ff, ef, er, fr = dot(e, e), dot(f, f), dot(e, f), dot(e, r), dot(f, r)
    area = ee * ff - ef * ef
    b, c = (ff * er - ef * fr) / area, (ee * fr - ef * er) / area
    a = 1.0 - b - c
    if not min(a, b, c) >= -MARGIN:
        return False, (a, b, c)
    a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    total = a + b + c
    return True, (a / total, b / total, c / total)


@njit(f"float64({VECTOR}, {VECTOR}, {VECTOR})", cache=True)
def off(s, a, b):  # type: ignore[no-untyped-def]
    """Distance of the point s from the segment ab, m."""
    r, u = minus(s, a), minus(b, a)
    share = min(max(dot(r, u) / dot(u, u), 0.0), 1.0)
    r = beyond(r, -share, u)
    return np.sqrt(dot(r, r))


@njit(f"float64({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR})", cache=True, error_model="numpy")
def segments(a, b, c, d):  # type: ignore[no-untyped-def]
    """Distance of the segments ab and cd, m. If the nearest points of the two lines are within the segments, the result
    is the distance of these points. Else it is the least distance from an end of a segment to the other segment."""
    u, w, r = minus(b, a), minus(d, c), minus(c, a)
    uu, uw, ww, ur, wr = dot(u, u), dot(u, w), dot(w, w), dot(u, r), dot(w, r)
    area = uu * ww - uw * uw
    s, t = (ww * ur - uw * wr) / area, (uw * ur - uu * wr) / area
    if min(s, t) >= 0.0 and max(s, t) <= 1.0:
        square = dot(r, r) + s * s * uu + t * t * ww - 2.0 * (s * ur - t * wr + s * t * uw)
        return np.sqrt(max(square, 0.0))
    return min(min(off(a, c, d), off(b, c, d)), min(off(c, a, b), off(d, a, b)))


@njit(f"{VECTOR}({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR})", cache=True, error_model="numpy")
def nearest(a, b, c, d):  # type: ignore[no-untyped-def]
    """Vector between the nearest points of two segments, from the point of ab to the point of cd. Source: Ericson
    (2005), 5.1.9.
    """
    u, w, r = minus(b, a), minus(d, c), minus(c, a)
    uu, uw, ww, ur, wr = dot(u, u), dot(u, w), dot(w, w), dot(u, r), dot(w, r)
    area = uu * ww - uw * uw
    s = min(max((ww * ur - uw * wr) / area, 0.0), 1.0) if area > 0.0 else 0.0
    t = (uw * s - wr) / ww
    if not 0.0 <= t <= 1.0:
        t = 0.0 if t < 0.0 else 1.0
        s = min(max((ur + t * uw) / uu, 0.0), 1.0)
    return minus(beyond(c, t, w), beyond(a, s, u))


@njit("float64(float64[:, :], int64, int64, int64, int64)", cache=True, error_model="numpy")
def lowest_height(x, a, b, c, d):  # type: ignore[no-untyped-def]
    """Smallest height of the tet abcd, m."""
    u, to, fro = minus(at(x, b), at(x, a)), minus(at(x, c), at(x, a)), minus(at(x, d), at(x, a))
    one, two, three, four = cross(u, to), cross(u, fro), cross(to, fro), cross(minus(to, u), minus(fro, u))
    largest = max(max(dot(one, one), dot(two, two)), max(dot(three, three), dot(four, four)))
    return abs(dot(one, fro)) / np.sqrt(largest)
