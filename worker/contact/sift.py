"""Candidates sifted: of the pairs whose boxes touch, those that come near each other indeed.

A box round a face or an edge is much larger than what it encloses. Here the height of a node over a face, its place in
the face's plane, and the distance of two edges are followed through the free flight until the next search, at its
beginning, middle and end. Each is nearly a parabola in time: what it may do between two of these moments is an eighth
of its second difference, twice of which is allowed for. A pair goes only when one and the same measure excludes it all
the time, by the skin and the depth to which a meeting looks; so one that nothing excludes at the beginning stays.
"""

import numpy as np

from ..jit import njit
from ..state import Flags, Floats, Indices
from .geometry import cross, dot
from .narrow_phase import DEEP, DEEP_SELF

_V2, _N2 = "float64[:, ::1]", "int32[:, ::1]"
_STEEPEST = 0.05
"""Sine of the angle below which edges are not sifted."""


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


@njit(f"boolean[::1]({_N2}, {_N2}, float64[::1], {_V2}, {_V2}, float64, float64)", cache=True, error_model="numpy")
def _near_edges(pairs, edges, size, x, v, skin, horizon):  # type: ignore[no-untyped-def]
    kept = np.ones(len(pairs), np.bool_)
    u, w, r, n = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    apart, along, across = np.empty(3), np.empty(3), np.empty(3)
    for p in range(len(pairs)):
        one, two = pairs[p, 0], pairs[p, 1]
        a, b, c, d = edges[one, 0], edges[one, 1], edges[two, 0], edges[two, 1]
        flat, long, wide = 1.0, 0.0, 0.0
        far = skin + DEEP_SELF * min(size[one], size[two])
        for m in range(3):
            t = 0.5 * m * horizon
            for i in range(3):
                x0 = x[a, i] + t * v[a, i]
                z0 = x[c, i] + t * v[c, i]
                u[i], w[i], r[i] = x[b, i] + t * v[b, i] - x0, x[d, i] + t * v[d, i] - z0, z0 - x0
            cross(n, u, w)
            uu, uw, ww, ur, wr, area = dot(u, u), dot(u, w), dot(w, w), dot(u, r), dot(w, r), dot(n, n)
            sine = np.sqrt(area / (uu * ww))
            flat = min(flat, sine)
            apart[m] = dot(n, r) / np.sqrt(area)
            along[m], across[m] = (ww * ur - uw * wr) / area, (uw * ur - uu * wr) / area
            long, wide = max(long, 1.0 / (sine * np.sqrt(uu))), max(wide, 1.0 / (sine * np.sqrt(ww)))
            if not flat > _STEEPEST:
                break
            if m == 0 and abs(apart[0]) <= far:
                beside = max(-along[0], along[0] - 1.0) > skin * long or max(-across[0], across[0] - 1.0) > skin * wide
                if not beside:
                    break
        else:
            kept[p] = not (
                _least(apart) > far
                or _most(apart) < -far
                or _least(along) > 1.0 + skin * long
                or _most(along) < -skin * long
                or _least(across) > 1.0 + skin * wide
                or _most(across) < -skin * wide
            )
    return kept
