"""Families: nodes that were one, and which of them come in through a narrow side of a tet where they were.

When a node separates into three pieces or more, a copy is the twin of another across a facet only where their pieces
have that facet in common. With the other pieces it has an edge or the node alone, and at the moment of separation it
lies on all their sides, at a gap of exactly zero. Which of them it would enter the end of the step tells: the nearest
of those below which it would be then, with its foot on it (docs/numerics.md, "Contact" of fracture).

Whoever has a tet at a node holds all of its family.
"""

from dataclasses import dataclass

import numpy as np

from ..jit import njit, types
from ..mesh.faces import FACES
from ..state import INTACT, Flags, Indices, Ints, extended
from ..topology import Split
from .geometry import VECTOR, at, cross, dot, height, minus
from .narrow_phase import CONTACT_ROWS, DEEP_SELF, STEP, needed
from .sharp import SHARP

_FEWEST = 64
"""Rows that there is room for at first."""
_BENT = 1.0 - SHARP * SHARP
"""Square of the sine of the angle by which two faces of one surface may be bent: that of edges that are not sharp."""
_ROUNDING = 2.0**-40
"""Of a height, by the squares of a face's edges: far more than what it may be off by for another order of corners."""
_I, _F2, _N1, _N2 = types.int64, types.float64[:, ::1], types.int32[::1], types.int32[:, ::1]


@dataclass
class Families:
    """By local node."""

    root: Ints
    """(nodes,) global id of the node that each was part of at the start."""
    ring: Indices
    """(nodes,) the next one of its family here, itself where it is alone."""
    leader: Indices
    """(nodes,) the one here that stands for its family."""

    @classmethod
    def of(cls, root: Ints) -> "Families":
        """The nodes of each ``root`` (nodes,) as a ring."""
        (ring, leader), order = np.empty((2, len(root)), np.int32), np.argsort(root, kind="stable")
        first = np.flatnonzero(np.append(True, np.diff(root[order]) != 0)[: len(root)])
        following, ends = np.roll(order, -1), np.append(first, len(root))[1:]
        following[ends - 1] = order[first]
        ring[order], leader[order] = following, np.repeat(order[first], ends - first)
        return cls(root, ring, leader)

    def grow(self, split: Split) -> None:
        """Takes up the copies of a split."""
        parents = split.copies.parents
        self.root = extended(self.root, self.root[parents])
        self.ring = extended(self.ring, np.zeros(len(parents), np.int32))
        self.leader = extended(self.leader, self.leader[parents])
        _insert(self.ring, parents, split.first)

    def members(self, nodes: Ints) -> Flags:
        """(nodes,) who is of the family of one of the ``nodes`` (k,)."""
        return np.asarray(_members(self.ring, nodes))


@njit("void(int32[::1], int64[::1], int64)", cache=True)
def _insert(ring, parents, first):  # type: ignore[no-untyped-def]
    """Copies, from ``first`` on, come behind their parents."""
    for c in range(len(parents)):
        ring[first + c], ring[parents[c]] = ring[parents[c]], first + c


@njit("boolean[::1](int32[::1], int64[::1])", cache=True)
def _members(ring, nodes):  # type: ignore[no-untyped-def]
    """See Families.members."""
    found = np.zeros(len(ring), np.bool_)
    for a in nodes:
        while not found[a]:
            found[a] = True
            a = ring[a]
    return found


@njit(
    "UniTuple(int64, 2)(uint32[:, ::1], int32[:, ::1], uint8[:, ::1], int64, int64, int64)",
    cache=True,
    forceinline=True,
)
def _corner(tets, across, bond, e, face, node):  # type: ignore[no-untyped-def]
    """The node of tet ``e`` opposite to ``face``; and which of the sides at ``node`` are broken or exposed: 1 that
    opposite to the node that follows, 2 to the next, counter-clockwise seen from outside.
    """
    corner, first, opened = 0, 0, 0
    while tets[e, corner] != node:
        corner += 1
    while FACES[corner, first] != face:
        first += 1
    for k in range(1, 3):
        side = FACES[corner, (first + k) % 3]
        if across[e, side] < 0 or bond[e, side] != INTACT:
            opened += k
    return np.int64(tets[e, face]), opened


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


