"""Narrow phase of nodes and faces: finds the contacts of the next step and deactivates distant pairs.

The contact point is the point at which the node passes the plane of the face. Therefore a node that slides over several
faces changes from one face to the next at their common edge.
"""

import numpy as np

from ...kernels.jit import njit, prefetch, types
from ...model.cache_lines import LINE
from ..geometry import VECTOR, at, beyond, distance, dot, foot, height, minus, off
from .closing_speed import closing_rate, fastest_of
from .facing import facing, plane
from .tables import CONTACT_ROWS, DEEP, DEEP_SELF, FACES, NEAR, PAIRS, SLOTS, STEP, bonded

_ROUND = 0.01
"""Tolerance for round-off, as a fraction of the size of a face. The tolerance is added to the distance of contact."""
_WORTH = 0.02
"""Smallest slack with which a pair is deactivated, as a fraction of the size of a face. A pair with less slack is
tested in every step, which takes less time than the computation of its slack."""
_BEND = 0.1
"""Largest relative motion of two corners of a face, divided by the lengths of its two edges. The bound of ``_bent`` is
valid up to the largest relative motion."""

_SOON, _NEXT = 8, 4
"""Prefetch distances, in pairs: for a node and a face, and for the corners of a face."""
_X2, _V2, _N2 = "float64[:, :]", "float64[:, ::1]", "int32[:, ::1]"
_F, _I, _N1 = types.float64, types.int64, types.int32[::1]
_VECTOR = types.UniTuple(types.float64, 3)  # type: ignore[no-untyped-call]


@njit("void(int32[::1], int32[::1], int32[:, ::1], int64)", cache=True)
def chain(first, following, pairs, begin):  # type: ignore[no-untyped-def]
    """Adds the pairs of a node and a face from row ``begin`` on to the linked lists of their nodes. ``first`` (slots,):
    first pair of each list; ``following`` (p,): next pair of the same node, -1 for none.
    """
    for p in range(begin, len(pairs)):
        following[p], first[pairs[p, 0]] = first[pairs[p, 0]], p


@njit(f"float64({_X2}, int64, int64, int64, int64)", cache=True, error_model="numpy")
def _distance(x, s, i, j, k):  # type: ignore[no-untyped-def]
    """Distance of node s from the face i, j, k, m."""
    p, o, a, b = at(x, s), at(x, i), at(x, j), at(x, k)
    on, _ = foot(minus(p, o), minus(a, o), minus(b, o))
    if on:
        above, _ = height(p, o, a, b)
        return abs(above)
    return min(off(p, o, a), off(p, a, b), off(p, b, o))


@njit(f"float64(float64, {_X2}, int64, int64, int64)", cache=True, error_model="numpy")
def _bent(turn, x, i, j, k):  # type: ignore[no-untyped-def]
    """Returns half of a motion D, m. The normal of the face turns by less than ``turn`` while no two corners of the
    face move by D relative to each other.

    The normal of a face with edges e, f and area A changes by less than D (|e| + |f| + D) / A while no two of its
    corners have moved by D relative to each other.
    """
    e, f = minus(at(x, j), at(x, i)), minus(at(x, k), at(x, i))
    ee, ff, ef = dot(e, e), dot(f, f), dot(e, f)
    sides = np.sqrt(ee) + np.sqrt(ff)
    return 0.5 * min(0.5 * turn * np.sqrt(ee * ff - ef * ef) / ((1.0 + _BEND) * sides), _BEND * sides)


@njit(
    f"Tuple((boolean, {VECTOR}))({_X2}, {_X2}, {_N2}, int64, int64, {VECTOR}, float64, float64, float64)",
    cache=True,
    error_model="numpy",
)
def _passes(x, ahead, corners, s, f, m, gap0, gap1, most):  # type: ignore[no-untyped-def]
    """Returns two results: True if node s passes face f and is no deeper than ``most``; and the area coordinates of the
    foot of s at that moment. ``m``: normal of the face; ``gap0``, ``gap1``: height of s over the face at the beginning
    and at the end of the step.
    """
    i, j, k, d = corners[f, 0], corners[f, 1], corners[f, 2], corners[f, 3]
    deep = not gap0 >= -most
    if gap0 < 0.0:
        altitude = -dot(m, minus(at(x, d), at(x, i)))
        deep |= gap0 < -0.5 * altitude
    if deep:
        return False, m
    tau = 0.0
    if gap0 > 0.0:
        tau = 1.0 if gap1 >= 0.0 else gap0 / (gap0 - gap1)
    o, then = at(x, i), at(ahead, i)
    r, e, f = minus(at(x, s), o), minus(at(x, j), o), minus(at(x, k), o)
    return foot(
        beyond(r, tau, minus(minus(at(ahead, s), then), r)),
        beyond(e, tau, minus(minus(at(ahead, j), then), e)),
        beyond(f, tau, minus(minus(at(ahead, k), then), f)),
    )


