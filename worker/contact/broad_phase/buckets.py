"""Bucket sort with position codes (Oldenburg and Nilsson 1994): boxes near a box, without a grid in memory.

The code of a cell is ix + nx (iy + ny iz) (the paper's eq. 10). Every box is entered under the codes of the cells that
it touches, and the entries are sorted by a hash of their codes. To find the boxes near a given box, the search reads
the entries with the codes of the cells of this box. The entries of one code are a short range. Memory is proportional
to the number of boxes, for any distance between them.
"""

from typing import NamedTuple

import numpy as np

from ...kernels.jit import njit, types
from ...model.state import Floats, Indices, Ints

_MOST = 2.0**20
"""Largest number of cells along an axis: codes of three axes stay far below 2^63."""
_WIDE = 512
"""Largest number of cells of a box that is entered in the buckets; a box with more cells is tested against all other
boxes."""
_CURVE_BITS = 12
"""Number of bits of each coordinate in the code of the space-filling curve."""
_LEAST_BITS = 6
"""Smallest number of bits of the hash."""


class Table(NamedTuple):
    """Hash table of bounding boxes, by the cells that each box touches."""

    origin: Floats
    inverse: float
    """Inverse of the edge of a cell, 1/m."""
    shape: Ints
    """(3,) cells along each axis."""
    bits: int
    """Number of bits of the hash."""
    start: Ints
    """(2^bits + 1,) offset of the first entry of each hash value; the last value is the number of entries."""
    thing: Indices
    """(m,) box of each entry."""
    code: Ints
    """(m,) code of each entry."""
    wide: Indices
    """(w,) boxes that touch too many cells and therefore have no entries."""


TABLE = types.NamedTuple(
    (
        types.float64[::1], types.float64, types.int64[::1], types.int64, types.int64[::1], types.int32[::1],
        types.int64[::1], types.int32[::1],
    ), Table
)  # type: ignore[no-untyped-call]  # fmt: skip


def sort(low: Floats, high: Floats, edge: float) -> Table:
    """Enters the boxes ``low``, ``high`` (n, 3) into cells of edge ``edge``, m, or larger if the boxes are too far
    apart for the codes.
    """
    least, most = low.min(axis=0), high.max(axis=0)
    edge = max(edge, float((most - least).max()) / _MOST)
    shape = np.floor((most - least) / edge).astype(np.int64) + 1
    count, wide = _count(low, high, least, 1.0 / edge, shape)
    bits = max(_LEAST_BITS, int(count).bit_length())
    table = Table(
        least, 1.0 / edge, shape, bits, np.zeros(2**bits + 1, np.int64), np.empty(count, np.int32),
        np.empty(count, np.int64), wide,
    )  # fmt: skip
    _enter(table, low, high)
    return table


@njit("int64(float64, float64, float64, int64)", cache=True)
def bucket_of(x, origin, inverse, n):  # type: ignore[no-untyped-def]
    """Index of a coordinate along an axis, clamped to 0 ... n - 1."""
    return np.int64(min(max(np.floor((x - origin) * inverse), 0.0), n - 1.0))


def curve(x: Floats, edge: float) -> Ints:
    """(n,) position of each point (n, 3) on a space-filling curve (Morton 1966), by cells of ``edge``, m: neighbours
    on the curve are neighbours in space.
    """
    if not len(x):
        return np.zeros(0, np.int64)
    return np.asarray(_interleaved(x, x.min(axis=0), 1.0 / edge))


@njit("int64[::1](float64[:, ::1], float64[::1], float64)", cache=True)
def _interleaved(x, origin, inverse):  # type: ignore[no-untyped-def]
    codes = np.zeros(len(x), np.int64)
    for a in range(len(x)):
        for i in range(3):
            cell = bucket_of(x[a, i], origin[i], inverse, 1 << _CURVE_BITS)
            for bit in range(_CURVE_BITS):
                codes[a] |= ((cell >> bit) & 1) << (3 * bit + i)
    return codes


@njit("int64(int64, int64)", cache=True)
def bucket_at(code, bits):  # type: ignore[no-untyped-def]
    """Hash of a code: the upper ``bits`` of its product with 2^64 over the golden ratio (Knuth 1998, 6.4)."""
    return np.int64((np.uint64(code) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(64 - bits))


@njit("int64(int64[:, ::1], float64[:, ::1], float64[:, ::1], int64, float64[::1], float64, int64[::1])", cache=True)
def _cells(span, low, high, j, origin, inverse, shape):  # type: ignore[no-untyped-def]
    """Number of cells that box j touches, from ``span[0]`` to ``span[1]`` (2, 3)."""
    cells = 1
    for i in range(3):
        span[0, i] = bucket_of(low[j, i], origin[i], inverse, shape[i])
        span[1, i] = bucket_of(high[j, i], origin[i], inverse, shape[i])
        cells *= span[1, i] - span[0, i] + 1
    return cells


@njit(
    types.Tuple((types.int64, types.int32[::1]))(  # type: ignore[no-untyped-call]
        types.float64[:, ::1], types.float64[:, ::1], types.float64[::1], types.float64, types.int64[::1]
    ),
    cache=True,
)
def _count(low, high, origin, inverse, shape):  # type: ignore[no-untyped-def]
    """Number of entries, and the boxes without entries."""
    span, wide, n, total = np.empty((2, 3), np.int64), np.empty(len(low), np.int32), 0, 0
    for j in range(len(low)):
        cells = _cells(span, low, high, j, origin, inverse, shape)
        if cells > _WIDE:
            wide[n] = j
            n += 1
        else:
            total += cells
    return total, wide[:n].copy()


@njit(types.void(TABLE, types.float64[:, ::1], types.float64[:, ::1]), cache=True)
def _enter(table, low, high):  # type: ignore[no-untyped-def]
    """Fills the entries by counting sort: the first pass counts the entries of each hash, the second writes them."""
    start, shape, bits = table.start, table.shape, table.bits
    span = np.empty((2, 3), np.int64)
    for write in range(2):
        for j in range(len(low)):
            if _cells(span, low, high, j, table.origin, table.inverse, shape) > _WIDE:
                continue
            for z in range(span[0, 2], span[1, 2] + 1):
                for y in range(span[0, 1], span[1, 1] + 1):
                    for x in range(span[0, 0], span[1, 0] + 1):
                        code = x + shape[0] * (y + shape[1] * z)
                        bucket = bucket_at(code, bits)
                        if write:
                            start[bucket] -= 1
                            table.thing[start[bucket]], table.code[start[bucket]] = j, code
                        else:
                            start[bucket] += 1
        if not write:
            for bucket in range(len(start) - 1):
                start[bucket + 1] += start[bucket]
