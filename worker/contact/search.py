"""Candidates: nodes and faces, edges and edges, that may meet before the next search.

Everything is taken to fly on for a while, the horizon, and two things are candidates when their paths come closer than
their reach. A candidate list stays good until the horizon has passed or something has strayed from its path by half the
skin; so a body in free flight spends no skin, however fast it is. The list may hold more than is needed, never less.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..jit import njit, types
from ..state import Flags, Floats, Indices, Ints, extended
from . import buckets
from .buckets import TABLE, bucket_at, bucket_of

_FEW, _SAMPLE = 8, 256
"""How many large things to a small one are worth larger cells; how many boxes are measured for the size of cells."""
_NO_RANK = np.zeros(0, np.int64)


@dataclass
class Things:
    """What is searched: points, edges or faces as corners of nodes; all the same number of corners."""

    corners: Indices
    """(n, k) places of nodes."""
    reach: Floats
    """(n,) how far from its corners' hull a thing must be seen, m."""
    some: Indices | None = None
    """(m,) which of them are searched; all when it is missing."""

    @property
    def searched(self) -> Indices:
        """(m,) which are."""
        return np.arange(len(self.corners), dtype=np.int32) if self.some is None else self.some


@dataclass
class Boxes:
    """(n, 3) lowest and highest corner of the space that each thing may need before the next search."""

    low: Floats
    high: Floats

    @property
    def hull(self) -> Floats:
        """(6,) lowest corner and minus the highest of them all; infinities when there is none."""
        if not len(self.low):
            return np.full(6, np.inf)
        return np.concatenate([self.low.min(axis=0), -self.high.max(axis=0)])

    @property
    def extent(self) -> Floats:
        """(n,) the longest side."""
        return np.asarray(np.maximum.reduce((self.high - self.low).T.copy()))

    def take(self, chosen: "np.ndarray") -> "Boxes":
        """Some of the boxes."""
        return Boxes(self.low[chosen], self.high[chosen])

    def touching(self, hull: Floats) -> Flags:
        """(n,) which boxes touch a hull."""
        return np.asarray(_in_hull(self.low, self.high, hull))


@njit("boolean[::1](float64[:, ::1], float64[:, ::1], float64[::1])", cache=True)
def _in_hull(low, high, hull):  # type: ignore[no-untyped-def]
    inside = np.empty(len(low), np.bool_)
    for j in range(len(low)):
        touch = True
        for i in range(3):
            touch &= low[j, i] <= -hull[3 + i] and high[j, i] >= hull[i]
        inside[j] = touch
    return inside


def swept(things: Things, x: Floats, v: Floats, horizon: float) -> Boxes:
    """The boxes that things fly through, reach included; ``x`` and ``v`` are (nodes, 3)."""
    boxes = Boxes(np.empty((len(things.corners), 3)), np.empty((len(things.corners), 3)))
    _sweep_out(boxes.low, boxes.high, things.corners, things.reach, things.searched, x, v, horizon)
    return boxes


@njit(
    "void(float64[:, ::1], float64[:, ::1], int32[:, ::1], float64[::1], int32[::1], float64[:, ::1], "
    "float64[:, ::1], float64)",
    cache=True,
)
def _sweep_out(low, high, corners, reach, some, x, v, horizon):  # type: ignore[no-untyped-def]
    for j in some:
        for i in range(3):
            least, most = np.inf, -np.inf
            for k in range(corners.shape[1]):
                now = x[corners[j, k], i]
                then = now + horizon * v[corners[j, k], i]
                least, most = min(least, now, then), max(most, now, then)
            low[j, i], high[j, i] = least - reach[j], most + reach[j]


def find(
    small: Things, large: Things, x: Floats, v: Floats, part: Indices, allowed: Flags, horizon: float,
    rank: Ints | None,
) -> Indices:  # fmt: skip
    """(pairs, 2) candidates: index of a small thing and of a large one.

    ``x``, ``v`` (nodes, 3), less what all drift with, and ``part`` (nodes,) belong to the places that corners name;
    ``allowed`` (parts, parts) says which parts meet. Things with a corner in common are no candidates. ``rank``
    (large,): the small things are the first of the large ones, and only the one of lower rank finds a pair.
    """
    if not len(small.searched) or not len(large.searched):
        return np.zeros((0, 2), np.int32)
    of = small, swept(small, x, v, horizon), large, swept(large, x, v, horizon), part, allowed
    few, many = _near(*of), _near(of[2], of[3], *of[:2], part, allowed.T.copy())
    if not len(few) or not len(many):
        return np.zeros((0, 2), np.int32)
    order = np.zeros(0, np.int64) if rank is None else rank
    return _pairs(
        Sought(of[1].low, of[1].high, small.corners, few, order),
        Sought(of[3].low, of[3].high, large.corners, many, order), part, allowed,
    )  # fmt: skip


def _near(
    things: Things, boxes: Boxes, others: Things, their_boxes: Boxes, part: Indices, allowed: Flags
) -> Indices:  # fmt: skip
    """Which of the things touch, by their boxes, the hull of a part of the others that theirs may meet."""
    mine = Sought(boxes.low, boxes.high, things.corners, things.searched, _NO_RANK)
    theirs = Sought(their_boxes.low, their_boxes.high, others.corners, others.searched, _NO_RANK)
    return np.asarray(_touching(mine, theirs, part, allowed))


