"""Which candidates meet in the step ahead, and where: one row a meeting, of four nodes, their weights and a normal.

The gap is that of the end of the step as it would come without contact, positive outside; it is a linear function of
the velocities, dt n . sum(w_k v_k) plus a constant, with the weights w of ``weights``: 1 for the node and minus the
area coordinates of the point of the face (the defence node, Zhong 1993), or the two ends of two edges. The point is the
one where the node passes the plane of the face, so that a node that slides from facet to facet is handed over.
"""

from dataclasses import dataclass

import numpy as np

from ..jit import njit
from ..state import Floats, Indices

NEAR = 0.02
"""Of the size of a face: a gap that is watched although it does not close by itself."""
DEEP = 0.25
"""Of the size of a face: deepest penetration that is still taken for one, not for the back of a thin body."""
DEEP_SELF = 0.05
"""The same on one part, whose nodes lie behind its own faces anyway."""
_TOUCHING = 1e-3
"""Of the size of a face: deeper than this, a node is held by the nearest face only."""
_MARGIN = 1e-3
"""Of the area coordinates: how far outside of a face its point may lie."""
PUSH_OUT = 0.1
"""Largest share of a penetration that is taken back in a step, and of the speed of closing that is given back for it;
nothing while contact has no energy to give back (``account.Account``)."""
FACING = 0.1
"""A node looks at a face when the cosines of the face's normal and those of its own faces have a mean below this, and
their mean less their deviation comes below minus this."""
_PARALLEL = 0.05
"""Sine of the angle below which edges are left to nodes and faces."""


@dataclass
class Meetings:
    """Room for meetings, and how many there are."""

    nodes: Indices
    """(room, 4) places of nodes."""
    weights: Floats
    """(room, 4)."""
    normals: Floats
    """(room, 3) unit, out of the face or out of the first edge's body."""
    wanted: Floats
    """(room,) n . sum(w_k v_k) must not be below this, m/s."""
    friction: Floats
    """(room,) Coulomb's coefficient."""
    pair: Indices
    """(room,) which candidate of a node and a face it was; -1 for edges."""
    n: int = 0

    @classmethod
    def room(cls, n: int) -> "Meetings":
        """Room for ``n`` meetings."""
        rows, numbers = np.empty((n, 4), np.int32), np.empty(n, np.int32)
        return cls(rows, np.empty((n, 4)), np.empty((n, 3)), np.empty(n), np.empty(n), numbers)


_V2, _N2 = "float64[:, ::1]", "int32[:, ::1]"
_OUT = f"{_N2}, {_V2}, {_V2}, float64[::1], float64[::1], int32[::1]"
_IN = f"{_N2}, int32[::1], {_V2}, {_V2}, int32[::1], {_V2}, float64, float64"


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
    if not min(b[0], b[1], b[2]) >= -_MARGIN:
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


@njit("void(int32[::1], int32[::1], int32[:, ::1], int64)", cache=True)
def chain(first, following, pairs, begin):  # type: ignore[no-untyped-def]
    """Hangs the pairs of node and face from row ``begin`` on into the chains of their nodes: ``first`` (nodes,), and
    ``following`` (p,) the pair after each, -1 for none.
    """
    for p in range(begin, len(pairs)):
        following[p], first[pairs[p, 0]] = first[pairs[p, 0]], p


@njit(
    f"boolean({_V2}, int64, {_N2}, {_N2}, float64[::1], boolean[::1], int32[::1], int32[::1], int32[::1], float64)",
    cache=True,
    error_model="numpy",
)
def _outside(x, p, pairs, faces, size, exposed, first, following, part, depth):  # type: ignore[no-untyped-def]
    """Whether the node of pair ``p``, ``depth`` below its face, is nearer to the front of another face of that part.

    Then it is beside an acute edge and not in the body: the nearest face decides on which side a node is. Only faces
    within the share of their size that every list of candidates has are asked.
    """
    b, m, s = np.empty(3), np.empty(3), pairs[p, 0]
    q = first[s]
    while q >= 0:
        f = pairs[q, 1]
        q = following[q]
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        if not exposed[f] or part[i] != part[faces[pairs[p, 1], 0]]:
            continue
        away = height(m, x, s, i, j, k)
        if not away > 0.0:
            continue
        if not foot(b, x, x, s, i, j, k, 0.0):
            away = min(off(x, s, i, j), off(x, s, j, k), off(x, s, k, i))
        if away < min(depth, (DEEP_SELF if part[s] == part[i] else DEEP) * size[f]):
            return True
    return False


