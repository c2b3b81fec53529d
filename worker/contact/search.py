"""Candidates: nodes and faces, edges and edges, that may meet before the next search.

Everything is taken to fly on for a while, the horizon, and two things are candidates when their paths come closer than
their reach. A candidate list stays good until the horizon has passed or something has strayed from its path by half the
skin; so a body in free flight spends no skin, however fast it is. The list may hold more than is needed, never less.
"""

from dataclasses import dataclass

import numpy as np

from ..jit import njit
from ..state import Flags, Floats, Indices, Ints, extended
from . import buckets
from .buckets import bucket_of, first_at

_SAMPLE, _BUCKET = 1.5, 0.5
"""Largest distance of the points of a small thing, and edge of a bucket, of the median extent of the large things."""
_FILLED = 4.0
"""Points along an axis that a small thing may have."""


@dataclass
class Things:
    """What is searched: points, edges or faces as corners of nodes; all the same number of corners."""

    corners: Indices
    """(n, k) places of nodes."""
    reach: Floats
    """(n,) how far from its corners' hull a thing must be seen, m."""


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
    _sweep_out(boxes.low, boxes.high, things.corners, things.reach, x, v, horizon)
    return boxes


@njit(
    "void(float64[:, ::1], float64[:, ::1], int32[:, ::1], float64[::1], float64[:, ::1], float64[:, ::1], float64)",
    cache=True,
)
def _sweep_out(low, high, corners, reach, x, v, horizon):  # type: ignore[no-untyped-def]
    for j in range(len(corners)):
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
    if not len(small.corners) or not len(large.corners):
        return np.zeros((0, 2), np.int32)
    small_boxes, large_boxes = swept(small, x, v, horizon), swept(large, x, v, horizon)
    small_part, large_part = part[small.corners[:, 0]], part[large.corners[:, 0]]
    few = _near(small_boxes, small_part, large_boxes, large_part, allowed)
    many = _near(large_boxes, large_part, small_boxes, small_part, allowed)
    if not len(few) or not len(many):
        return np.zeros((0, 2), np.int32)
    order = np.zeros(0, np.int64) if rank is None else rank
    pairs = _pairs(
        small_boxes.take(few), large_boxes.take(many), small.corners[few], large.corners[many], part, allowed,
        order[:0] if rank is None else order[few], order[:0] if rank is None else order[many],
    )  # fmt: skip
    return np.column_stack([few[pairs[:, 0]], many[pairs[:, 1]]]).astype(np.int32)


def _near(boxes: Boxes, part: Indices, others: Boxes, their_part: Indices, allowed: Flags) -> "np.ndarray":
    """Indices of the boxes that touch the hull of a part that theirs may meet."""
    return np.flatnonzero(_touching(boxes.low, boxes.high, part, others.low, others.high, their_part, allowed))


@njit(
    "boolean[::1](float64[:, ::1], float64[:, ::1], int32[::1], float64[:, ::1], float64[:, ::1], int32[::1], "
    "boolean[:, ::1])",
    cache=True,
)
def _touching(low, high, part, their_low, their_high, their_part, allowed):  # type: ignore[no-untyped-def]
    least, most = np.full((len(allowed), 3), np.inf), np.full((len(allowed), 3), -np.inf)
    for j in range(len(their_low)):
        q = their_part[j]
        for i in range(3):
            least[q, i], most[q, i] = min(least[q, i], their_low[j, i]), max(most[q, i], their_high[j, i])
    near = np.zeros(len(low), np.bool_)
    for j in range(len(low)):
        for q in range(len(allowed)):
            touch = allowed[part[j], q]
            for i in range(3):
                touch &= low[j, i] <= most[q, i] and high[j, i] >= least[q, i]
            near[j] |= touch
    return near


def _pairs(
    small: Boxes, large: Boxes, small_corners: Indices, large_corners: Indices, part: Indices, allowed: Flags,
    small_rank: Ints, large_rank: Ints,
) -> Indices:  # fmt: skip
    """Small things of like size together, in buckets twice as large for each level: none has more than a few points."""
    edge = _SAMPLE * float(np.median(large.extent))
    extent = small.extent
    level = np.maximum(np.ceil(np.log2(np.maximum(extent / (_FILLED * edge), 1.0))), 0.0).astype(np.int64)
    found = []
    for each in np.unique(level):
        chosen = np.flatnonzero(level == each)
        pairs = _of_a_level(
            small.take(chosen), large, small_corners[chosen], large_corners, part, allowed,
            small_rank[chosen] if len(small_rank) else small_rank, large_rank, edge * 2.0**each,
        )  # fmt: skip
        found.append(np.column_stack([chosen[pairs[:, 0]], pairs[:, 1]]))
    return np.concatenate(found).astype(np.int32)


