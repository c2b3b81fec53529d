"""Candidate pairs: nodes and faces, edges and edges, that may be in contact before the next search.

All nodes are extrapolated over a time, the horizon, and two primitives are candidates when their paths come closer than
their reach. A candidate list is valid until the horizon has passed or a node has departed from its path by half the
skin; so free flight at a constant velocity uses none of the skin. The list may contain pairs that are not needed, but
misses none.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...kernels.jit import njit, types
from ...model.state import Flags, Floats, Indices, Ints, extended
from . import buckets
from .buckets import TABLE, bucket_at, bucket_of

_FEW, _SAMPLE = 8, 256
"""Ratio of the numbers of large and small primitives above which larger cells are faster; and size of the sample of
boxes from which the size of the cells is computed."""


@dataclass
class Primitives:
    """Points, edges or faces, given by nodes; all with the same number of corners."""

    corners: Indices
    """(n, k) rows of the nodes of the primitives."""
    reach: Floats
    """(n,) reach, m: distance from the hull of the corners within which other primitives are candidates."""
    some: Indices | None = None
    """(m,) rows of the primitives to be searched; None for all."""

    @property
    def searched(self) -> Indices:
        """(m,) rows of the primitives to be searched."""
        return np.arange(len(self.corners), dtype=np.int32) if self.some is None else self.some


@dataclass
class Boxes:
    """(n, 3) lowest and highest corner of the swept volume of each primitive."""

    low: Floats
    high: Floats

    @property
    def hull(self) -> Floats:
        """(6,) lowest corner of all boxes, and minus the highest corner of all boxes; infinities if there are no
        boxes.
        """
        return np.asarray(_hull(self.low, self.high))

    def touching(self, hull: Floats) -> Flags:
        """(n,) boxes that touch a hull."""
        return np.asarray(_in_hull(self.low, self.high, hull))


@njit("float64[::1](float64[:, ::1], float64[:, ::1])", cache=True)
def _hull(low, high):  # type: ignore[no-untyped-def]
    found = np.full(6, np.inf)
    for j in range(len(low)):
        for i in range(3):
            found[i], found[3 + i] = min(found[i], low[j, i]), min(found[3 + i], -high[j, i])
    return found


@njit("boolean[::1](float64[:, ::1], float64[:, ::1], float64[::1])", cache=True)
def _in_hull(low, high, hull):  # type: ignore[no-untyped-def]
    inside = np.empty(len(low), np.bool_)
    for j in range(len(low)):
        touch = True
        for i in range(3):
            touch &= low[j, i] <= -hull[3 + i] and high[j, i] >= hull[i]
        inside[j] = touch
    return inside


def swept(things: Primitives, x: Floats, v: Floats, horizon: float) -> Boxes:
    """Bounding boxes of the searched primitives over the horizon, reach included; ``x`` and ``v`` (nodes, 3)."""
    none = np.zeros(len(x), np.int32)
    boxed = _boxed(things.corners, things.reach, things.searched, x, v, horizon, none, _ALLOWED, _EVERYWHERE)
    return Boxes(boxed[0], boxed[1])


_ALLOWED = np.ones((1, 1), bool)
_EVERYWHERE = np.full((1, 2, 3), (((-np.inf,) * 3, (np.inf,) * 3)))
"""Hull that every box touches."""


@njit(
    "Tuple((float64[:, ::1], float64[:, ::1], int32[::1], float64[:, :, ::1]))(int32[:, ::1], float64[::1], "
    "int32[::1], float64[:, ::1], float64[:, ::1], float64, int32[::1], boolean[:, ::1], float64[:, :, ::1])",
    cache=True,
)
def _boxed(corners, reach, some, x, v, horizon, part, allowed, hull):  # type: ignore[no-untyped-def]
    """Returns the lowest and highest corner of the boxes of ``some`` primitives that touch the ``hull`` (parts, 2, 3)
    of a part with which the part of the primitive may be in contact; their rows; and the hulls of their own parts.
    """
    low, high, rows, n = np.empty((len(some), 3)), np.empty((len(some), 3)), np.empty(len(some), np.int32), 0
    own = np.empty(hull.shape)
    own[:, 0], own[:, 1] = np.inf, -np.inf
    for j in some:
        mine = part[corners[j, 0]]
        for i in range(3):
            least, most = np.inf, -np.inf
            for k in range(corners.shape[1]):
                now = x[corners[j, k], i]
                then = now + horizon * v[corners[j, k], i]
                least, most = min(least, now, then), max(most, now, then)
            low[n, i], high[n, i] = least - reach[j], most + reach[j]
        touching = False
        for q in range(len(hull)):
            touch = allowed[mine, q]
            for i in range(3):
                touch &= low[n, i] <= hull[q, 1, i] and high[n, i] >= hull[q, 0, i]
            touching |= touch
        if touching:
            for i in range(3):
                own[mine, 0, i], own[mine, 1, i] = min(own[mine, 0, i], low[n, i]), max(own[mine, 1, i], high[n, i])
            rows[n] = j
            n += 1
    return low[:n], high[:n], rows[:n], own


def find(
    small: Primitives, large: Primitives, x: Floats, v: Floats, part: Indices, allowed: Flags, horizon: float,
    rank: Ints | None,
) -> Indices:  # fmt: skip
    """(pairs, 2) candidates: row of a small primitive and of a large one.

    ``x``, ``v`` (nodes, 3), less the mean velocity, and ``part`` (nodes,) of the nodes of corners; ``allowed`` (parts,
    parts): parts that may be in contact. Primitives with a common corner are no candidates. ``rank`` (large,): the
    small primitives are the first rows of the large primitives, and a pair is found only from the primitive of lower
    rank.
    """
    order = np.zeros(0, np.int64) if rank is None else rank
    first, second = (small, allowed), (large, allowed.T.copy())
    if len(small.searched) > len(large.searched):
        first, second = second, first
    lines = x, v, horizon, part
    hull = np.repeat(_EVERYWHERE, len(allowed), axis=0)
    one = _touching(first, lines, hull, order)
    two = _touching(second, lines, one[1], order)
    if len(two[0].some) < len(second[0].searched):
        one = _touching((Primitives(first[0].corners, first[0].reach, one[0].some), first[1]), lines, two[1], order)
    few, many = (one[0], two[0]) if first[0] is small else (two[0], one[0])
    if not len(few.some) or not len(many.some):
        return np.zeros((0, 2), np.int32)
    return _pairs(few, many, part, allowed)


def _touching(
    of: tuple[Primitives, Flags], lines: tuple[Floats, Floats, float, Indices], hull: Floats, rank: Ints
) -> "tuple[Sought, Floats]":  # fmt: skip
    """Returns the primitives that touch the ``hull`` (parts, 2, 3) of a part with which the part of the primitive may
    be in contact, and the hulls of the parts of these primitives.
    """
    things, allowed = of
    low, high, rows, own = _boxed(things.corners, things.reach, things.searched, *lines, allowed, hull)
    return Sought(low, high, things.corners, rows, rank), own


def _extent(things: "Sought") -> float:
    """Median of the longest sides of a sample of the boxes, m."""
    step = max(len(things.some) // _SAMPLE, 1)
    sides = (things.high[::step] - things.low[::step]).max(axis=1)
    return float(np.partition(sides, len(sides) // 2)[len(sides) // 2])


def _pairs(small: "Sought", large: "Sought", part: Indices, allowed: Flags) -> Indices:
    edge = max(_extent(small), _extent(large))
    if _FEW * len(small.some) < len(large.some):
        edge *= 2.0
    table = buckets.sort(small.low, small.high, edge)
    out = np.empty((4 * (len(small.some) + len(large.some)) + 1024, 2), np.int32)
    n = asked = 0
    while True:
        n, asked = _ask(out, n, asked, table, small, large, part, allowed)
        if asked == len(large.some):
            return out[:n]
        out = extended(out, np.empty_like(out))


class Sought(NamedTuple):
    """Primitives of one search, with their boxes."""

    low: Floats
    """(m, 3) lowest corners of the boxes of the primitives."""
    high: Floats
    corners: Indices
    """(n, k) slots of all primitives."""
    some: Indices
    """(m,) rows of the searched primitives."""
    rank: Ints
    """(n,) rank: in a pair the small primitive has the lower rank; (0,) for any order."""


SOUGHT = types.NamedTuple(
    (types.float64[:, ::1], types.float64[:, ::1], types.int32[:, ::1], types.int32[::1], types.int64[::1]), Sought
)  # type: ignore[no-untyped-call]


@njit("boolean(int32[:, ::1], int32[:, ::1], int64, int64)", cache=True)
def _meet(small, large, i, j):  # type: ignore[no-untyped-def]
    """Returns True if two primitives have a common corner."""
    for a in range(small.shape[1]):
        for b in range(large.shape[1]):
            if small[i, a] == large[j, b]:
                return True
    return False


@njit(
    types.UniTuple(types.int64, 2)(  # type: ignore[no-untyped-call]
        types.int32[:, ::1], types.int64, types.int64, TABLE, SOUGHT, SOUGHT, types.int32[::1], types.boolean[:, ::1]
    ),
    cache=True,
)
def _ask(out, n, asked, table, small, large, part, allowed):  # type: ignore[no-untyped-def]
    """Finds the small primitives near each large one in the buckets that its box touches.

    On entry ``out`` has ``n`` pairs, and ``asked`` large primitives are finished; the function returns the new values
    of ``n`` and ``asked`` when all large primitives are finished or ``out`` is full. Conditions of a pair, numbered at
    the ends of lines:

        +-----------+          1. The entry has the code of the cell, not only its hash.
        |     +-----|----+     2. The two boxes overlap.
        |     |     |    |     3. The cell contains the lowest corner, x, of the intersection of the boxes: a pair is
        |     x-----+    |        found in one cell only.
        +-----+----------+     4. The small primitive has the lower rank.
                               5. The parts of the two may be in contact, and they have no common corner.
    """
    few_low, few_high, box_low, box_high = small.low, small.high, large.low, large.high
    few, many, rank, order = small.corners, large.corners, small.rank, large.rank
    start, things, codes, wide = table.start, table.thing, table.code, table.wide
    origin, inverse, shape, bits = table.origin, table.inverse, table.shape, table.bits
    every, others = small.some, large.some
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    for at in range(asked, len(others)):
        before, cells = n, 1  # loop over the cells of the box of the large primitive
        for i in range(3):
            first[i] = bucket_of(box_low[at, i], origin[i], inverse, shape[i])
            last[i] = bucket_of(box_high[at, i], origin[i], inverse, shape[i])
            cells *= last[i] - first[i] + 1
        alone = cells > len(every)  # a box of so many cells is compared with every small primitive
        if alone:
            last[:] = first
        for z in range(first[2], last[2] + 1):
            for y in range(first[1], last[1] + 1):
                for x in range(first[0], last[0] + 1):
                    code = x + shape[0] * (y + shape[1] * z)
                    begin, end = np.int64(0), np.int64(0)
                    if not alone:
                        bucket = bucket_at(code, bits)
                        begin, end = np.int64(start[bucket]), np.int64(start[bucket + 1])
                    apart = end - begin
                    if x == first[0] and y == first[1] and z == first[2]:  # first cell: add the unentered boxes
                        end += len(every) if alone else len(wide)
                    for p in range(begin, end):
                        if p - begin < apart:
                            if codes[p] != code:  # condition 1, listed above
                                continue
                            b = things[p]
                        else:
                            b = p - begin if alone else wide[p - begin - apart]
                        if few_low[b, 0] > box_high[at, 0] or few_low[b, 1] > box_high[at, 1]:  # condition 2
                            continue
                        if few_low[b, 2] > box_high[at, 2] or few_high[b, 0] < box_low[at, 0]:
                            continue
                        if few_high[b, 1] < box_low[at, 1] or few_high[b, 2] < box_low[at, 2]:
                            continue
                        if p - begin < apart:  # condition 3, listed above
                            if bucket_of(max(few_low[b, 0], box_low[at, 0]), origin[0], inverse, shape[0]) != x:
                                continue
                            if bucket_of(max(few_low[b, 1], box_low[at, 1]), origin[1], inverse, shape[1]) != y:
                                continue
                            if bucket_of(max(few_low[b, 2], box_low[at, 2]), origin[2], inverse, shape[2]) != z:
                                continue
                        i, j = every[b], others[at]
                        if len(rank) > 0 and rank[i] >= order[j]:  # condition 4, listed above
                            continue
                        if not allowed[part[few[i, 0]], part[many[j, 0]]] or _meet(few, many, i, j):  # condition 5
                            continue
                        if n == len(out):
                            return before, at
                        out[n, 0], out[n, 1] = i, j
                        n += 1
    return n, len(others)
