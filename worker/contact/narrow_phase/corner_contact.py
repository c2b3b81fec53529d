"""Who comes in through a narrow side of a tet where it was one with a corner of it.

When a node separates into three pieces or more, a copy is the twin of another across a facet only where their pieces
have that facet in common. With the other pieces it has an edge or the node alone, and at the moment of separation it
lies on all their sides, at a gap of exactly zero. Which of them it would enter the end of the step tells: the nearest
of those below which it would be then, with its foot on it (docs/theory/contact.md, "Contact" of fracture).

The corners of narrow sides are taken family by family: what each member is to the corners of its family is found in
loops over these, in rows of a few kilobytes that compilers make vectors of. Few of them are looked at on their own.
"""

from typing import NamedTuple

import numpy as np

from ...kernels.jit import njit, prefetch, record, types
from ...model.cache_lines import LINE
from ...model.state import INTACT, Bits, Indices, Tets
from ..geometry import VECTOR, at, cross, dot, height, minus
from ..surface.families import CORNERS
from ..surface.sharp import SHARP
from .tables import CONTACT_ROWS, DEEP_SELF, STEP, needed

_BENT = 1.0 - SHARP * SHARP
"""Square of the sine of the angle by which two faces of one surface may be bent: that of edges that are not sharp."""
_MANY = 64
"""Corners that are looked at together: their rows, 10 kB, stay in the first cache."""
_WORD = 8
"""Flags in a word, and numbers in the longest vectors there are."""
_CORNER, _TO_F, _TO_G, _INWARD = (_MANY * row for row in (0, 3, 6, 9))
"""Rows of three: the corner, from there the ends of the other two edges of the side, clockwise seen from outside; the
normal of the side."""
_SQUARE, _FF, _GG, _FG, _TWIN = (_MANY * row for row in (12, 13, 14, 15, 16))
"""Rows: dot products of the normal and of the two edges, and the number of the corner's twin among the members."""
_ROWS = 17
_SOON, _NEXT = 16, 8
"""How many corners ahead is brought near where a corner is, and the nodes of its side."""
_LATER = np.array([0, 1, 2, 0, 1])
"""Corners of a side, one after the other."""
_I, _F, _F1, _F2 = types.int64, types.float64, types.float64[::1], types.float64[:, ::1]
_N1, _N2, _N3 = types.int32[::1], types.int32[:, ::1], types.int32[:, :, ::1]


class NarrowSides(NamedTuple):
    """Cracks, and a block of tets beside them."""

    cracks: Indices
    """(m, 6) local nodes of all cracks."""
    sides: Indices
    """(m, 2, 3) see Cracks."""
    tets: Tets
    """(n, 4), ``across`` (n, 4) and ``bond`` (n, 4): of the block."""
    across: Indices
    bond: Bits
    ring: Indices
    """(nodes,) see Families."""
    place: Indices
    """(nodes,) in the scene."""


NARROW = record(NarrowSides, _N2, _N3, types.uint32[:, ::1], _N2, types.uint8[:, ::1], _N1, _N1)


@njit("int64(uint32[:, ::1], int32[:, ::1], uint8[:, ::1], int64, int64, int64)", cache=True, forceinline=True)
def _opened(tets, across, bond, e, f, g):  # type: ignore[no-untyped-def]
    """Which sides of tet ``e`` opposite to its nodes ``f``, 1, and ``g``, 2, are broken or exposed."""
    first, second = 0, 0
    for k in range(4):
        first += k * (tets[e, k] == f)
        second += k * (tets[e, k] == g)
    one = (across[e, first] < 0) | (bond[e, first] != INTACT)
    return one + 2 * ((across[e, second] < 0) | (bond[e, second] != INTACT))


@njit(types.void(_N1, _I, _N2, _N1, types.float64[:, :]), cache=True, forceinline=True)
def _bring(corners, i, cracks, place, ahead):  # type: ignore[no-untyped-def]
    """Has what corners behind the place ``i`` need brought near: it is apart in memory, and one leads to the other."""
    last = len(corners) - 1
    prefetch(cracks, 6 * (corners[min(i + _SOON, last)] >> 3))
    m = corners[min(i + _NEXT, last)]
    c, h = m >> 3, m >> 2 & 1
    for k in range(3):
        prefetch(ahead, LINE * place[cracks[c, 3 * h + k]])


@njit(f"UniTuple(float64, 2)({VECTOR}, {VECTOR}, {VECTOR})", cache=True, forceinline=True)
def _foot(r, e, f):  # type: ignore[no-untyped-def]
    """Shares of the ends of e and f in the foot of a point on their plane, times the square of twice their area; ``r``:
    the point, from where they begin.
    """
    ee, ff, ef, er, fr = dot(e, e), dot(f, f), dot(e, f), dot(e, r), dot(f, r)
    return ff * er - ef * fr, ee * fr - ef * er