@njit(
    _F(STEP, types.float64[:, ::1], FACES, types.int64, types.int64, _VECTOR, _F),
    cache=True,
    error_model="numpy",
)
def _coming(step, normals, faces, s, f, m, gap):  # type: ignore[no-untyped-def]
    """Returns ``closing_rate`` of node s and face f if they will be in contact in a step of length ``step.beyond``
    after this step; else 0. ``m``: normal of the face at the end of this step; ``gap``: height of the node over the
    face at that time, m.
    """
    v, ahead, corners = step.v, step.ahead, faces.corners
    i, j, k = corners[f, 0], corners[f, 1], corners[f, 2]
    rate = dot(m, minus(at(v, s), at(v, i)))
    if not gap + step.beyond * rate < 0.0:
        return 0.0
    every, some = facing(normals, s, m)
    if not (every if step.part[s] == step.part[i] else some) <= 0.0:
        return 0.0
    tau = -gap / rate
    p, o = beyond(at(ahead, s), tau, at(v, s)), beyond(at(ahead, i), tau, at(v, i))
    a, b = beyond(at(ahead, j), tau, at(v, j)), beyond(at(ahead, k), tau, at(v, k))
    above, _ = height(p, o, a, b)
    on, _ = foot(minus(p, o), minus(a, o), minus(b, o))
    if not (on and abs(above) <= DEEP_SELF * faces.size[f]):
        return 0.0
    return closing_rate(step, corners, s, f, fastest_of(step, corners, s, f))


@njit(_I(PAIRS, SLOTS, FACES, _F, _I, _I), cache=True, error_model="numpy")
def due(pairs, slots, faces, end, first, stop):  # type: ignore[no-untyped-def]
    """Selects the pairs to be tested among those from ``first`` to ``stop``, and writes them to ``pairs.active`` from
    ``first`` on. Returns the number of selected pairs. ``end``: end of the time for which contact is tested, s after
    the search.

    During the test the bound of a selected pair has the value for "too close to be deactivated", because another thread
    may read the bound (facing.py) during the test, and must treat the pair as near. A pair whose face is not exposed or
    whose node is not on the surface is deactivated until the face is exposed and the node is on the surface.
    """
    rows, until, speed, turned = pairs.rows[first:], pairs.until[first:], pairs.speed[first:], pairs.turned[first:]
    active, exposed, on_surface = pairs.active[first:], faces.exposed, slots.on_surface
    left, fresh, strayed, other = faces.left, faces.fresh, slots.left, slots.fresh
    n, m = 0, 0
    for p in range(stop - first):
        s, f = rows[p, 0], rows[p, 1]
        active[n] = p
        n += other[s] | fresh[f] | (not until[p] > strayed[s] + left[f] + speed[p] * end)
    for q in range(n):
        p = active[q]
        s, f = rows[p, 0], rows[p, 1]
        if not exposed[f] or not on_surface[s]:
            until[p], speed[p] = np.inf, 0.0
            continue
        if other[s] or fresh[f] or not np.isnan(until[p]):
            until[p], speed[p], turned[p] = -np.inf, np.nan, True
        active[m] = first + p
        m += 1
    return m


# Node s and face f = (i, j, k) of unit normal m at the end of the step. ahead = x(n) + dt v: positions without contact.
#
#        s (n)                         gap0 = m(n) . (s - i) at x(n), with the normal m(n) of the face then
#         o                            gap1 = m . (s - i) at ``ahead``
#          \            ^ m            tau = gap0 / (gap0 - gap1): share of the step after which s is in the plane;
#           \           |                   0 if it is behind the plane already, 1 if it does not reach it
#   i -------x----------- j, k         x: foot of s at tau, with the area coordinates b = (b_i, b_j, b_k)
#             \                        gap: dt m . sum(w_k v_k) + const with w = (1, -b_i, -b_j, -b_k) of s, i, j, k
#              o s (n+1)                    (docs/theory/contact.md, "Impulses, not springs")
#
# Conditions of a contact. ``node_face`` tests the conditions 1 to 5 in this order, and ``single_contact.admitted`` the
# conditions 6 to 8 (docs/theory/contact.md, "Which point", "Beside a free edge" and "Face on face"):
# 1. No bond ties all four nodes.
# 2. The gap is at most NEAR of the face at the end of the step.
# 3. The normals are compatible: node s faces the face (facing.facing), so that the rim of a bar is not in contact with
#    the side of another bar of the same width, nor the surface below a block that slides with the front of the block.
# 4. If only one of the faces at node s faces the face, s passes the face from outside: gap0 >= -NEAR of the face.
# 5. The foot of s at tau is on the face, and s is no deeper than ``reach`` of the face and half the altitude of its
#    tet.
# 6. No better face has an equal contact with the node (single_contact.py): a node over an edge or a corner of a flat
#    patch of faces has one contact with the patch, and not one contact with each face.
# 7. The node is not beside a convex edge, in front of another face there (facing.in_front).
# 8. If s is inside by more than TOUCHING, s is not nearer to the front of another face (facing.outside).
# A node behind several faces of a part keeps its contact with the nearest face (single_contact.nearest).


