"""Contact of separated nodes with the faces at their former corner.

When the star of a node separates into three or more pieces, two copies of the node are twins across a facet only if
their pieces have this facet in common. With any other piece a copy has only an edge or the node in common. At the
moment of separation the copy lies on all sides of these pieces (faces of broken facets that are not surface yet), with
a gap of zero. The position of the copy at the end of the step determines which side the copy would enter: the nearest
side that is above the copy and contains its foot (docs/theory/fracture.md, "Contact").

Sides that a copy of a node touches only at an edge or at the node are called narrow sides. The corners of narrow sides
are processed family by family; a family is all copies of one original node. The positions of each member relative to
all corners of its family are computed in loops over rows of a few kilobytes, which the compiler vectorizes; the few
corners that pass this test are then tested one by one.
"""

from typing import NamedTuple

import numpy as np

from ...kernels.jit import njit, prefetch, record, types
from ...model.cache_lines import LINE
from ...model.state import INTACT, Bits, Indices, Tets
from ..geometry import VECTOR, at, cross, dot, height, minus
from ..surface.families import CORNERS
from .corner_rows import (
    CORNER,
    FF,
    FG,
    GG,
    INWARD,
    MANY,
    ROWS,
    SQUARE,
    TO_F,
    TO_G,
    TWIN,
    WORD,
    measure,
    set_vector,
    under,
    vector,
)
from .tables import CONTACT_ROWS, DEEP_SELF, STEP, needed

_SOON, _NEXT = 16, 8
"""Prefetch distances, in corners: for the node numbers of a side, and for the positions of these nodes."""
_LATER = np.array([0, 1, 2, 0, 1])
"""Corners of a side, in cyclic order."""
_I, _F, _F1, _F2 = types.int64, types.float64, types.float64[::1], types.float64[:, ::1]
_N1, _N2, _N3 = types.int32[::1], types.int32[:, ::1], types.int32[:, :, ::1]


class NarrowSides(NamedTuple):
    """Cracks, and the block of tets whose faces are sides of the cracks."""

    cracks: Indices
    """(m, 6) local nodes of all cracks."""
    sides: Indices
    """(m, 2, 3) block, tet and face of each side; see Cracks."""
    tets: Tets
    """(n, 4) nodes of the tets of the block. ``across`` (n, 4) and ``bond`` (n, 4) are those of the block."""
    across: Indices
    bond: Bits
    ring: Indices
    """(nodes,) next node of the family of each node; see Families."""
    place: Indices
    """(nodes,) slot of each local node."""


NARROW = record(NarrowSides, _N2, _N3, types.uint32[:, ::1], _N2, types.uint8[:, ::1], _N1, _N1)


@njit("int64(uint32[:, ::1], int32[:, ::1], uint8[:, ::1], int64, int64, int64)", cache=True, forceinline=True)
def _opened(tets, across, bond, e, f, g):  # type: ignore[no-untyped-def]
    """Returns two bits that show which sides of tet ``e`` are broken or exposed: 1 for the side opposite to node ``f``,
    2 for the side opposite to node ``g``.
    """
    first, second = 0, 0
    for k in range(4):
        first += k * (tets[e, k] == f)
        second += k * (tets[e, k] == g)
    one = (across[e, first] < 0) | (bond[e, first] != INTACT)
    return one + 2 * ((across[e, second] < 0) | (bond[e, second] != INTACT))


@njit(types.void(_N1, _I, _N2, _N1, types.float64[:, :]), cache=True, forceinline=True)
def _bring(corners, i, cracks, place, ahead):  # type: ignore[no-untyped-def]
    """Prefetches data of the corners after position ``i``: the nodes of a crack, and the positions of these nodes."""
    last = len(corners) - 1
    prefetch(cracks, 6 * (corners[min(i + _SOON, last)] >> 3))
    m = corners[min(i + _NEXT, last)]
    c, h = m >> 3, m >> 2 & 1
    for k in range(3):
        prefetch(ahead, LINE * place[cracks[c, 3 * h + k]])


@njit(f"UniTuple(float64, 2)({VECTOR}, {VECTOR}, {VECTOR})", cache=True, forceinline=True)
def _foot(r, e, f):  # type: ignore[no-untyped-def]
    """Area coordinates of the foot of a point at the ends of e and f, multiplied by the square of twice the area of the
    side. ``r``: vector from the common origin of e and f to the point.
    """
    ee, ff, ef, er, fr = dot(e, e), dot(f, f), dot(e, f), dot(e, r), dot(f, r)
    return ff * er - ef * fr, ee * fr - ef * er


