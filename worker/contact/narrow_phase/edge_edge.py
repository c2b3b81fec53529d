"""Narrow phase of sharp edges: finds the contacts of the next step and deactivates distant pairs.

Two edges are in contact where they cross, except near their ends, because an end is a node, and nodes are in contact
with faces.
"""

import numpy as np

from ...kernels.jit import njit, prefetch, types
from ...model.cache_lines import LINE
from ..geometry import VECTOR, at, beyond, cross, distance, dot, lowest_height, minus, plus, segments
from .tables import CONTACT_ROWS, DEEP, DEEP_SELF, EDGES, NEAR, PAIRS, STEP, bonded, needed

_PARALLEL = 1e-3
"""Sine of the smallest angle between two edges in edge-edge contact. At smaller angles only nodes and faces are in
contact, and two nearly parallel ridges could penetrate by the sine of the angle times the length of an edge. At the
smallest angle the crossing point is accurate to 1e-10 of the length of an edge."""
_END = 1e-4
"""Fraction of the length of an edge, at each end, in which the edge has no edge-edge contact, because the node at the
end is in contact with faces. Chosen value: a tenth of MARGIN, the distance by which the foot of a node may lie outside
of a face. Therefore, when an edge slides over a rim, edge-edge contact ends only after the contact of the node has
begun."""
_FLUSH = 0.05
"""Sine of the largest angle by which the normal of a contact may lie outside of the sector between the normals of the
two faces. If two faces lie on each other, their edges cross with normals slightly outside of the sector between the
normals of the two faces. Chosen value, by tests of fragments that are pressed together (docs/theory/contact.md, "Face
on face")."""
_ROUND = 0.01
"""Tolerance for round-off, as a fraction of the length of an edge. The tolerance is added to the distance of
contact."""
_WORTH = 0.02
"""Smallest slack with which a pair is deactivated, as a fraction of the length of an edge. A pair with less slack is
tested in every step, which takes less time than the computation of its slack."""
_STRETCH = 0.1
"""Largest relative motion of the ends of two edges, divided by the lengths of the edges. The bounds of ``beyond_ends``
are valid up to the largest relative motion."""
_SPARE = 0.006
"""Smallest slack with which a pair is deactivated because the edges cross beyond an end, as a fraction of the length of
an edge (compare _WORTH). Chosen value: in shattering glass the ends of edges depart from their short lines by a fifth
of the smallest slack."""
_SOON, _NEXT = 16, 8
"""Prefetch distances, in pairs of edges: for the node numbers of the ends of edges, and for the positions of the
ends."""
_X2, _V2, _N2 = "float64[:, :]", "float64[:, ::1]", "int32[:, ::1]"
_SECTOR = f"Tuple((float64, {VECTOR}, {VECTOR}))"
_I, _F, _N1 = types.int64, types.float64, types.int32[::1]


@njit(f"{_SECTOR}({VECTOR}, {_X2}, {_V2}, {_N2}, int64, float64)", cache=True, error_model="numpy")
def _sector(u, x, v, edges, e, h):  # type: ignore[no-untyped-def]
    """Returns three values of edge e after a time ``h``: the sense of rotation from the normal of its first face to
    that of its second face (0 for an edge that is not convex), and the cross products of u with the two normals.
    """
    a, c, d = edges[e, 0], edges[e, 2], edges[e, 3]
    to, fro = minus(at(x, c), at(x, a)), minus(at(x, d), at(x, a))
    to, fro = beyond(to, h, minus(at(v, c), at(v, a))), beyond(fro, h, minus(at(v, d), at(v, a)))
    one, two = cross(u, to), cross(fro, u)
    if not dot(one, fro) < 0.0:
        return 0.0, one, two
    return np.sign(dot(cross(one, two), u)), cross(u, one), cross(u, two)


@njit(f"boolean({_SECTOR}, {VECTOR}, float64)", cache=True)
def _points_out(sector, n, sign):  # type: ignore[no-untyped-def]
    """Returns True if the vector ``sign`` n lies between the normals of the two faces of a convex edge (``_sector``),
    or within _FLUSH of one of these normals. n is perpendicular to the edge. The tolerance _FLUSH is needed if faces
    lie on each other.
    """
    sense, one, two = sector
    along = sense * sign
    least, most = -_FLUSH * np.sqrt(dot(one, one)), _FLUSH * np.sqrt(dot(two, two))
    return sense != 0.0 and along * dot(one, n) >= least and along * dot(two, n) <= most