@njit(
    f"Tuple((boolean, float64, float64))({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR})",
    cache=True,
    forceinline=True,
    error_model="numpy",
)
def _below(r, inward, e, f):  # type: ignore[no-untyped-def]
    """Whether the point ``r`` is below the side of edges e and f, of the normal ``inward``, with its foot on it; and
    its shares of the ends of e and f. All from the corner.
    """
    if not dot(inward, r) > 0.0:
        return False, 0.0, 0.0
    b, c = _foot(r, e, f)
    square = dot(inward, inward)
    if b + c > square:
        return False, 0.0, 0.0
    if min(b, c) < 0.0:
        beyond = _BENT * dot(r, r) * square
        if (b < 0.0 and b * b > beyond * dot(f, f)) or (c < 0.0 and c * c > beyond * dot(e, e)):
            return False, 0.0, 0.0
    return True, max(b, 0.0) / square, max(c, 0.0) / square


@njit(f"boolean({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR}, {VECTOR}, int64)", cache=True, forceinline=True)
def _beside(r, inward, e, f, g, opened):  # type: ignore[no-untyped-def]
    """Whether the point ``r``, below the side of edges f and g of a corner of edges e, f, g, and of the normal
    ``inward``, is above another side that is ``opened`` (_corner), or nearer to it.
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


@njit(f"Tuple(({VECTOR}, float64))(float64[:, :], int64, int64, int64)", cache=True, forceinline=True)
def _outward(x, a, b, c):  # type: ignore[no-untyped-def]
    """Normal of the face of corners ``x[a]``, ``x[b]``, ``x[c]``, twice its area long; and by how much the product with
    a vector of the l1 norm 1 may be off if another corner comes first.
    """
    o = at(x, a)
    e, f = minus(at(x, b), o), minus(at(x, c), o)
    return cross(e, f), _ROUNDING * (dot(e, e) + dot(f, f))


@njit(
    types.Tuple((_N2, _F2))(  # type: ignore[no-untyped-call]
        _N2, types.int32[:, :, ::1], _I, types.uint32[:, ::1], _N2, types.uint8[:, ::1], _N1, _N1, _N1, STEP
    ),
    cache=True,
    error_model="numpy",
)
def entering(cracks, sides, block, tets, across, bond, ring, leader, place, step):  # type: ignore[no-untyped-def]
    """Nodes that would come in through a narrow side of a tet of a ``block`` at a corner that they were one with, their
    twins across left out: (n, 4) slots of the node, of the corner and of the rest of the side, clockwise seen from
    outside; and (n, 3) the weights of the side's nodes at the foot.

    ``cracks`` (m, 6) local nodes of all cracks, and their ``sides`` (m, 2, 3); ``tets``, ``across`` and ``bond`` of the
    block; ``ring`` and ``leader``: see Families; ``place`` (nodes,) in the scene. A node of the side that has
    not separated is pushed by nobody: what would be its due the others get. Where the members of a family will be is
    looked up once for all of its sides; of a side one normal sorts out the members above it, and each of the others is
    looked at from the corner that it was one with.
    """
    ahead, part, mu = step.ahead, step.part, step.mu
    nodes, weights, n = np.empty((_FEWEST, 4), np.int32), np.empty((_FEWEST, 3)), 0
    first, last, end = np.full(len(ring), np.int32(-1), np.int32), np.empty(len(ring), np.int32), 0
    members, there, below = np.empty(len(ring), np.int32), np.empty((len(ring), 3)), np.empty(len(ring), np.int32)
    for m in range(2 * len(cracks)):
        c, h = m // 2, m % 2
        e, outward, rounding = sides[c, h, 1], (0.0, 0.0, 0.0), -1.0
        if e < 0 or sides[c, h, 0] != block:
            continue
        for k in range(3):
            p, q = cracks[c, 3 * h + k], cracks[c, 3 * (1 - h) + k]
            if p == q or ring[ring[p]] == p or not mu[part[place[p]], part[place[p]]] >= 0.0:
                continue
            if rounding < 0.0:
                outward, rounding = _outward(
                    ahead, place[cracks[c, 3 * h]], place[cracks[c, 3 * h + 1 + h]], place[cracks[c, 3 * h + 2 - h]]
                )
            one = leader[p]
            if first[one] < 0:
                first[one], d = end, p
                while end == first[one] or d != p:
                    members[end] = d
                    for i in range(3):
                        there[end, i] = ahead[place[d], i]
                    d, end = ring[d], end + 1
                last[one] = end
            a, o, to_top, opened = place[p], at(ahead, place[p]), at(ahead, place[p]), -1
            many = 0
            for j in range(first[one], last[one]):
                r, below[many] = minus(at(there, j), o), j
                many += dot(outward, r) < rounding * (abs(r[0]) + abs(r[1]) + abs(r[2]))
            for b in range(many):
                j = below[b]
                d, r = members[j], minus(at(there, j), o)
                if d == q:
                    continue
                two, three = cracks[c, 3 * h + (k + 1 + h) % 3], cracks[c, 3 * h + (k + 2 - h) % 3]
                f, g = place[three], place[two]
                to_f, to_g = minus(at(ahead, f), o), minus(at(ahead, g), o)
                inward = cross(to_f, to_g)
                came, w_f, w_g = _below(r, inward, to_f, to_g)
                if not came:
                    continue
                if opened < 0:
                    top, opened = _corner(tets, across, bond, e, sides[c, h, 2], p)
                    to_top = minus(at(ahead, place[top]), o)
                if _beside(r, inward, to_top, to_f, to_g, opened):
                    continue
                if n == len(nodes):
                    nodes, weights = np.concatenate((nodes, nodes)), np.concatenate((weights, weights))
                nodes[n, 0], nodes[n, 1], nodes[n, 2], nodes[n, 3] = place[d], a, f, g
                weights[n, 0], weights[n, 1], weights[n, 2] = 1.0 - w_f - w_g, w_f, w_g
                weights[n, 1] *= ring[three] != three
                weights[n, 2] *= ring[two] != two
                n += 1
    return nodes[:n].copy(), weights[:n].copy()


@njit(types.int64(CONTACT_ROWS, _I, _N2, _F2, STEP), cache=True, error_model="numpy")
def pushed_out(out, n, nodes, weights, step):  # type: ignore[no-untyped-def]
    """The active contacts of what ``entering`` has found, from row ``n`` of ``out`` on; returns the new number of rows.
    Left out is who has been deeper than DEEP_SELF at the beginning of the step.
    """
    x, v, ahead = step.x, step.v, step.ahead
    for r in range(len(nodes)):
        s, a, f, g = nodes[r, 0], nodes[r, 1], nodes[r, 2], nodes[r, 3]
        gap1, m = height(at(ahead, s), at(ahead, a), at(ahead, g), at(ahead, f))
        gap0, _ = height(at(x, s), at(x, a), at(x, g), at(x, f))
        e, b = minus(at(x, f), at(x, a)), minus(at(x, g), at(x, a))
        area = cross(e, b)
        if not gap0 >= -DEEP_SELF * np.sqrt(np.sqrt(dot(area, area))):
            continue
        every = weights[r, 0] + weights[r, 1] + weights[r, 2]
        w, w_f, w_g = -weights[r, 0] / every, -weights[r, 1] / every, -weights[r, 2] / every
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
    return n