def _extent(things: "Sought") -> float:
    """The median of the longest sides of boxes, of a sample of them, m."""
    some = things.some[:: max(len(things.some) // _SAMPLE, 1)]
    return float(np.median((things.high[some] - things.low[some]).max(axis=1)))


def _pairs(small: "Sought", large: "Sought", part: Indices, allowed: Flags) -> Indices:
    edge = max(_extent(small), _extent(large))
    if _FEW * len(small.some) < len(large.some):
        edge *= 2.0
    table = buckets.sort(small.low, small.high, small.some, edge)
    out = np.empty((4 * (len(small.some) + len(large.some)) + 1024, 2), np.int32)
    n = asked = 0
    while True:
        n, asked = _ask(out, n, asked, table, small, large, part, allowed)
        if asked == len(large.some):
            return out[:n]
        out = extended(out, np.empty_like(out))


class Sought(NamedTuple):
    """Things that are searched."""

    low: Floats
    """(n, 3) of their boxes."""
    high: Floats
    corners: Indices
    """(n, k) slots."""
    some: Indices
    """(m,) which of them."""
    rank: Ints
    """(n,) of two things that are found, the small one has the lower rank; (0,): no matter."""


SOUGHT = types.NamedTuple(
    (types.float64[:, ::1], types.float64[:, ::1], types.int32[:, ::1], types.int32[::1], types.int64[::1]), Sought
)  # type: ignore[no-untyped-call]


@njit("boolean(int32[:, ::1], int32[:, ::1], int64, int64)", cache=True)
def _meet(small, large, i, j):  # type: ignore[no-untyped-def]
    """Whether two things have a corner in common."""
    for a in range(small.shape[1]):
        for b in range(large.shape[1]):
            if small[i, a] == large[j, b]:
                return True
    return False


@njit(types.int32[::1](SOUGHT, SOUGHT, types.int32[::1], types.boolean[:, ::1]), cache=True)
def _touching(things, others, part, allowed):  # type: ignore[no-untyped-def]
    least, most = np.full((len(allowed), 3), np.inf), np.full((len(allowed), 3), -np.inf)
    for j in others.some:
        q = part[others.corners[j, 0]]
        for i in range(3):
            least[q, i], most[q, i] = min(least[q, i], others.low[j, i]), max(most[q, i], others.high[j, i])
    near, n = np.empty(len(things.some), np.int32), 0
    for j in things.some:
        touching = False
        for q in range(len(allowed)):
            touch = allowed[part[things.corners[j, 0]], q]
            for i in range(3):
                touch &= things.low[j, i] <= most[q, i] and things.high[j, i] >= least[q, i]
            touching |= touch
        if touching:
            near[n] = j
            n += 1
    return near[:n].copy()


@njit(
    types.UniTuple(types.int64, 2)(  # type: ignore[no-untyped-call]
        types.int32[:, ::1], types.int64, types.int64, TABLE, SOUGHT, SOUGHT, types.int32[::1], types.boolean[:, ::1]
    ),
    cache=True,
)
def _ask(out, n, asked, table, small, large, part, allowed):  # type: ignore[no-untyped-def]
    """Each large thing asks the buckets that its box touches; a pair is found in the bucket where the boxes begin to
    overlap, and so once. ``n`` pairs are in ``out`` and ``asked`` large things have asked already; returns both anew,
    when all have or the room is full.
    """
    few_low, few_high, box_low, box_high = small.low, small.high, large.low, large.high
    few, many, rank, order = small.corners, large.corners, small.rank, large.rank
    start, things, codes, wide = table.start, table.thing, table.code, table.wide
    origin, inverse, shape, bits = table.origin, table.inverse, table.shape, table.bits
    every = small.some
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    for at in range(asked, len(large.some)):
        j, before = large.some[at], n
        cells = 1
        for i in range(3):
            first[i] = bucket_of(box_low[j, i], origin[i], inverse, shape[i])
            last[i] = bucket_of(box_high[j, i], origin[i], inverse, shape[i])
            cells *= last[i] - first[i] + 1
        alone = cells > len(every)
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
                    if x == first[0] and y == first[1] and z == first[2]:
                        end += len(every) if alone else len(wide)
                    for p in range(begin, end):
                        if p - begin < apart:
                            if codes[p] != code:
                                continue
                            i = things[p]
                        else:
                            i = every[p - begin] if alone else wide[p - begin - apart]
                        if few_low[i, 0] > box_high[j, 0] or few_low[i, 1] > box_high[j, 1]:
                            continue
                        if few_low[i, 2] > box_high[j, 2] or few_high[i, 0] < box_low[j, 0]:
                            continue
                        if few_high[i, 1] < box_low[j, 1] or few_high[i, 2] < box_low[j, 2]:
                            continue
                        if p - begin < apart:
                            if bucket_of(max(few_low[i, 0], box_low[j, 0]), origin[0], inverse, shape[0]) != x:
                                continue
                            if bucket_of(max(few_low[i, 1], box_low[j, 1]), origin[1], inverse, shape[1]) != y:
                                continue
                            if bucket_of(max(few_low[i, 2], box_low[j, 2]), origin[2], inverse, shape[2]) != z:
                                continue
                        if len(rank) > 0 and rank[i] >= order[j]:
                            continue
                        if not allowed[part[few[i, 0]], part[many[j, 0]]] or _meet(few, many, i, j):
                            continue
                        if n == len(out):
                            return before, at
                        out[n, 0], out[n, 1] = i, j
                        n += 1
    return n, len(large.some)
