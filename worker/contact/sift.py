"""Candidates sifted: of the pairs whose boxes touch, those that come near each other indeed.

A box round a face or an edge is much larger than what it encloses. Two edges go when one direction separates them all
the time. The height of a node over a face and its place in the face's plane are followed through the free flight, at
its beginning, middle and end. Each is nearly a parabola in time: what it may do between two of these moments is an
eighth of its second difference, twice of which is allowed for. A pair goes only when one and the same measure excludes
it all the time, by the skin and the depth at which contacts are active; so one that nothing excludes at the beginning
stays.
"""

import numpy as np

from ..jit import njit
from ..state import Flags, Floats, Indices
from .geometry import cross, dot
from .narrow_phase import DEEP, DEEP_SELF

_V2, _N2 = "float64[:, ::1]", "int32[:, ::1]"


def faces(
    pairs: Indices, places: Indices, size: Floats, x: Floats, v: Floats, part: Indices, skin: float, horizon: float
) -> Flags:  # fmt: skip
    """(p,) which of ``pairs`` (p, 2), slot and face, may meet; ``places`` (f, 4); ``x``, ``v`` (slots, 3): lines."""
    return np.asarray(_near_faces(pairs, places, size, x, v, part, skin, horizon))


def edges(
    pairs: Indices, places: Indices, size: Floats, x: Floats, v: Floats, skin: float, horizon: float
) -> Flags:  # fmt: skip
    """(p,) which of ``pairs`` (p, 2), two edges, may meet; ``places`` (e, 4); ``x``, ``v`` (slots, 3): lines."""
    return np.asarray(_near_edges(pairs, places, size, x, v, skin, horizon))


@njit("float64(float64[::1])", cache=True)
def _least(f):  # type: ignore[no-untyped-def]
    """Lower bound of what is f (3,) at beginning, middle and end."""
    return min(f[0], f[1], f[2]) - 0.25 * abs(f[0] - 2.0 * f[1] + f[2])


@njit("float64(float64[::1])", cache=True)
def _most(f):  # type: ignore[no-untyped-def]
    """Upper bound."""
    return max(f[0], f[1], f[2]) + 0.25 * abs(f[0] - 2.0 * f[1] + f[2])


@njit(
    f"boolean[::1]({_N2}, {_N2}, float64[::1], {_V2}, {_V2}, int32[::1], float64, float64)",
    cache=True,
    error_model="numpy",
)
def _near_faces(pairs, faces, size, x, v, part, skin, horizon):  # type: ignore[no-untyped-def]
    kept = np.ones(len(pairs), np.bool_)
    e, f, g, r = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    n, side = np.empty(3), np.empty(3)
    height, off = np.empty(3), np.empty((3, 3))
    for p in range(len(pairs)):
        s, face = pairs[p, 0], pairs[p, 1]
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        far = skin + (DEEP_SELF if part[s] == part[i] else DEEP) * size[face]
        for m in range(3):
            t = 0.5 * m * horizon
            for a in range(3):
                x0 = x[i, a] + t * v[i, a]
                e[a] = x[j, a] + t * v[j, a] - x0
                f[a] = x[k, a] + t * v[k, a] - x0
                r[a] = x[s, a] + t * v[s, a] - x0
                g[a] = f[a] - e[a]
            cross(n, e, f)
            length = np.sqrt(dot(n, n))
            height[m] = dot(n, r) / length
            cross(side, n, e)
            off[0, m] = -dot(side, r) / (length * np.sqrt(dot(e, e)))
            cross(side, f, n)
            off[1, m] = -dot(side, r) / (length * np.sqrt(dot(f, f)))
            for a in range(3):
                r[a] -= e[a]
            cross(side, n, g)
            off[2, m] = -dot(side, r) / (length * np.sqrt(dot(g, g)))
            if m == 0 and abs(height[0]) <= far and max(off[0, 0], off[1, 0], off[2, 0]) <= far:
                break
        else:
            kept[p] = not (
                _least(height) > far
                or _most(height) < -far
                or _least(off[0]) > far
                or _least(off[1]) > far
                or _least(off[2]) > far
            )
    return kept


@njit(f"void({_V2}, {_V2}, {_V2}, int32[::1], float64)", cache=True)
def _ends(out, x, v, ends, t):  # type: ignore[no-untyped-def]
    """Rows of ``out`` (4, 3): where the four ends are at time t."""
    for k in range(4):
        for i in range(3):
            out[k, i] = x[ends[k], i] + t * v[ends[k], i]


@njit(f"float64(float64[::1], {_V2})", cache=True, error_model="numpy")
def _nearest(out, ends):  # type: ignore[no-untyped-def]
    """``out`` (3,): from the point of a segment that is nearest to another one to the nearest point of that; its
    length, m. ``ends`` (4, 3); Ericson (2005), 5.1.9.
    """
    uu, uw, ww, ur, wr = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        u, w, r = ends[1, i] - ends[0, i], ends[3, i] - ends[2, i], ends[2, i] - ends[0, i]
        uu, uw, ww, ur, wr = uu + u * u, uw + u * w, ww + w * w, ur + u * r, wr + w * r
    area = uu * ww - uw * uw
    s = min(max((ww * ur - uw * wr) / area, 0.0), 1.0) if area > 0.0 else 0.0
    t = (uw * s - wr) / ww
    if not 0.0 <= t <= 1.0:
        t = 0.0 if t < 0.0 else 1.0
        s = min(max((ur + t * uw) / uu, 0.0), 1.0)
    square = 0.0
    for i in range(3):
        out[i] = ends[2, i] + t * (ends[3, i] - ends[2, i]) - ends[0, i] - s * (ends[1, i] - ends[0, i])
        square += out[i] * out[i]
    return np.sqrt(square)


@njit(f"boolean({_V2}, {_V2}, int32[::1], float64, float64, float64)", cache=True)
def _separated(x, v, ends, begin, end, far):  # type: ignore[no-untyped-def]
    """Whether two segments stay further apart than ``far`` from time ``begin`` to ``end``, along the direction in which
    they are nearest in between: on straight lines their distance along a fixed direction is least at either end.
    """
    at, axis = np.empty((4, 3)), np.empty(3)
    _ends(at, x, v, ends, 0.5 * (begin + end))
    length = _nearest(axis, at)
    for k in range(2):
        _ends(at, x, v, ends, end if k else begin)
        one, two = max(dot(axis, at[0]), dot(axis, at[1])), min(dot(axis, at[2]), dot(axis, at[3]))
        if not two - one > far * length:
            return False
    return True


@njit(f"boolean[::1]({_N2}, {_N2}, float64[::1], {_V2}, {_V2}, float64, float64)", cache=True, error_model="numpy")
def _near_edges(pairs, edges, size, x, v, skin, horizon):  # type: ignore[no-untyped-def]
    kept = np.ones(len(pairs), np.bool_)
    ends, at, axis, half = np.empty(4, np.int32), np.empty((4, 3)), np.empty(3), 0.5 * horizon
    for p in range(len(pairs)):
        one, two = pairs[p, 0], pairs[p, 1]
        ends[0], ends[1], ends[2], ends[3] = edges[one, 0], edges[one, 1], edges[two, 0], edges[two, 1]
        far = skin + DEEP_SELF * min(size[one], size[two])
        _ends(at, x, v, ends, 0.0)
        if _nearest(axis, at) > far:
            kept[p] = not (
                _separated(x, v, ends, 0.0, horizon, far)
                or (_separated(x, v, ends, 0.0, half, far) and _separated(x, v, ends, half, horizon, far))
            )
    return kept
