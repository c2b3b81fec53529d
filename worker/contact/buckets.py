"""Bucket sort with position codes (Oldenburg and Nilsson 1994): what lies near a box, without a grid in memory.

A point's code is ix + nx (iy + ny iz) of the bucket that it lies in (the paper's eq. 10). Sorted codes turn the search
in space into a search in a list: a box asks for the buckets of its rows, each a range of codes. Memory follows the
number of points, however far they fly.
"""

from dataclasses import dataclass

import numpy as np

from ..jit import njit
from ..state import Floats, Ints

_MOST = 2.0**20
"""Buckets along an axis: codes of three stay far below 2^63."""
_ROWS = 4
"""Rows of buckets to a point, at most, that are worth a table."""


@dataclass
class Buckets:
    """Sorted points; ``order`` (m,) says which point each code belongs to."""

    origin: Floats
    inverse: float
    """One over the edge of a bucket, 1/m."""
    shape: Ints
    """(3,) buckets along each axis."""
    codes: Ints
    order: Ints
    rows: Ints
    """Where each row of buckets along the first axis begins in ``codes``, and the end; empty if too many have none."""


def sort(points: Floats, edge: float) -> Buckets:
    """Sorts points (m, 3) into buckets of edge ``edge``, m, or larger where the space is too wide for it."""
    low, high = points.min(axis=0), points.max(axis=0)
    edge = max(edge, float((high - low).max()) / _MOST)
    shape = np.floor((high - low) / edge).astype(np.int64) + 1
    codes = position_codes(points, low, 1.0 / edge, shape)
    order = np.argsort(codes, kind="stable")
    codes, rows = codes[order], int(shape[1] * shape[2])
    starts = np.arange(rows + 1 if rows <= _ROWS * len(codes) else 0) * shape[0]
    return Buckets(low, 1.0 / edge, shape, codes, order, np.searchsorted(codes, starts))


def grid(counts: Ints) -> tuple[Ints, Ints]:
    """Every cell of n boxes of ``counts`` (n, 3) cells: the index of its box, and its own (3,) from zero."""
    total = counts.prod(axis=1)
    who = np.repeat(np.arange(len(total)), total)
    number = np.arange(len(who)) - np.repeat(np.cumsum(total) - total, total)
    index = np.empty((len(who), 3), np.int64)
    for axis in range(3):
        index[:, axis] = number % counts[who, axis]
        number = number // counts[who, axis]
    return who, index


@njit("int64(float64, float64, float64, int64)", cache=True)
def bucket_of(x, origin, inverse, n):  # type: ignore[no-untyped-def]
    """Index of a coordinate along an axis, clamped to 0 ... n - 1."""
    return np.int64(min(max(np.floor((x - origin) * inverse), 0.0), n - 1.0))


@njit("int64[::1](float64[:, ::1], float64[::1], float64, int64[::1])", cache=True)
def position_codes(points, origin, inverse, shape):  # type: ignore[no-untyped-def]
    """(m,) code of each point (m, 3)."""
    codes = np.empty(len(points), np.int64)
    for i in range(len(points)):
        ix = bucket_of(points[i, 0], origin[0], inverse, shape[0])
        iy = bucket_of(points[i, 1], origin[1], inverse, shape[1])
        iz = bucket_of(points[i, 2], origin[2], inverse, shape[2])
        codes[i] = ix + shape[0] * (iy + shape[1] * iz)
    return codes


@njit("int64(int64[::1], int64[::1], int64, int64)", cache=True)
def first_at(codes, rows, row, code):  # type: ignore[no-untyped-def]
    """Index of the first of the sorted codes that is not below ``code``, which lies in ``row``."""
    low, high = 0, len(codes)
    if len(rows) > 0:
        low, high = rows[row], rows[row + 1]
    while low < high:
        middle = (low + high) // 2
        if codes[middle] < code:
            low = middle + 1
        else:
            high = middle
    return low