@njit("float64(float64, float64, float64, float64, float64)", cache=True)
def needed(gap0, gap1, speed, give, dt):  # type: ignore[no-untyped-def]
    """By how much the normal speed must rise, m/s: not to pass, and when that has happened already, not deeper; a
    share ``give`` of the penetration is taken back (PUSH_OUT).
    """
    back = give * min(max(-gap0, 0.0) / dt, max(-speed, 0.0))
    return (min(gap0, 0.0) - gap1) / dt + back


@njit(f"UniTuple(float64, 2)({_V2}, int64, float64[::1])", cache=True)
def facing(out, s, m):  # type: ignore[no-untyped-def]
    """Mean, and mean less deviation, of the cosines of m and the normals of the faces of node s; -1 for one without
    faces, which looks at any.
    """
    mean, square, length = 0.0, 0.0, 0.0
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        mean += out[s, a] * m[a]
        length += out[s, a] * out[s, a]
        square += out[s, 3 + a] * m[a] * m[a] + 2.0 * out[s, 6 + a] * m[b] * m[c]
    if length == 0.0:
        return -1.0, -1.0
    return mean, mean - np.sqrt(max(square - mean * mean, 0.0))


@njit(f"boolean({_V2}, int64, float64[::1])", cache=True)
def _looks_at(out, s, m):  # type: ignore[no-untyped-def]
    """Whether node s looks at a face of normal m."""
    mean, least = facing(out, s, m)
    return mean <= FACING and least <= -FACING


@njit(
    f"int64({_OUT}, int64, {_N2}, float64[::1], int64[::1], boolean[::1], {_V2}, boolean[::1], int32[::1], int32[::1], "
    f"float64[::1], int32[::1], {_V2}, boolean[::1], {_IN})",
    cache=True,
    error_model="numpy",
)
def node_face(  # type: ignore[no-untyped-def]
    nodes, weights, normals, wanted, friction, pair, n, faces, size, ids, exposed, out, on_surface, first, following,
    deepest, holder, planes, known, pairs, some, x, v, part, mu, give, dt,
):  # fmt: skip
    """Nodes that pass a face, from row ``n`` on; returns the new number of rows.

    ``out`` (nodes, 9): means of n and of n n (xx, yy, zz, yz, zx, xy) of the outward normals of a node's faces. A node
    meets a face that it looks at: the rim of a bar not the side of another one of the same width, the surface under a
    block that slides not its front, which stands across. Zero for a node without faces, which meets any.

    ``pairs`` (p, 2): node and face, in chains by ``first`` and ``following`` (``chain``); ``faces`` (f, 4), the node
    opposite last, with their ``ids``; ``some`` of the pairs are looked at, those of faces that are ``exposed`` and of
    nodes ``on_surface``; ``deepest`` and ``holder`` (nodes,) are room to work in; ``mu`` (parts, parts). ``planes``
    (f, 3) get the normals of the faces at the end of the step, of those that are asked for: ``known`` (f,).
    """
    b, m = np.empty(3), np.empty(3)
    ahead = x + dt * v
    holder[:] = -1
    for p in some:
        s, f = pairs[p, 0], pairs[p, 1]
        if not exposed[f] or not on_surface[s]:
            continue
        i, j, k, d = faces[f, 0], faces[f, 1], faces[f, 2], faces[f, 3]
        if not known[f]:
            height(planes[f], ahead, s, i, j, k)
            known[f] = True
        gap1 = 0.0
        for a in range(3):
            m[a] = planes[f, a]
            gap1 += m[a] * (ahead[s, a] - ahead[i, a])
        if not gap1 <= NEAR * size[f]:
            continue
        if not _looks_at(out, s, m):
            continue
        gap0 = height(b, x, s, i, j, k)
        if not gap0 >= -(DEEP_SELF if part[s] == part[i] else DEEP) * size[f]:
            continue
        if gap0 < 0.0:
            altitude = 0.0
            for a in range(3):
                altitude -= b[a] * (x[d, a] - x[i, a])
            if gap0 < -0.5 * altitude:
                continue
        tau = 0.0
        if gap0 > 0.0:
            tau = 1.0 if gap1 >= 0.0 else gap0 / (gap0 - gap1)
        if not foot(b, x, ahead, s, i, j, k, tau):
            continue
        at = n
        if gap0 < -_TOUCHING * size[f]:
            row = holder[s]
            if row >= 0:
                same = gap0 == deepest[s] and ids[f] < ids[pairs[pair[row], 1]]
                if not (gap0 > deepest[s] or same):
                    continue
            if _outside(x, p, pairs, faces, size, exposed, first, following, part, -gap0):
                continue
            at = row if row >= 0 else n
            deepest[s], holder[s] = gap0, at
        n += at == n
        nodes[at, 0], nodes[at, 1], nodes[at, 2], nodes[at, 3] = s, i, j, k
        weights[at, 0] = 1.0
        speed = 0.0
        for a in range(3):
            weights[at, a + 1] = -b[a]
            normals[at, a] = m[a]
            speed += m[a] * (v[s, a] - (b[0] * v[i, a] + b[1] * v[j, a] + b[2] * v[k, a]))
        wanted[at] = speed + needed(gap0, gap1, speed, give, dt)
        friction[at], pair[at] = mu[part[s], part[i]], p
    return n