@njit(
    f"float64({VECTOR}, {_X2}, {_V2}, int64, int64, int64, int64, float64, float64, float64)",
    cache=True,
    error_model="numpy",
)
def _apart(m, x, v, a, b, c, d, s, t, h):  # type: ignore[no-untyped-def]
    """Distance along m from point s of ab to point t of cd, after a time ``h``, m."""
    gap = 0.0
    for k in range(3):
        near = (1.0 - s) * (x[a, k] + h * v[a, k]) + s * (x[b, k] + h * v[b, k])
        gap += m[k] * ((1.0 - t) * (x[c, k] + h * v[c, k]) + t * (x[d, k] + h * v[d, k]) - near)
    return gap


@njit(f"float64({VECTOR}, {VECTOR}, {VECTOR})", cache=True)
def _volume(u, w, r):  # type: ignore[no-untyped-def]
    """Returns u x w . r, which is six times the volume, m^3, between two edges; the value changes sign when the lines
    of the edges cross.
    """
    return dot(cross(u, w), r)


@njit(f"float64({_V2}, int64, int64, int64, int64)", cache=True)
def _fastest(course, a, b, c, d):  # type: ignore[no-untyped-def]
    """Returns the largest speed of an end of ab relative to an end of cd, m/s."""
    p, q, r, s = at(course, a), at(course, b), at(course, c), at(course, d)
    return max(distance(p, r), distance(p, s), distance(q, r), distance(q, s))


@njit(f"float64({VECTOR}, {VECTOR}, {VECTOR}, float64, float64)", cache=True, error_model="numpy")
def beyond_ends(u, w, r, s, t):  # type: ignore[no-untyped-def]
    """Returns a bound of the motion of the ends of edge u relative to the ends of edge w, m; up to this motion the
    edges cross beyond an end of u or w. The result is 0 if the lines of the edges cross within both edges. At present
    the lines cross at ``s`` of u and ``t`` of w; ``r``: vector from the beginning of u to the beginning of w.

    Derivation: the edges cross beyond an end of edge a, at a fraction S of its length from this end; let k be the
    vector from this end to an end of the other edge b, and n = a x b. Then (k x b) . n = -S n . n, and the edges cross
    there while this number is negative. If ends move by h relative to each other, a and b change by 2 h, and k changes
    by h. Then n changes by at most B h, and k x b by at most A h, with the bounds A and B in the code, if h is a small
    fraction (_STRETCH) of |a| and |b|.
    """
    past_s, past_t, uu, ww = max(-s, s - 1.0), max(-t, t - 1.0), dot(u, u), dot(w, w)
    share, a, b, k = past_s, u, w, r if s < 0.0 else minus(r, u)
    if not past_s > 0.0 or (past_t > 0.0 and past_t * past_t * ww > past_s * past_s * uu):
        back = r if t < 0.0 else plus(r, w)
        share, a, b, k = past_t, w, u, (-back[0], -back[1], -back[2])
    if not share > 0.0:
        return 0.0
    n, across, other = cross(a, b), cross(k, b), plus(k, b)
    long_a, long_b, near = np.sqrt(dot(a, a)), np.sqrt(dot(b, b)), np.sqrt(min(dot(k, k), dot(other, other)))
    A = (1.0 + 2.0 * _STRETCH) * long_b + 2.0 * near
    B = 2.0 * long_b + 2.0 * (1.0 + 2.0 * _STRETCH) * long_a
    nn = dot(n, n)
    p = np.sqrt(dot(across, across)) * B + np.sqrt(nn) * A
    return min(2.0 * share * nn / (p + np.sqrt(p * p + 4.0 * A * B * share * nn)), _STRETCH * min(long_a, long_b))


@njit(types.float64(types.float64[:, :], EDGES, types.int64), cache=True, error_model="numpy")
def _deep(x, edges, e):  # type: ignore[no-untyped-def]
    """Greatest depth of a contact of edge e, m; it is at most DEEP times the lowest height of the tets of the faces of
    the edge.
    """
    least = DEEP_SELF * edges.size[e]
    if not edges.deep[e] > least:
        return edges.deep[e]
    a, b, c, d = edges.corners[e, 0], edges.corners[e, 1], edges.corners[e, 2], edges.corners[e, 3]
    low = min(lowest_height(x, a, b, c, edges.corners[e, 4]), lowest_height(x, a, b, d, edges.corners[e, 5]))
    return max(min(DEEP * low, edges.deep[e]), least)


@njit(f"boolean({_N2}, int64, int64)", cache=True)
def _opposite(edges, one, two):  # type: ignore[no-untyped-def]
    """Returns True if an edge joins the third nodes of the two faces of another edge; the two edges are then opposite
    edges of one tet.
    """
    a, b, c, d = edges[one, 2], edges[one, 3], edges[two, 0], edges[two, 1]
    return (a == c and b == d) or (a == d and b == c)