@njit(f"boolean({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR}, float64)", cache=True, forceinline=True)
def _nearer(r, inward, e, f, depth):  # type: ignore[no-untyped-def]
    """Returns True if the point ``r`` is less than ``depth`` below the side of the edges e and f, and its foot is
    between the two edges.
    """
    if not dot(inward, r) < depth * np.sqrt(dot(inward, inward)):
        return False
    b, c = _foot(r, e, f)
    return min(b, c) >= 0.0


@njit(f"boolean({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR}, {VECTOR}, int64)", cache=True, forceinline=True)
def _beside(r, inward, e, f, g, opened):  # type: ignore[no-untyped-def]
    """Returns True if the point ``r`` belongs to another ``opened`` side (_opened) of the corner: it is above that
    side, or nearer to it. ``r`` is below the side of the edges f and g, whose normal is ``inward``; e, f, g are the
    edges of the corner.
    """
    depth, k = dot(inward, r) / np.sqrt(dot(inward, inward)), 1
    while k < 3:
        e, f, g = f, g, e
        if opened & k:
            other = cross(f, g)
            if not dot(other, r) > 0.0 or _nearer(r, other, f, g, depth):
                return True
        k += 1
    return False


@njit(
    _I(CONTACT_ROWS, STEP, _I, _I),
    cache=True,
    error_model="numpy",
)
def _pushed_out(out, step, first, stop):  # type: ignore[no-untyped-def]
    """Completes the contacts of entering nodes in place. The contacts are rows of ``out`` from ``first`` to ``stop``. A
    row contains four slots: the node, the corner, and the other two nodes of the side, clockwise seen from outside. The
    row also contains the weights of the last three slots at the foot of the node. Contacts that are deeper than
    DEEP_SELF at the beginning of the step are removed. Returns the number of remaining contacts.
    """
    x, v, ahead, n = step.x, step.v, step.ahead, first
    for r in range(first, stop):
        s, a, f, g = out.nodes[r, 0], out.nodes[r, 1], out.nodes[r, 2], out.nodes[r, 3]
        gap1, m = height(at(ahead, s), at(ahead, a), at(ahead, g), at(ahead, f))
        gap0, _ = height(at(x, s), at(x, a), at(x, g), at(x, f))
        area = cross(minus(at(x, f), at(x, a)), minus(at(x, g), at(x, a)))
        if not gap0 >= -DEEP_SELF * np.sqrt(np.sqrt(dot(area, area))):
            continue
        every = out.weights[r, 0] + out.weights[r, 1] + out.weights[r, 2]
        w, w_f, w_g = -out.weights[r, 0] / every, -out.weights[r, 1] / every, -out.weights[r, 2] / every
        if w_f == 0.0:  # two equal slots in the middle: a contact of two nodes
            f, w_f, g, w_g = g, w_g, f, w_f
        if w_f == 0.0:
            f, w = a, -1.0
        if w_g == 0.0:
            g = a
        out.nodes[n, 0], out.nodes[n, 1], out.nodes[n, 2], out.nodes[n, 3] = s, a, f, g
        out.weights[n, 0], out.weights[n, 1], out.weights[n, 2], out.weights[n, 3] = 1.0, w, w_f, w_g
        rate = 0.0
        for i in range(3):
            out.normals[n, i] = m[i]
            rate += m[i] * (v[s, i] + w * v[a, i] + w_f * v[f, i] + w_g * v[g, i])
        out.wanted[n] = rate + needed(gap0, gap1, rate, step.give, step.dt)
        out.friction[n], out.pair[n] = step.mu[step.part[s], step.part[a]], -1
        n += 1
    return n - first


@njit(types.void(_F1, _N2, _N1, _I, _I, _N2, _N1, _N1, types.float64[:, :]), cache=True, forceinline=True)
def _gather(w, rest, corners, head, many, cracks, among, place, ahead):  # type: ignore[no-untyped-def]
    """Writes data of ``many`` corners, from corner ``head`` on. The positions of the corners and of the other nodes of
    their sides are written to the rows ``w``, and the three local nodes of each corner to ``rest``.
    """
    for i in range(many):
        _bring(corners, head + i, cracks, place, ahead)
        m = corners[head + i]
        c, h, k = m >> 3, m >> 2 & 1, m & 3
        p, w[TWIN + i] = cracks[c, 3 * h + k], among[cracks[c, 3 - 3 * h + k]]
        f, g = cracks[c, 3 * h + _LATER[k + 2 - h]], cracks[c, 3 * h + _LATER[k + 1 + h]]
        rest[i, 0], rest[i, 1], rest[i, 2] = p, f, g
        set_vector(w, CORNER, i, at(ahead, place[p]))
        set_vector(w, TO_F, i, at(ahead, place[f]))
        set_vector(w, TO_G, i, at(ahead, place[g]))


