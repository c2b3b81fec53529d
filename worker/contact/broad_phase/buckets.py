"""Search for the boxes near a box, by a bucket sort with position codes (Oldenburg and Nilsson 1994); no grid is stored
in memory.

The code of a cell is ix + nx (iy + ny iz) (the paper's eq. 10). Every box has an entry for each cell that it touches,
and the entries are sorted by a hash of the codes of the cells. To find the boxes near a given box, the search reads the
entries with the codes of the cells of this box. The entries of one code are a short range. The memory is proportional
to the number of boxes, for any distance between the boxes.
"""

from typing import NamedTuple

import numpy as np

from ...kernels.jit import njit, record, types
from ...model.growing import Scratch
from ...model.state import Floats, Indices, Ints
from ...parallel.arguments import reader
from ...parallel.packing import range_offsets
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team

_MOST = 2.0**20
"""Largest number of cells along an axis; with this number, the codes of cells along three axes are far below 2^63."""
_WIDE = 512
"""Largest number of cells that a box with entries touches. A box that touches more cells is compared with all other
boxes."""
_CURVE_BITS = 12
"""Number of bits of each coordinate in the code of the space-filling curve."""
_LEAST_BITS = 6
"""Smallest number of bits of the hash. Entries are first sorted by the upper bits of their hash; then each range of
hashes is sorted separately."""
_BOXES, _RANGES = 512, 4
"""Number of boxes in a task that enters boxes, and number of ranges of hashes in a task. Chosen values: a task takes
about 20 us in a search of 10,000 boxes, compared with 2 us to start a parallel region."""


class Table(NamedTuple):
    """Hash table of bounding boxes. A box is entered for each cell that it touches."""

    origin: Floats
    inverse: float
    """Inverse of the edge length of a cell, 1/m."""
    shape: Ints
    """(3,) number of cells along each axis."""
    bits: int
    """Number of bits of the hash."""
    start: Ints
    """(2^bits + 1,) offset of the first entry of each hash value; the last value is the number of entries."""
    thing: Indices
    """(m,) box to which each entry belongs."""
    code: Ints
    """(m,) code of the cell of each entry."""
    wide: Indices
    """(w,) boxes that touch too many cells and therefore have no entries."""


class Cells(NamedTuple):
    """Grid of cells; its fields are the first columns of a Table."""

    origin: Floats
    inverse: float
    shape: Ints


_I, _F, _F1, _F2, _I1, _I2, _N1 = (
    types.int64, types.float64, types.float64[::1], types.float64[:, ::1], types.int64[::1], types.int64[:, ::1],
    types.int32[::1],
)  # fmt: skip
CELLS = record(Cells, _F1, _F, _I1)
TABLE = record(Table, _F1, _F, _I1, _I, _I1, _N1, _I1, _N1)
_COUNT = _I2, _I1, _N1, CELLS, _F2, _F2
_ENTER = _I1, _N1, _I2, CELLS, _F2, _F2
_ARRANGE = TABLE, _I1, _N1, _I1
_read_count, _read_enter, _read_arrange = reader(*_COUNT), reader(*_ENTER), reader(*_ARRANGE)


class Buckets:
    """Passes that enter boxes into a table by a counting sort: first by the upper bits of the hash, then by all
    bits.
    """

    def __init__(self, team: Team) -> None:
        self._count = Pass(team, _count, *_COUNT, size=_BOXES)
        self._enter = Pass(team, _enter, *_ENTER, size=_BOXES)
        self._arrange = Pass(team, _arrange, *_ARRANGE, size=_RANGES)
        self._scratch = Scratch()

    def sort(self, low: Floats, high: Floats, hull: Floats, edge: float) -> Table:
        """Enters the boxes ``low``, ``high`` (n, 3) into cells. ``hull`` (2, 3): hull of all boxes; ``edge``: edge
        length of a cell, m. The function enlarges it if the hull is too large for the codes. The table is valid until
        the next call.
        """
        n, (least, most) = len(low), hull
        edge = max(edge, float((most - least).max()) / _MOST)
        cells = Cells(least, 1.0 / edge, np.floor((most - least) / edge).astype(np.int64) + 1)
        counts, wide = np.empty((self._count.many(n), 2**_LEAST_BITS), np.int64), self._scratch.of("wide", n, np.int32)
        widths = np.empty(len(counts), np.int64)
        self._count.run(n, counts, widths, wide, cells, low, high)
        begins = np.empty(2**_LEAST_BITS + 1, np.int64)
        total = int(range_offsets(begins, counts))
        kept = wide[: _together(wide, widths)]
        bits = max(_LEAST_BITS, total.bit_length())
        codes, things = self._entries("mixed", total)
        sorted_codes, sorted_things = self._entries("sorted", total)
        self._enter.run(n, codes, things, counts, cells, low, high)
        start = self._scratch.of("start", 2**bits + 1)
        table = Table(*cells, bits, start, sorted_things, sorted_codes, kept)
        self._arrange.run(2**_LEAST_BITS, table, codes, things, begins)
        start[-1] = total
        return table

    def _entries(self, name: str, n: int) -> tuple[Ints, Indices]:
        return self._scratch.of(f"{name} codes", n), self._scratch.of(f"{name} things", n, np.int32)