def _of_a_level(
    small: Boxes, large: Boxes, small_corners: Indices, large_corners: Indices, part: Indices, allowed: Flags,
    small_rank: Ints, large_rank: Ints, edge: float,
) -> Indices:  # fmt: skip
    points, who, half = _samples(small.low, small.high, edge)
    bucketed = buckets.sort(points, _BUCKET / _SAMPLE * edge)
    who = who[bucketed.order].astype(np.int32)
    boxes = np.hstack([small.low, -small.high])[who]
    out = np.empty((4 * len(who) + 1024, 2), np.int32)
    n = asked = 0
    while True:
        n, asked = _walk(
            out, n, asked, small_corners, large_corners, boxes, large.low, large.high, half, part, allowed,
            bucketed.codes, bucketed.rows, who, bucketed.origin, bucketed.inverse, bucketed.shape, small_rank,
            large_rank,
        )  # fmt: skip
        if asked == len(large_corners):
            return out[:n]
        out = extended(out, np.empty_like(out))


def _samples(low: Floats, high: Floats, edge: float) -> tuple[Floats, "np.ndarray", Floats]:
    """Points that fill the boxes (n, 3) so densely that none of a box is further than ``half`` from one of its own."""
    counts = np.maximum(np.ceil((high - low) / edge), 1.0).astype(np.int64)
    who, index = buckets.grid(counts)
    points = low[who] + (index + 0.5) * ((high - low) / counts)[who]
    return points, who, (0.5 * ((high - low) / counts)).max(axis=0)


@njit("boolean(int32[:, ::1], int32[:, ::1], int64, int64)", cache=True)
def _meet(small, large, i, j):  # type: ignore[no-untyped-def]
    """Whether two things have a corner in common."""
    for a in range(small.shape[1]):
        for b in range(large.shape[1]):
            if small[i, a] == large[j, b]:
                return True
    return False


@njit(
    "UniTuple(int64, 2)(int32[:, ::1], int64, int64, int32[:, ::1], int32[:, ::1], float64[:, ::1], "
    "float64[:, ::1], float64[:, ::1], float64[::1], int32[::1], boolean[:, ::1], int64[::1], int64[::1], "
    "int32[::1], float64[::1], float64, int64[::1], int64[::1], int64[::1])",
    cache=True,
)
def _walk(  # type: ignore[no-untyped-def]
    out, n, asked, small, large, boxes, box_low, box_high, half, part, allowed, codes, rows, who, origin, inverse,
    shape, small_rank, large_rank,
):  # fmt: skip
    """Each large thing asks the buckets that its box touches, or all points where these are fewer than its rows.

    ``boxes`` (m, 6): of the thing that each sorted point belongs to, lowest corner and minus the highest. ``n`` pairs
    are in ``out`` and ``asked`` large things have asked already; returns both anew, when all have or the room is full.
    """
    mark = np.full(len(small), -1, np.int32)
    for j in range(asked, len(large)):
        before = n
        ix0 = bucket_of(box_low[j, 0] - half[0], origin[0], inverse, shape[0])
        ix1 = bucket_of(box_high[j, 0] + half[0], origin[0], inverse, shape[0])
        iy0 = bucket_of(box_low[j, 1] - half[1], origin[1], inverse, shape[1])
        iy1 = bucket_of(box_high[j, 1] + half[1], origin[1], inverse, shape[1])
        iz0 = bucket_of(box_low[j, 2] - half[2], origin[2], inverse, shape[2])
        iz1 = bucket_of(box_high[j, 2] + half[2], origin[2], inverse, shape[2])
        every = (iy1 - iy0 + 1) * (iz1 - iz0 + 1) > len(codes)
        if every:
            iy1, iz1 = iy0, iz0
        for iz in range(iz0, iz1 + 1):
            for iy in range(iy0, iy1 + 1):
                row = shape[0] * (iy + shape[1] * iz)
                at = 0 if every else first_at(codes, rows, iy + shape[1] * iz, row + ix0)
                while at < len(codes) and (every or codes[at] <= row + ix1):
                    p = at
                    at += 1
                    if boxes[p, 0] > box_high[j, 0] or boxes[p, 1] > box_high[j, 1] or boxes[p, 2] > box_high[j, 2]:
                        continue
                    if -boxes[p, 3] < box_low[j, 0] or -boxes[p, 4] < box_low[j, 1] or -boxes[p, 5] < box_low[j, 2]:
                        continue
                    i = who[p]
                    if mark[i] == j:
                        continue
                    mark[i] = j
                    if len(small_rank) > 0 and small_rank[i] >= large_rank[j]:
                        continue
                    if not allowed[part[small[i, 0]], part[large[j, 0]]] or _meet(small, large, i, j):
                        continue
                    if n == len(out):
                        return before, j
                    out[n, 0], out[n, 1] = i, j
                    n += 1
    return n, len(large)