@njit("float64(float64[::1], float64[::1])", cache=True)
def dot(a, b):  # type: ignore[no-untyped-def]
    """a . b of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit("void(float64[::1], float64[::1], float64[::1])", cache=True)
def cross(out, a, b):  # type: ignore[no-untyped-def]
    """``out`` (3,): a x b."""
    out[0], out[1], out[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(f"float64({_V2}, float64[::1], {_V2}, {_V2}, {_N2}, int64, float64)", cache=True, error_model="numpy")
def _sides(turned, u, x, v, edges, e, h):  # type: ignore[no-untyped-def]
    """Rows of ``turned``: u times the normals of the two faces of edge e, along u, after a time ``h``.

    Returns the sense in which the first normal turns to the second one, 0 where the edge is not convex.
    """
    a, c, d = edges[e, 0], edges[e, 2], edges[e, 3]
    for k in range(3):
        turned[2, k] = x[c, k] - x[a, k] + h * (v[c, k] - v[a, k])
        turned[3, k] = x[d, k] - x[a, k] + h * (v[d, k] - v[a, k])
    cross(turned[0], u, turned[2])
    cross(turned[1], turned[3], u)
    if not dot(turned[0], turned[3]) < 0.0:
        return 0.0
    cross(turned[2], turned[0], turned[1])
    sense = np.sign(dot(turned[2], u))
    cross(turned[2], u, turned[0])
    cross(turned[3], u, turned[1])
    return sense


@njit(f"boolean({_V2}, float64, float64[::1], float64)", cache=True)
def _between(turned, sense, n, sign):  # type: ignore[no-untyped-def]
    """Whether ``sign`` n, square to a convex edge, points out between the normals of its two faces (``_sides``)."""
    along = sense * sign
    return sense != 0.0 and along * dot(turned[2], n) >= 0.0 and along * dot(turned[3], n) <= 0.0


@njit(
    f"float64(float64[::1], {_V2}, {_V2}, int64, int64, int64, int64, float64, float64, float64)",
    cache=True,
    error_model="numpy",
)
def _apart(m, x, v, a, b, c, d, s, t, h):  # type: ignore[no-untyped-def]
    """How far point t of cd lies beyond point s of ab along m after a time ``h``, m."""
    gap = 0.0
    for k in range(3):
        near = (1.0 - s) * (x[a, k] + h * v[a, k]) + s * (x[b, k] + h * v[b, k])
        gap += m[k] * ((1.0 - t) * (x[c, k] + h * v[c, k]) + t * (x[d, k] + h * v[d, k]) - near)
    return gap


@njit("float64(float64[::1], float64[::1], float64[::1])", cache=True)
def _volume(u, w, r):  # type: ignore[no-untyped-def]
    """u x w . r: six times the volume, m^3, between two edges; it changes sign when their lines cross."""
    return (u[1] * w[2] - u[2] * w[1]) * r[0] + (u[2] * w[0] - u[0] * w[2]) * r[1] + (u[0] * w[1] - u[1] * w[0]) * r[2]


@njit(f"int64({_OUT}, int64, {_N2}, float64[::1], boolean[:, ::1], {_IN})", cache=True, error_model="numpy")
def edge_edge(  # type: ignore[no-untyped-def]
    nodes, weights, normals, wanted, friction, pair, n, edges, size, exposed, pairs, some, x, v, part, mu, give, dt,
):  # fmt: skip
    """Edges that pass an edge, from row ``n`` on; returns the new number of rows. They meet where they cross.

    ``pairs`` (p, 2): two edges, of which ``some`` are looked at; ``edges`` (e, 4): records.Edges, which meet others
    when both of their faces are ``exposed`` (e, 2).
    """
    u, w, r, m = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    u0, w0, r0 = np.empty(3), np.empty(3), np.empty(3)
    turned = np.empty((4, 3))
    ahead = x + dt * v
    for p in some:
        one, two = pairs[p, 0], pairs[p, 1]
        if not (exposed[one, 0] and exposed[one, 1] and exposed[two, 0] and exposed[two, 1]):
            continue
        a, b, c, d = edges[one, 0], edges[one, 1], edges[two, 0], edges[two, 1]
        for k in range(3):
            u0[k], w0[k], r0[k] = x[b, k] - x[a, k], x[d, k] - x[c, k], x[c, k] - x[a, k]
            u[k], w[k], r[k] = ahead[b, k] - ahead[a, k], ahead[d, k] - ahead[c, k], ahead[c, k] - ahead[a, k]
        start, end = _volume(u0, w0, r0), _volume(u, w, r)
        share = 1.0
        if start * end < 0.0:
            share = start / (start - end)
            for k in range(3):
                u[k], w[k] = u0[k] + share * (u[k] - u0[k]), w0[k] + share * (w[k] - w0[k])
                r[k] = r0[k] + share * (r[k] - r0[k])
        uu, uw, ww, ur, wr = dot(u, u), dot(u, w), dot(w, w), dot(u, r), dot(w, r)
        area = uu * ww - uw * uw
        if not area > _PARALLEL * _PARALLEL * uu * ww:
            continue
        s, t = (ww * ur - uw * wr) / area, (uw * ur - uu * wr) / area
        if not (min(s, t) >= 0.0 and max(s, t) <= 1.0):
            continue
        h = share * dt
        cross(m, u, w)
        for k in range(3):
            m[k] /= np.sqrt(area)
        gap0, gap1 = _apart(m, x, v, a, b, c, d, s, t, 0.0), _apart(m, x, v, a, b, c, d, s, t, dt)
        near, deep = NEAR * min(size[one], size[two]), DEEP_SELF * min(size[one], size[two])
        if (gap1 > near or gap0 < -deep) and (-gap1 > near or -gap0 < -deep):
            continue
        sense, sign = _sides(turned, u, x, v, edges, one, h), 1.0
        if not _between(turned, sense, m, 1.0):
            sign = -1.0
            if not _between(turned, sense, m, -1.0):
                continue
        gap0, gap1 = sign * gap0, sign * gap1
        if gap1 > near or gap0 < -deep:
            continue
        sense = _sides(turned, w, x, v, edges, two, h)
        if not _between(turned, sense, m, -sign):
            continue
        for k in range(3):
            m[k] *= sign
        nodes[n, 0], nodes[n, 1], nodes[n, 2], nodes[n, 3] = c, d, a, b
        weights[n, 0], weights[n, 1], weights[n, 2], weights[n, 3] = 1.0 - t, t, s - 1.0, -s
        speed = 0.0
        for k in range(3):
            normals[n, k] = m[k]
            speed += m[k] * ((1.0 - t) * v[c, k] + t * v[d, k] - (1.0 - s) * v[a, k] - s * v[b, k])
        wanted[n] = speed + needed(gap0, gap1, speed, give, dt)
        friction[n], pair[n] = mu[part[a], part[c]], -1
        n += 1
    return n