# Corner p of the narrow side (p, f, g) of a tet with top t; member d of the family of p, at p until it separated:
#
#            g                      r = d - p at the end of the step, inward = (f - p) x (g - p), into the tet
#           / \                     below = inward . r: > 0 behind the side
#          /   \                    foot: share w_f = (g.g)(f.r) - (f.g)(g.r) of f over the square of inward,
#         / o d \                         w_g = (f.f)(g.r) - (f.g)(f.r) of g, 1 - w_f - w_g of p
#        p ----- f
#          \ | /                    Conditions of a contact of d with the side, in the order of the tests in entering:
#            t                      1. Its part may be in contact with itself.
#                                   2. d is below the side at the end of the step, with its foot on it, and is not the
#                                      twin of p across the facet (under): that one has a contact across the crack.
#                                   3. d is not above another open side of the corner, or nearer to it (_beside).
#                                   4. d was no deeper than DEEP_SELF at the beginning of the step (_pushed_out).
# A node of the side that has not separated is common to both pieces and has the weight 0; its former weight is
# redistributed to the other nodes (docs/theory/fracture.md, "Contact").


@njit(
    _I(CONTACT_ROWS, _I, _I, NARROW, CORNERS, STEP, _I, _I),
    cache=True,
    error_model="numpy",
)
def entering(out, base, each, narrow, of, step, first, stop):  # type: ignore[no-untyped-def]
    """Writes contacts of separated nodes with the narrow sides at their former corner, of the families ``of`` a block
    from ``first`` to ``stop``.

    The contacts are written to rows of ``out``; the first row is ``base`` plus ``each`` times the number of corners
    before the first family; there are ``each`` rows for each corner on average. Returns the number of contacts; if this
    number is larger than the number of rows, some contacts have no row. The comments have the numbers of the conditions
    in the drawing.
    """
    ahead, part, mu, nodes, weights = step.ahead, step.part, step.mu, out.nodes, out.weights
    members, begin, among, corners, start = of
    cracks, sides, tets, across, bond, ring, place = narrow
    begins, end = base + each * start[first], base + each * start[stop]
    n = begins
    w, flags, some = np.zeros(ROWS * MANY), np.zeros(MANY, np.uint8), np.empty(WORD, np.int64)
    words, rest = flags.view(np.uint64), np.empty((MANY, 3), np.int32)
    for family in range(first, stop):
        kind = part[place[members[begin[family]]]]
        if not mu[kind, kind] >= 0.0:  # condition 1: contact of the part with itself
            continue
        for head in range(start[family], start[family + 1], MANY):
            many = min(start[family + 1] - head, MANY)
            full = (many + WORD - 1) // WORD
            _gather(w, rest, corners, head, many, cracks, among, place, ahead)
            for i in range(many, full * WORD):
                w[CORNER + i] = np.nan
            measure(w, full * WORD)
            for member in range(begin[family], begin[family + 1]):
                d = place[members[member]]
                x, y, z = at(ahead, d)
                under(flags, w, full * WORD, member, x, y, z)  # condition 2: below the side, foot on it, no twin
                for word in range(full):
                    if words[word] == 0:
                        continue
                    found = 0
                    for i in range(word * WORD, word * WORD + WORD):
                        some[found] = i
                        found += flags[i]
                    for u in range(found):
                        i = some[u]
                        p, f, g, o = rest[i, 0], rest[i, 1], rest[i, 2], vector(w, CORNER, i)
                        r, to_f, to_g = minus((x, y, z), o), vector(w, TO_F, i), vector(w, TO_G, i)
                        c, h = corners[head + i] >> 3, corners[head + i] >> 2 & 1
                        e = sides[c, h, 1]
                        opened = _opened(tets, across, bond, e, f, g)
                        if opened:
                            to_top = minus(at(ahead, place[tets[e, sides[c, h, 2]]]), o)
                            if _beside(r, vector(w, INWARD, i), to_top, to_f, to_g, opened):  # condition 3
                                continue
                        along_f, along_g = dot(to_f, r), dot(to_g, r)
                        w_f = max(w[GG + i] * along_f - w[FG + i] * along_g, 0.0) / w[SQUARE + i]
                        w_g = max(w[FF + i] * along_g - w[FG + i] * along_f, 0.0) / w[SQUARE + i]
                        if n < end:
                            nodes[n, 0], nodes[n, 1], nodes[n, 2], nodes[n, 3] = d, place[p], place[f], place[g]
                            weights[n, 0], weights[n, 1], weights[n, 2] = 1.0 - w_f - w_g, w_f, w_g
                            weights[n, 1] *= ring[f] != f
                            weights[n, 2] *= ring[g] != g
                        n += 1
    if n > end:
        return n - begins
    return _pushed_out(out, step, begins, n)  # condition 4: depth at the start of the step