# Edges ab and cd at the moment tau dt at which their lines cross, x = x(n) + tau (x(n+1) - x(n)); tau = 1 if they do
# not cross in the step. u = b - a, w = d - c, r = c - a.
#
#               d                 point s of ab: a + s u       s = ((w.w)(u.r) - (u.w)(w.r)) / A
#              /                  point t of cd: c + t w       t = ((u.w)(u.r) - (u.u)(w.r)) / A
#     a ------x------- b          A = (u.u)(w.w) - (u.w)^2 = |u x w|^2
#            /
#           c                     m = u x w / |u x w|;  gap = m . (c + t w - a - s u), linear in the velocities:
#                                 weights (1 - t, t, s - 1, -s) of c, d, a, b
#
#           m (or -m)             The normal has to point out of both bodies (Gauss map of convex edges): n1, n2 are the
#      n1   |   n2                normals of the two faces of an edge, and m lies between them to within _FLUSH, as
#        \  |  /                  -m does between those of the other edge
#     ____\_|_/____               (docs/theory/contact.md, "Which point" and "Sharp edges").
#    face 1   face 2
#
# Conditions of a contact, in the order of the tests in edge_edge:
# 1. Both edges exist (the two ends of an edge that vanished are one node) and admit contact, and they are not the
#    opposite edges of one tet. Otherwise the pair is deactivated until that changes.
# 2. No bond ties all four nodes.
# 3. The lines are not parallel: A > _PARALLEL^2 (u.u)(w.w).
# 4. The edges cross within both edges: _END <= s, t <= 1 - _END.
# 5. With one sign of m the gap is at most NEAR of an edge at the end of the step, and at its beginning at least minus
#    the depth of the edges.
# 6. The normal for this sign points out of both bodies (_points_out).
# 7. A penetration is not deeper than the present shape of the tets allows (_deep).


@njit(
    types.int64(
        types.int32[:, ::1], types.float64[::1], types.float64[::1], types.float64[::1], types.boolean[::1], _N1, _F, _I
    ),
    cache=True,
)
def _due(rows, until, speed, left, fresh, active, end, many):  # type: ignore[no-untyped-def]
    """Selects the pairs to be tested among the first ``many`` of the pairs ``rows``. Writes them to ``active``, and
    returns their number.
    """
    n = 0
    for p in range(many):
        one, two = rows[p, 0], rows[p, 1]
        active[n] = p
        n += fresh[one] | fresh[two] | (not until[p] > left[one] + left[two] + speed[p] * end)
    return n


@njit(
    f"Tuple((float64, {VECTOR}, {VECTOR}, {VECTOR}))({_X2}, {_X2}, int64, int64, int64, int64)",
    cache=True,
    forceinline=True,
)
def _crossing(x, ahead, a, b, c, d):  # type: ignore[no-untyped-def]
    """Returns the fraction tau of the step after which the lines ab and cd cross; 1 if they do not cross in the step.
    Also returns the vectors u, w and r at this time.
    """
    u0, w0, r0 = minus(at(x, b), at(x, a)), minus(at(x, d), at(x, c)), minus(at(x, c), at(x, a))
    u, w = minus(at(ahead, b), at(ahead, a)), minus(at(ahead, d), at(ahead, c))
    r = minus(at(ahead, c), at(ahead, a))
    before, after = _volume(u0, w0, r0), _volume(u, w, r)
    if not before * after < 0.0:
        return 1.0, u, w, r
    share = before / (before - after)
    return share, beyond(u0, share, minus(u, u0)), beyond(w0, share, minus(w, w0)), beyond(r0, share, minus(r, r0))