@njit(f"boolean({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR}, float64)", cache=True, forceinline=True)
def _nearer(r, inward, e, f, depth):  # type: ignore[no-untyped-def]
    """Whether the point ``r``, below the side of edges e and f, has its foot between them and is less than ``depth``
    below.
    """
    if not dot(inward, r) < depth * np.sqrt(dot(inward, inward)):
        return False
    b, c = _foot(r, e, f)
    return min(b, c) >= 0.0


@njit(f"boolean({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR}, {VECTOR}, int64)", cache=True, forceinline=True)
def _beside(r, inward, e, f, g, opened):  # type: ignore[no-untyped-def]
    """Whether the point ``r``, below the side of edges f and g of a corner of edges e, f, g, and of the normal
    ``inward``, is above another side that is ``opened`` (_opened), or nearer to it.
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


@njit(f"{VECTOR}(float64[::1], int64, int64)", cache=True, forceinline=True)
def _of(w, row, i):  # type: ignore[no-untyped-def]
    """The vector of corner ``i``."""
    return w[row + i], w[row + _MANY + i], w[row + 2 * _MANY + i]


@njit(f"void(float64[::1], int64, int64, {VECTOR})", cache=True, forceinline=True)
def _set(w, row, i, a):  # type: ignore[no-untyped-def]
    """Makes ``a`` the vector of corner ``i``."""
    w[row + i], w[row + _MANY + i], w[row + 2 * _MANY + i] = a


@njit(types.void(_F1, _I), cache=True, error_model="numpy")
def _measure(w, n):  # type: ignore[no-untyped-def]
    """Edges and what follows from them, of the first ``n`` corners, whose edges are still positions of their ends."""
    for row in (_TO_F, _TO_G):
        to, o = w[row:], w[_CORNER:]
        for i in range(n):
            to[i] -= o[i]
            to[_MANY + i] -= o[_MANY + i]
            to[2 * _MANY + i] -= o[2 * _MANY + i]
    for i in range(n):
        f = w[_TO_F + i], w[_TO_F + _MANY + i], w[_TO_F + 2 * _MANY + i]
        g = w[_TO_G + i], w[_TO_G + _MANY + i], w[_TO_G + 2 * _MANY + i]
        m = cross(f, g)
        w[_INWARD + i], w[_INWARD + _MANY + i], w[_INWARD + 2 * _MANY + i] = m
        w[_SQUARE + i], w[_FF + i], w[_GG + i], w[_FG + i] = dot(m, m), dot(f, f), dot(g, g), dot(f, g)


@njit(types.void(types.uint8[::1], _F1, _I, _I, _F, _F, _F), cache=True, error_model="numpy")
def _under(flags, w, n, member, x, y, z):  # type: ignore[no-untyped-def]
    """Below the sides of which of the first ``n`` corners the ``member`` would be, at x, y, z, with its foot on them.

    Outside of a side is a foot that is further beyond an edge than the next face, bent by less than a sharp edge is,
    would reach over it, or behind the corner, where no face reaches.
    """
    for i in range(n):
        r = x - w[_CORNER + i], y - w[_CORNER + _MANY + i], z - w[_CORNER + 2 * _MANY + i]
        along_f = dot((w[_TO_F + i], w[_TO_F + _MANY + i], w[_TO_F + 2 * _MANY + i]), r)
        along_g = dot((w[_TO_G + i], w[_TO_G + _MANY + i], w[_TO_G + 2 * _MANY + i]), r)
        below = dot((w[_INWARD + i], w[_INWARD + _MANY + i], w[_INWARD + 2 * _MANY + i]), r)
        of_f, of_g = w[_GG + i] * along_f - w[_FG + i] * along_g, w[_FF + i] * along_g - w[_FG + i] * along_f
        beyond = _BENT * dot(r, r) * w[_SQUARE + i]
        flags[i] = (
            (below > 0.0)
            & (w[_TWIN + i] != member)
            & (of_f + of_g <= w[_SQUARE + i])
            & ((of_f >= 0.0) | ((along_g > 0.0) & (of_f * of_f <= beyond * w[_GG + i])))
            & ((of_g >= 0.0) | ((along_f > 0.0) & (of_g * of_g <= beyond * w[_FF + i])))
        )


@njit(
    _I(CONTACT_ROWS, STEP, _I, _I),
    cache=True,
    error_model="numpy",
)
def _pushed_out(out, step, first, stop):  # type: ignore[no-untyped-def]
    """Contacts of the nodes that come in, rows of ``out`` from ``first`` to ``stop``, in their place: so far these have
    the slots of the node, of the corner and of the rest of the side, clockwise seen from outside, and the weights of
    these three at its foot. Returns how many there are: without those that have been deeper than DEEP_SELF at the
    beginning of the step.
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
        if w_f == 0.0:  # two equal slots in the middle are a row of two nodes
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