@njit(f"void({_N2}, {_N2}, {_V2}, {_X2}, int32[::1], int64, int64)", cache=True, forceinline=True)
def _bring(rows, corners, normals, x, active, q, last):  # type: ignore[no-untyped-def]
    """Prefetches the data of the pairs after position ``q`` of ``active``, up to ``last``."""
    soon, later = active[min(q + _NEXT, last)], active[min(q + _SOON, last)]
    prefetch(corners, 4 * rows[later, 1])
    prefetch(normals, 12 * rows[later, 0])
    prefetch(normals, 12 * rows[later, 0] + 11)
    prefetch(x, LINE * rows[later, 0])
    for k in range(3):
        prefetch(x, LINE * corners[rows[soon, 1], k])


@njit(
    types.Tuple((_I, _F))(CONTACT_ROWS, types.float64[::1], _I, PAIRS, SLOTS, FACES, STEP, _F, _I, _I),  # type: ignore[no-untyped-call]
    cache=True,
    error_model="numpy",
)
def node_face(out, depth, base, pairs, slots, faces, step, end, first, stop):  # type: ignore[no-untyped-def]
    """Writes possible contacts of nodes with faces to the rows of ``out`` from ``base + first`` on, for the pairs in
    ``pairs.active`` from ``first`` to ``stop``. A possible contact fulfils the conditions 1 to 5. Returns the number of
    possible contacts, and the largest square of speed / altitude of a tet, 1/s^2, of the pairs that will be in contact
    in the next step (``_coming``).

    ``depth`` (rows,): gap of node and face at the beginning of the step, m. ``out.wanted``: gap at the end of the step
    without contact, m. ``single_contact.admitted`` completes the rows. ``end``: time of the end of the step, s after
    the search. The comments have the numbers of the conditions in the drawing.
    """
    rows, until, speed, turned, active = pairs.rows, pairs.until, pairs.speed, pairs.turned, pairs.active
    corners, size, left = faces.corners, faces.size, faces.left
    normals, strayed, course = slots.normals, slots.left, slots.course
    nodes, weights, out_normals, wanted, pair = out.nodes, out.weights, out.normals, out.wanted, out.pair
    x, ahead, part = step.x, step.ahead, step.part
    n, most = base + first, 0.0
    for q in range(first, stop):
        p = active[q]
        _bring(rows, corners, normals, x, active, q, stop - 1)
        s, f = rows[p, 0], rows[p, 1]
        i, j, k = corners[f, 0], corners[f, 1], corners[f, 2]
        if len(step.tied) > 0 and bonded(step, s, i, j, k):  # condition 1: no bond of all four nodes
            continue
        m = plane(faces, ahead, f)
        gap1 = dot(m, minus(at(ahead, s), at(ahead, i)))
        reach = DEEP_SELF if part[s] == part[i] else DEEP
        if not np.isnan(
            until[p]
        ):  # deactivate the pair while it cannot be in contact: slack > left_1 + left_2 + U t (pairs.py)
            a, b, c = at(course, i), at(course, j), at(course, k)
            rate = max(distance(at(course, s), a), distance(at(course, s), b), distance(at(course, s), c))
            slack = _distance(ahead, s, i, j, k) - (_ROUND + max(reach, NEAR)) * size[f]
            bends = not slack > _WORTH * size[f]
            if bends:
                every, some = facing(normals, s, m)
                slack = _bent(every if part[s] == part[i] else some, ahead, i, j, k)
                rate = max(distance(a, b), distance(a, c))
            speed[p], turned[p] = rate, bends
            until[p] = slack - strayed[s] - left[f] + rate * end if slack > _WORTH * size[f] else np.nan
        if not gap1 <= NEAR * size[f]:  # condition 2: the gap at the end of the step
            if step.beyond > 0.0:
                most = max(most, _coming(step, normals, faces, s, f, m, gap1))
            continue
        every, some = facing(normals, s, m)
        if not (every if part[s] == part[i] else some) <= 0.0:  # condition 3: compatible normals
            continue
        gap0, now = height(at(x, s), at(x, i), at(x, j), at(x, k))
        if not (every <= 0.0 or gap0 >= -NEAR * size[f]):  # condition 4: s passes from outside
            continue
        passes, b = _passes(x, ahead, corners, s, f, now, gap0, gap1, reach * size[f])
        if not passes:  # condition 5: foot and depth
            continue
        nodes[n, 0], nodes[n, 1], nodes[n, 2], nodes[n, 3] = s, i, j, k
        weights[n, 0], weights[n, 1], weights[n, 2], weights[n, 3] = 1.0, -b[0], -b[1], -b[2]
        out_normals[n, 0], out_normals[n, 1], out_normals[n, 2] = m
        depth[n], wanted[n], pair[n] = gap0, gap1, p
        n += 1
    return n - base - first, most