@njit("int64(float64, float64, float64, int64)", cache=True)
def bucket_of(x, origin, inverse, n):  # type: ignore[no-untyped-def]
    """Index along an axis of the cell that contains a coordinate, limited to 0 ... n - 1."""
    return np.int64(min(max(np.floor((x - origin) * inverse), 0.0), n - 1.0))


@njit(types.void(_I1, _F2, _F1, _F, _I, _I), cache=True)
def interleaved(codes, x, origin, inverse, first, stop):  # type: ignore[no-untyped-def]
    """Sets the codes of the points ``x`` (n, 3), from ``first`` to ``stop``, on a space-filling curve; see
    ScenePasses.curve.
    """
    for a in range(first, stop):
        codes[a] = 0
        for i in range(3):
            cell = bucket_of(x[a, i], origin[i], inverse, 1 << _CURVE_BITS)
            for bit in range(_CURVE_BITS):
                codes[a] |= ((cell >> bit) & 1) << (3 * bit + i)


@njit("int64(int64, int64)", cache=True)
def bucket_at(code, bits):  # type: ignore[no-untyped-def]
    """Hash of a code: the upper ``bits`` of the product of the code and 2^64 / golden ratio (Knuth 1998, 6.4)."""
    return np.int64((np.uint64(code) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(64 - bits))


@njit(_I(_I2, CELLS, _F2, _F2, _I), cache=True)
def _cells(span, cells, low, high, j):  # type: ignore[no-untyped-def]
    """Number of cells that box j touches. Sets ``span`` (2, 3) to the first and the last cell along each axis."""
    many = 1
    for i in range(3):
        span[0, i] = bucket_of(low[j, i], cells.origin[i], cells.inverse, cells.shape[i])
        span[1, i] = bucket_of(high[j, i], cells.origin[i], cells.inverse, cells.shape[i])
        many *= span[1, i] - span[0, i] + 1
    return many


@njit(TASK, cache=True)
def _count(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: counts the entries in each range of hashes, and lists the boxes without entries."""
    counts, widths, wide, cells, low, high = _read_count(table)
    span, n, k, shape = np.empty((2, 3), np.int64), first, first // _BOXES, cells.shape
    for r in range(counts.shape[1]):
        counts[k, r] = 0
    for j in range(first, stop):
        if _cells(span, cells, low, high, j) > _WIDE:
            wide[n] = j
            n += 1
            continue
        for z in range(span[0, 2], span[1, 2] + 1):
            for y in range(span[0, 1], span[1, 1] + 1):
                for x in range(span[0, 0], span[1, 0] + 1):
                    counts[k, bucket_at(x + shape[0] * (y + shape[1] * z), _LEAST_BITS)] += 1
    widths[k] = n - first


@njit("int64(int32[::1], int64[::1])", cache=True)
def _together(wide, widths):  # type: ignore[no-untyped-def]
    """Moves the boxes without entries of all tasks to the front; returns the number of these boxes."""
    n = 0
    for k in range(len(widths)):
        for at in range(k * _BOXES, k * _BOXES + widths[k]):
            wide[n] = wide[at]
            n += 1
    return n


@njit(TASK, cache=True)
def _enter(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: writes the entries of boxes, sorted by ranges of hashes."""
    codes, things, counts, cells, low, high = _read_enter(table)
    span, k, shape = np.empty((2, 3), np.int64), first // _BOXES, cells.shape
    for j in range(first, stop):
        if _cells(span, cells, low, high, j) > _WIDE:
            continue
        for z in range(span[0, 2], span[1, 2] + 1):
            for y in range(span[0, 1], span[1, 1] + 1):
                for x in range(span[0, 0], span[1, 0] + 1):
                    code = x + shape[0] * (y + shape[1] * z)
                    r = bucket_at(code, _LEAST_BITS)
                    at = counts[k, r]
                    codes[at], things[at] = code, j
                    counts[k, r] = at + 1


@njit(TASK, cache=True)
def _arrange(arguments, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sorts the entries of some ranges by all bits of their hashes."""
    table, codes, things, begins = _read_arrange(arguments)
    start, bits = table.start, table.bits
    for r in range(first, stop):
        bucket, stop_bucket = r << (bits - _LEAST_BITS), (r + 1) << (bits - _LEAST_BITS)
        for b in range(bucket, stop_bucket):
            start[b] = 0
        for p in range(begins[r], begins[r + 1]):
            start[bucket_at(codes[p], bits)] += 1
        total = begins[r]
        for b in range(bucket, stop_bucket):
            total += start[b]
            start[b] = total
        for p in range(begins[r + 1] - 1, begins[r] - 1, -1):
            b = bucket_at(codes[p], bits)
            start[b] -= 1
            table.code[start[b]], table.thing[start[b]] = codes[p], things[p]
