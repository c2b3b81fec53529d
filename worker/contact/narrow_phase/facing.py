"""Tests that determine on which side of a body a node is. The tests use the orientation of nodes to faces, and also
treat nodes beside a convex edge, and nodes in front of another face at the edge (docs/theory/contact.md, "Which point"
and "Beside a free edge").
"""

import numpy as np

from ...kernels.jit import njit, types
from ..geometry import MARGIN, VECTOR, at, dot, foot, height, minus, off
from .tables import DEEP, DEEP_SELF, FACES, NEAR, PAIRS, STEP

TOUCHING = 1e-3
"""Ratio of the depth of a node to the size of a face. If a node is inside of a part by more than this ratio, it has
contact only with the nearest face of that part."""
FACING = 0.1
"""A node faces a face when the cosines between the normal of the face and the normals of the node's own faces have a
mean minus deviation below -FACING, and either a mean below FACING, or the node's own faces rise from the face by a mean
slope whose sine exceeds FACING. With this definition of facing, the lowest corner of a single tet faces the plane below
it for any mean of its three normals."""
_SOME = 0.25
"""A node of another part that passes a face from outside has contact with the face when the mean minus deviation of
the cosines is below -_SOME, because then at least one face of the node faces the face. If no cosine is negative,
mean minus deviation is at least (1 - sqrt(2)) / 2 = -0.207."""
RIM = 0.01
"""Largest depth, as a fraction of the size of a face, at which a node is beside a convex edge. The node faces both
faces of the edge, slides along one of them, and is not deeper below that face than this. Chosen value: twice the
penetration of a sharp edge that slides along another edge, 1e-3 to 4e-3, at the moment when the end of the edge reaches
the other edge. A node can be deeper than this fraction below a face at a rim because edges have no contact at their
ends."""
_SLIDES = 2e-3
"""Fraction of the size of a face. A node that slides along a face approaches the face by less than this fraction of its
size in a step. A node that approaches faster counts as beside the edge only up to the depth TOUCHING; otherwise the
contact of a fast projectile would be detected one step late (test_hard_contact). Chosen value: twice the fastest
approach observed in sliding."""
_BEHIND = 0.1
"""Limit, as a fraction of the size of a face, for the sum of the depths of the corners of a face behind a neighbouring
face. If the sum is above this limit, the common edge is convex. Chosen value: below the sum for an angle of 25 degrees
between the faces, and above round-off."""
_OVER = 0.1
"""Limit for the component, along a face, of the mean direction from a node to the midpoints of its own faces. If the
component is above this limit, the faces of the node reach over that face. The faces of a blunt edge have a smaller
component. Chosen value: a third of the component for the corner of a cube."""
_F, _VECTOR = types.float64, types.UniTuple(types.float64, 3)  # type: ignore[no-untyped-call]


@njit(f"UniTuple(float64, 2)(float64[:, ::1], int64, {VECTOR})", cache=True)
def facing(normals, s, m):  # type: ignore[no-untyped-def]
    """Returns two angle measures, as differences of cosines, by which the normal m must turn until a condition is
    satisfied: until node s faces a face with this normal (FACING); and until node s or one of its own faces faces that
    face (_SOME). A measure is at most 0 if its condition is satisfied already; it is -1 for a node without faces,
    because such a node faces any face.
    """
    mean, square, length, rise = 0.0, 0.0, 0.0, 0.0
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        mean += normals[s, a] * m[a]
        rise += normals[s, 9 + a] * m[a]
        length += normals[s, a] * normals[s, a]
        square += normals[s, 3 + a] * m[a] * m[a] + 2.0 * normals[s, 6 + a] * m[b] * m[c]
    if length == 0.0:
        return -1.0, -1.0
    least = mean - np.sqrt(max(square - mean * mean, 0.0))
    turn = max(min(mean - FACING, FACING - rise), 0.5 * (least + FACING))
    return turn, min(turn, 0.5 * (least + _SOME))


@njit(f"boolean(float64[:, ::1], int64, {VECTOR}, {VECTOR}, {VECTOR}, float64)", cache=True, error_model="numpy")
def reaches_over(normals, s, b, e, f, size):  # type: ignore[no-untyped-def]
    """Returns True if the faces of node s, by their mean direction, reach over another face on whose border the foot of
    the node is. ``b``: area coordinates of the foot on the face with the edges ``e`` and ``f``.

    If the faces of the node reach over the other face, the body of the node moves onto the face, not past the face.
    Example: if two bodies collide with equal faces, all nodes have their feet on the border of a face, and no node is
    ever inside of the other body.
    """
    way = normals[s, 9], normals[s, 10], normals[s, 11]
    ee, ff, ef, er, fr = dot(e, e), dot(f, f), dot(e, f), dot(e, way), dot(f, way)
    area = (ee * ff - ef * ef) / size
    two, three = (ff * er - ef * fr) / area, (ee * fr - ef * er) / area
    rates, least, most = (-two - three, two, three), np.inf, 0.0
    for k in range(3):
        if b[k] <= RIM:
            least, most = min(least, rates[k]), max(most, rates[k])
    return least >= -MARGIN and most >= _OVER


@njit(_VECTOR(FACES, types.float64[:, :], types.int64), cache=True, error_model="numpy", forceinline=True)
def plane(faces, ahead, f):  # type: ignore[no-untyped-def]
    """Unit normal of face ``f`` at the end of the step. ``ahead``: positions of the slots at the end of the step."""
    i, j, k = faces.corners[f, 0], faces.corners[f, 1], faces.corners[f, 2]
    _, m = height(at(ahead, i), at(ahead, i), at(ahead, j), at(ahead, k))
    return m