@njit(
    types.UniTuple(_I, 2)(CONTACT_ROWS, _I, PAIRS, EDGES, STEP, types.float64[:, ::1], types.float64, _I, _I),  # type: ignore[no-untyped-call]
    cache=True,
    error_model="numpy",
)
def edge_edge(out, base, pairs, edges, step, course, end, first, stop):  # type: ignore[no-untyped-def]
    """Writes the contacts of the pairs of edges from ``first`` to ``stop`` to the rows of ``out`` from ``base + first``
    on. Writes the tested pairs to ``pairs.active`` from ``first`` on. Returns the number of contacts, and the number of
    tested pairs.

    ``course`` (slots, 3): velocities of the reference motions, m/s; ``end``: time of the end of the step, s after the
    search. The comments have the numbers of the conditions in the drawing.
    """
    rows, until, speed, active = pairs.rows[first:], pairs.until[first:], pairs.speed[first:], pairs.active[first:]
    meets, fresh, corners, size, left = edges.meets, edges.fresh, edges.corners, edges.size, edges.left
    nodes, weights, normals, wanted = out.nodes, out.weights, out.normals, out.wanted
    x, v, ahead, dt, n, tested = step.x, step.v, step.ahead, step.dt, base + first, 0
    due = _due(rows, until, speed, left, fresh, active, end, stop - first)
    for q in range(due):
        p, soon, later = active[q], active[min(q + _NEXT, due - 1)], active[min(q + _SOON, due - 1)]
        for k in range(2):
            prefetch(corners, 6 * rows[later, k])
            prefetch(x, LINE * corners[rows[soon, k], 0])
            prefetch(x, LINE * corners[rows[soon, k], 1])
        one, two = rows[p, 0], rows[p, 1]
        if fresh[one] or fresh[two]:
            until[p], speed[p] = -np.inf, np.nan
        a, b, c, d = corners[one, 0], corners[one, 1], corners[two, 0], corners[two, 1]
        if not (meets[one] and meets[two]) or a == b or c == d or _opposite(corners, one, two):  # condition 1
            until[p], speed[p] = np.inf, 0.0
            continue
        active[tested] = first + p
        tested += 1
        if len(step.tied) > 0 and bonded(step, a, b, c, d):  # condition 2: no bond of all four nodes
            continue
        known = not np.isnan(until[p])
        if known:  # deactivate the pair while it cannot be in contact: slack > left_1 + left_2 + U t (pairs.py)
            if np.isnan(speed[p]):
                speed[p] = _fastest(course, a, b, c, d)
            slack = segments(at(ahead, a), at(ahead, b), at(ahead, c), at(ahead, d))
            slack -= _ROUND * max(size[one], size[two]) + min(edges.deep[one], edges.deep[two])
            until[p] = slack - left[one] - left[two] + speed[p] * end if slack > _WORTH * size[one] else np.nan
        share, u, w, r = _crossing(x, ahead, a, b, c, d)
        uu, uw, ww, ur, wr = dot(u, u), dot(u, w), dot(w, w), dot(u, r), dot(w, r)
        area = uu * ww - uw * uw
        if not area > _PARALLEL * _PARALLEL * uu * ww:  # condition 3: not parallel
            continue
        s, t = (ww * ur - uw * wr) / area, (uw * ur - uu * wr) / area
        if not (min(s, t) >= _END and max(s, t) <= 1.0 - _END):  # condition 4: crossing within both edges
            if known and share == 1.0 and np.isnan(until[p]):
                slack = beyond_ends(u, w, r, s, t)
                if slack > _SPARE * size[one]:
                    until[p] = slack - left[one] - left[two] + speed[p] * end
            continue
        h, m, length = share * dt, cross(u, w), np.sqrt(area)
        m = m[0] / length, m[1] / length, m[2] / length
        gap0, gap1 = _apart(m, x, v, a, b, c, d, s, t, 0.0), _apart(m, x, v, a, b, c, d, s, t, dt)
        near, deep = NEAR * min(size[one], size[two]), min(edges.deep[one], edges.deep[two])
        if (gap1 > near or gap0 < -deep) and (-gap1 > near or -gap0 < -deep):  # condition 5: the gap, for either sign
            continue
        sector = _sector(u, x, v, corners, one, h)
        sign = 1.0 if _points_out(sector, m, 1.0) else -1.0
        if sign < 0.0 and not _points_out(sector, m, -1.0):  # condition 6: the normal, first body
            continue
        gap0, gap1 = sign * gap0, sign * gap1
        if gap1 > near or gap0 < -deep:  # condition 5: the gap, for this sign
            continue
        if not _points_out(_sector(w, x, v, corners, two, h), m, -sign):  # condition 6: the normal, second body
            continue
        if gap0 < 0.0 and gap0 < -min(_deep(x, edges, one), _deep(x, edges, two)):  # condition 7: the greatest depth
            continue
        nodes[n, 0], nodes[n, 1], nodes[n, 2], nodes[n, 3] = c, d, a, b
        weights[n, 0], weights[n, 1], weights[n, 2], weights[n, 3] = 1.0 - t, t, s - 1.0, -s
        rate = 0.0  # normal velocity n . sum(w_k v_k)
        for k in range(3):
            normals[n, k] = sign * m[k]
            rate += normals[n, k] * ((1.0 - t) * v[c, k] + t * v[d, k] - (1.0 - s) * v[a, k] - s * v[b, k])
        wanted[n] = rate + needed(gap0, gap1, rate, step.give, dt)
        out.friction[n], out.pair[n] = step.mu[step.part[a], step.part[c]], -1
        n += 1
    return n - base - first, tested