@njit(
    _I(CONTACT_ROWS, _I, _I, NARROW, CORNERS, STEP, _I, _I),
    cache=True,
    error_model="numpy",
)
def entering(out, base, each, narrow, of, step, first, stop):  # type: ignore[no-untyped-def]
    """Nodes that would come in through a narrow side of a tet at a corner that they were one with, their twins across
    left out: of the families ``of`` a block from ``first`` to ``stop``.

    They are rows of ``out``, ``each`` for every corner of the block in the mean: from ``base`` and ``each`` times the
    first corner of the first family on. Returns how many there are; where there are more than that, not all have a row.
    A node of the side that has not separated gets no weight, and the others its share.
    """
    ahead, part, mu, nodes, weights = step.ahead, step.part, step.mu, out.nodes, out.weights
    members, begin, among, corners, start = of
    cracks, sides, tets, across, bond, ring, place = narrow
    begins, end = base + each * start[first], base + each * start[stop]
    n = begins
    w, flags, some = np.zeros(_ROWS * _MANY), np.zeros(_MANY, np.uint8), np.empty(_WORD, np.int64)
    words, rest = flags.view(np.uint64), np.empty((_MANY, 3), np.int32)
    for family in range(first, stop):
        kind = part[place[members[begin[family]]]]
        if not mu[kind, kind] >= 0.0:
            continue
        for head in range(start[family], start[family + 1], _MANY):
            many = min(start[family + 1] - head, _MANY)
            full = (many + _WORD - 1) // _WORD
            for i in range(many):
                _bring(corners, head + i, cracks, place, ahead)
                m = corners[head + i]
                c, h, k = m >> 3, m >> 2 & 1, m & 3
                p, w[_TWIN + i] = cracks[c, 3 * h + k], among[cracks[c, 3 - 3 * h + k]]
                f, g = cracks[c, 3 * h + _LATER[k + 2 - h]], cracks[c, 3 * h + _LATER[k + 1 + h]]
                rest[i, 0], rest[i, 1], rest[i, 2] = p, f, g
                _set(w, _CORNER, i, at(ahead, place[p]))
                _set(w, _TO_F, i, at(ahead, place[f]))
                _set(w, _TO_G, i, at(ahead, place[g]))
            for i in range(many, full * _WORD):
                w[_CORNER + i] = np.nan
            _measure(w, full * _WORD)
            for member in range(begin[family], begin[family + 1]):
                d = place[members[member]]
                x, y, z = at(ahead, d)
                _under(flags, w, full * _WORD, member, x, y, z)
                for word in range(full):
                    if words[word] == 0:
                        continue
                    found = 0
                    for i in range(word * _WORD, word * _WORD + _WORD):
                        some[found] = i
                        found += flags[i]
                    for u in range(found):
                        i = some[u]
                        p, f, g, o = rest[i, 0], rest[i, 1], rest[i, 2], _of(w, _CORNER, i)
                        r, to_f, to_g = minus((x, y, z), o), _of(w, _TO_F, i), _of(w, _TO_G, i)
                        c, h = corners[head + i] >> 3, corners[head + i] >> 2 & 1
                        e = sides[c, h, 1]
                        opened = _opened(tets, across, bond, e, f, g)
                        if opened:
                            to_top = minus(at(ahead, place[tets[e, sides[c, h, 2]]]), o)
                            if _beside(r, _of(w, _INWARD, i), to_top, to_f, to_g, opened):
                                continue
                        along_f, along_g = dot(to_f, r), dot(to_g, r)
                        w_f = max(w[_GG + i] * along_f - w[_FG + i] * along_g, 0.0) / w[_SQUARE + i]
                        w_g = max(w[_FF + i] * along_g - w[_FG + i] * along_f, 0.0) / w[_SQUARE + i]
                        if n < end:
                            nodes[n, 0], nodes[n, 1], nodes[n, 2], nodes[n, 3] = d, place[p], place[f], place[g]
                            weights[n, 0], weights[n, 1], weights[n, 2] = 1.0 - w_f - w_g, w_f, w_g
                            weights[n, 1] *= ring[f] != f
                            weights[n, 2] *= ring[g] != g
                        n += 1
    if n > end:
        return n - begins
    return _pushed_out(out, step, begins, n)
