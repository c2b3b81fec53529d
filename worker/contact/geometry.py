"""Distances between nodes, faces and edges, as kernels."""

import numpy as np

from ..jit import njit

_V2 = "float64[:, :]"
MARGIN = 1e-3
"""Of the area coordinates: how far outside of a face the foot of a node may lie."""


@njit("float64(float64[::1], float64[::1])", cache=True)
def dot(a, b):  # type: ignore[no-untyped-def]
    """a . b of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit("void(float64[::1], float64[::1], float64[::1])", cache=True)
def cross(out, a, b):  # type: ignore[no-untyped-def]
    """``out`` (3,): a x b."""
    out[0], out[1], out[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(f"float64({_V2}, int64, int64)", cache=True)
def between(v, a, b):  # type: ignore[no-untyped-def]
    """|v_a - v_b|."""
    square = 0.0
    for i in range(3):
        square += (v[a, i] - v[b, i]) ** 2
    return np.sqrt(square)


@njit(f"float64(float64[::1], {_V2}, int64, int64, int64, int64)", cache=True, error_model="numpy")
def height(normal, x, s, i, j, k):  # type: ignore[no-untyped-def]
    """Height of node s over the face i, j, k, m, and the unit normal; NaN for a face of no area."""
    ex, ey, ez = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
    fx, fy, fz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
    nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    r = 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
    normal[0], normal[1], normal[2] = nx * r, ny * r, nz * r
    return (nx * (x[s, 0] - x[i, 0]) + ny * (x[s, 1] - x[i, 1]) + nz * (x[s, 2] - x[i, 2])) * r


@njit(f"boolean(float64[::1], {_V2}, {_V2}, int64, int64, int64, int64, float64)", cache=True, error_model="numpy")
def foot(b, x, ahead, s, i, j, k, tau):  # type: ignore[no-untyped-def]
    """Area coordinates ``b`` of the foot of node s on the face, the share ``tau`` of the way from x to ``ahead``;
    whether it lies on the face.
    """
    ee, ff, ef, er, fr = 0.0, 0.0, 0.0, 0.0, 0.0
    for a in range(3):
        e, f, r = x[j, a] - x[i, a], x[k, a] - x[i, a], x[s, a] - x[i, a]
        e += tau * (ahead[j, a] - ahead[i, a] - e)
        f += tau * (ahead[k, a] - ahead[i, a] - f)
        r += tau * (ahead[s, a] - ahead[i, a] - r)
        ee, ff, ef, er, fr = ee + e * e, ff + f * f, ef + e * f, er + e * r, fr + f * r
    area = ee * ff - ef * ef
    b[1], b[2] = (ff * er - ef * fr) / area, (ee * fr - ef * er) / area
    b[0] = 1.0 - b[1] - b[2]
    if not min(b[0], b[1], b[2]) >= -MARGIN:
        return False
    for a in range(3):
        b[a] = max(b[a], 0.0)
    total = b[0] + b[1] + b[2]
    for a in range(3):
        b[a] /= total
    return True


@njit(f"float64({_V2}, int64, int64, int64)", cache=True)
def off(x, s, a, b):  # type: ignore[no-untyped-def]
    """Distance of node s from the segment ab, m."""
    along, length, square = 0.0, 0.0, 0.0
    for i in range(3):
        along += (x[s, i] - x[a, i]) * (x[b, i] - x[a, i])
        length += (x[b, i] - x[a, i]) ** 2
    share = min(max(along / length, 0.0), 1.0)
    for i in range(3):
        square += (x[s, i] - x[a, i] - share * (x[b, i] - x[a, i])) ** 2
    return np.sqrt(square)


@njit(f"float64({_V2}, int64, int64, int64, int64)", cache=True, error_model="numpy")
def segments(x, a, b, c, d):  # type: ignore[no-untyped-def]
    """Distance of the segments ab and cd, m: where their lines are nearest, or from an end."""
    uu, uw, ww, ur, wr, rr = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        u, w, r = x[b, i] - x[a, i], x[d, i] - x[c, i], x[c, i] - x[a, i]
        uu, uw, ww, ur, wr, rr = uu + u * u, uw + u * w, ww + w * w, ur + u * r, wr + w * r, rr + r * r
    area = uu * ww - uw * uw
    s, t = (ww * ur - uw * wr) / area, (uw * ur - uu * wr) / area
    if min(s, t) >= 0.0 and max(s, t) <= 1.0:
        square = rr + s * s * uu + t * t * ww - 2.0 * (s * ur - t * wr + s * t * uw)
        return np.sqrt(max(square, 0.0))
    return min(min(off(x, a, c, d), off(x, b, c, d)), min(off(x, c, a, b), off(x, d, a, b)))