@njit(types.boolean(PAIRS, FACES, types.int32[::1], types.int64, types.int64, _F, _F), cache=True, forceinline=True)
def _asked(pairs, faces, part, q, body, strayed, end):  # type: ignore[no-untyped-def]
    """Returns True if the face of pair ``q`` must be tested: it is exposed, belongs to the part ``body``, and is near
    enough; see outside.
    """
    f = pairs.rows[q, 1]
    far = pairs.until[q] > strayed + faces.left[f] + pairs.speed[q] * end and not pairs.turned[q]
    return (faces.fresh[f] or not far) and faces.exposed[f] and part[faces.corners[f, 0]] == body


@njit(
    types.boolean(PAIRS, types.int32[::1], FACES, types.float64[:, :], types.int32[::1], types.int64, _F, _F, _F),
    cache=True,
    error_model="numpy",
    forceinline=True,
)
def outside(pairs, first, faces, x, part, p, depth, strayed, end):  # type: ignore[no-untyped-def]
    """Returns True if the node of pair ``p`` is nearer to the front of another face of the same part than to the face
    of the pair. ``depth``: depth of the node below the face of the pair.

    A node whose nearest face is another face is beside an acute edge and not inside the body: the nearest face
    determines on which side of the surface a node is. Only faces at a distance below a fraction of their size are
    tested: all candidate lists include faces up to this distance. A face whose pair is deactivated is further away and
    is not tested. ``strayed``: distance of the node from its line, infinite if the pairs have no valid bounds. ``end``:
    time of the end of the step plus one further step. The further step is needed because another thread may have just
    measured a pair at the end of the step.
    """
    rows, corners, size = pairs.rows, faces.corners, faces.size
    s, body = rows[p, 0], part[corners[rows[p, 1], 0]]
    point, reach, following = at(x, s), DEEP_SELF if part[s] == body else DEEP, first[s]
    while following >= 0:
        q, following = following, pairs.next[following]
        if not _asked(pairs, faces, part, q, body, strayed, end):
            continue
        f = rows[q, 1]
        i, j, k = corners[f, 0], corners[f, 1], corners[f, 2]
        o, a, b = at(x, i), at(x, j), at(x, k)
        near, (away, _) = min(depth, reach * size[f]), height(point, o, a, b)
        if not 0.0 < away < near:
            continue
        on, _ = foot(minus(point, o), minus(a, o), minus(b, o))
        if not on:
            away = min(off(point, o, a), off(point, a, b), off(point, b, o))
        if away < near:
            return True
    return False


# Node s at a convex edge between its face g and another face f of the same part, seen along the edge:
#
#          s                 s is in front of f and beside g, if
#      ____ o                1. f is exposed, of that part, and near (_asked), and has a corner in common with g;
#     /    \ f               2. the edge is convex: g lies behind f, sum of the depths of its corners > _BEHIND of g;
#    / g    \                3. s slides along f rather than along g, no deeper below f than RIM, or it is nearer to f
#   /        \                  than to g at the end of the step and no deeper than TOUCHING; and within NEAR of f;
#                            4. s faces f, and its foot is on f.
# (docs/theory/contact.md, "Beside a free edge")


@njit(
    types.boolean(PAIRS, types.int32[::1], FACES, STEP, types.float64[:, ::1], types.int64, _F, _F, _F, _F),
    cache=True,
    error_model="numpy",
    forceinline=True,
)
def in_front(pairs, first, faces, step, normals, p, gap0, gap1, strayed, end):  # type: ignore[no-untyped-def]
    """Returns True if the node of pair ``p`` is beside the face of the pair, and in front of another face of the same
    part that it faces. The foot of the node is on the border (RIM) of the face of the pair.

    ``gap0``, ``gap1``: height of the node over the face of the pair at the beginning and at the end of the step;
    ``strayed``, ``end``: see outside.
    """
    rows, corners, size, ahead, part = pairs.rows, faces.corners, faces.size, step.ahead, step.part
    s, g = rows[p, 0], rows[p, 1]
    a, b, c = corners[g, 0], corners[g, 1], corners[g, 2]
    point, body, following = at(ahead, s), part[a], first[s]
    while following >= 0:
        q, following = following, pairs.next[following]
        if q == p or not _asked(pairs, faces, part, q, body, strayed, end):
            continue
        f = rows[q, 1]
        i, j, k = corners[f, 0], corners[f, 1], corners[f, 2]
        if a not in (i, j, k) and b not in (i, j, k) and c not in (i, j, k):  # condition 1: a common corner with g
            continue
        o, e, h = at(ahead, i), at(ahead, j), at(ahead, k)
        m = plane(faces, ahead, f)
        behind = dot(m, minus(at(ahead, a), o)) + dot(m, minus(at(ahead, b), o)) + dot(m, minus(at(ahead, c), o))
        if not behind < -_BEHIND * size[g]:  # condition 2: the edge is convex
            continue
        above, _ = height(point, o, e, h)
        before, _ = height(at(step.x, s), at(step.x, i), at(step.x, j), at(step.x, k))
        least, along = min(before, above), abs(above - before)
        slides = along < abs(gap1 - gap0) and along <= _SLIDES * size[f] and least > -RIM * size[f]
        if not ((slides or (above > gap1 and least > -TOUCHING * size[f])) and above <= NEAR * size[f]):  # condition 3
            continue
        every, some = facing(normals, s, m)
        if not (every if part[s] == body else some) <= 0.0:  # condition 4: s faces f
            continue
        on, _ = foot(minus(point, o), minus(e, o), minus(h, o))
        if on:
            return True
    return False
