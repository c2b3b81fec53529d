"""Search for pairs of boxes that overlap. The smaller set of boxes is entered in buckets."""

import numpy as np

from ...kernels.jit import njit, types
from ...model.growing import Scratch
from ...model.state import Flags, Indices, Ints
from ...parallel.arguments import reader
from ...parallel.packing import offsets
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team
from .boxes import SOUGHT, Sought
from .buckets import TABLE, Table, bucket_at, bucket_of

_LARGE = 128
"""Number of large primitives in a task. Chosen value: a task takes about 30 us, compared with 2 us to start a parallel
region."""
_EACH, _MOST = 8, 64
"""Number of pairs for which memory is first reserved, for each large primitive, as a mean over a task; and largest
number of pairs of a large primitive."""
_I, _B2, _N1, _N2, _I1 = (
    types.int64, types.boolean[:, ::1], types.int32[::1], types.int32[:, ::1], types.int64[::1],
)  # fmt: skip
_FOUND = TABLE, SOUGHT, SOUGHT, _I1, _N1, _B2
_PAIRS = _N2, _I1, _N2, _I, _I1, *_FOUND
_read = reader(*_PAIRS)
_NO_PAIRS, _NOWHERE = np.zeros((0, 2), np.int32), np.zeros(0, np.int64)
"""Arguments of the tasks in the first pass, in which there are no results and no places."""


@njit("boolean(int32[:, ::1], int64, int32[:, ::1], int64, int64, int64)", cache=True)
def _meet(small, few, large, many, i, j):  # type: ignore[no-untyped-def]
    """Returns True if two primitives have a common corner. ``few`` and ``many``: numbers of corners of the two
    primitives.
    """
    for a in range(few):
        for b in range(many):
            if small[i, a] == large[j, b]:
                return True
    return False


@njit(_I(_N2, _I, _I, *_FOUND, _I, _I), cache=True)
def _ask(out, n, end, table, small, large, rank, part, allowed, asked, stop):  # type: ignore[no-untyped-def]
    """Finds the small primitives near each large primitive from ``asked`` to ``stop``, in the buckets that its box
    touches.

    Writes the pairs into the rows of ``out`` from ``n`` on, but not beyond the row ``end``. Returns the number of
    pairs. A pair must satisfy five conditions; comments in the code have their numbers:

        +-----------+          1. The entry has the code of the cell, not only its hash.
        |     +-----|----+     2. The two boxes overlap.
        |     |     |    |     3. The cell contains the lowest corner, x, of the intersection of the boxes: a pair is
        |     x-----+    |        found in one cell only.
        +-----+----------+     4. The small primitive has the lower rank.
                               5. The parts of the two may be in contact, and they have no common corner.
    """
    few_low, few_high, box_low, box_high = small.low, small.high, large.low, large.high
    few, many, every, others, begun = small.corners, large.corners, small.some, large.some, n
    origin, inverse, shape, bits = table.origin, table.inverse, table.shape, table.bits
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    for at in range(asked, stop):
        cells = 1  # loop over the cells of the box of the large primitive
        for i in range(3):
            first[i] = bucket_of(box_low[at, i], origin[i], inverse, shape[i])
            last[i] = bucket_of(box_high[at, i], origin[i], inverse, shape[i])
            cells *= last[i] - first[i] + 1
        alone = cells > len(every)  # a box with so many cells is compared with every small primitive
        if alone:
            last[:] = first
        for z in range(first[2], last[2] + 1):
            for y in range(first[1], last[1] + 1):
                for x in range(first[0], last[0] + 1):
                    code = x + shape[0] * (y + shape[1] * z)
                    begin, end_of_code = np.int64(0), np.int64(0)
                    if not alone:
                        bucket = bucket_at(code, bits)
                        begin, end_of_code = np.int64(table.start[bucket]), np.int64(table.start[bucket + 1])
                    apart = end_of_code - begin
                    if x == first[0] and y == first[1] and z == first[2]:  # first cell: add primitives without entries
                        end_of_code += len(every) if alone else len(table.wide)
                    for p in range(begin, end_of_code):
                        if p - begin < apart:
                            if table.code[p] != code:  # condition 1: the entry has the code of the cell
                                continue
                            b = table.thing[p]
                        else:
                            b = p - begin if alone else table.wide[p - begin - apart]
                        if few_low[b, 0] > box_high[at, 0] or few_low[b, 1] > box_high[at, 1]:  # condition 2
                            continue
                        if few_low[b, 2] > box_high[at, 2] or few_high[b, 0] < box_low[at, 0]:
                            continue
                        if few_high[b, 1] < box_low[at, 1] or few_high[b, 2] < box_low[at, 2]:
                            continue
                        if p - begin < apart:  # condition 3: the cell contains the lowest corner of the intersection
                            if bucket_of(max(few_low[b, 0], box_low[at, 0]), origin[0], inverse, shape[0]) != x:
                                continue
                            if bucket_of(max(few_low[b, 1], box_low[at, 1]), origin[1], inverse, shape[1]) != y:
                                continue
                            if bucket_of(max(few_low[b, 2], box_low[at, 2]), origin[2], inverse, shape[2]) != z:
                                continue
                        i, j = every[b], others[at]
                        if len(rank) > 0 and rank[i] >= rank[j]:  # condition 4: the small primitive has the lower rank
                            continue
                        if not allowed[part[few[i, 0]], part[many[j, 0]]]:  # condition 5
                            continue
                        if _meet(few, small.many, many, large.many, i, j):
                            continue
                        if n < end:
                            out[n, 0], out[n, 1] = i, j
                        n += 1
    return n - begun


@njit(TASK, cache=True)
def _pairs(arguments, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``_ask``, in two passes.

    In the first pass there are no places in ``out``; the task counts the pairs and writes them to ``found``, which has
    memory for ``each`` pairs of a large primitive. In the second pass the task copies its pairs to their places, which
    begin at ``begins``. If ``found`` was too small, the task finds the pairs again.
    """
    out, begins, found, each, counts, table, small, large, rank, part, allowed = _read(arguments)
    k, room = first // _LARGE, each * first
    if len(begins) == 0:
        counts[k] = _ask(found, room, each * stop, table, small, large, rank, part, allowed, first, stop)
        return
    begin, end = begins[k], begins[k] + counts[k]
    if counts[k] > each * (stop - first):
        _ask(out, begin, end, table, small, large, rank, part, allowed, first, stop)
        return
    for p in range(counts[k]):
        out[begin + p, 0], out[begin + p, 1] = found[room + p, 0], found[room + p, 1]


class Overlaps:
    """Passes over the large primitives of a search."""

    def __init__(self, team: Team) -> None:
        self._pass, self._scratch, self._each = Pass(team, _pairs, *_PAIRS, size=_LARGE), Scratch(), _EACH

    def of(self, table: Table, small: Sought, large: Sought, rank: Ints, part: Indices, allowed: Flags) -> Indices:
        """(pairs, 2) primitives whose boxes overlap: row of the small primitive, and row of the large primitive; see
        search.find. The small primitives are in the ``table``.
        """
        n, each = len(large.some), self._each
        begins, counts = np.empty((2, self._pass.many(n)), np.int64)
        rest = self._scratch.of("pairs", each * n, np.int32, 2), each, counts, table, small, large, rank, part, allowed
        self._pass.run(n, _NO_PAIRS, _NOWHERE, *rest)
        total = int(offsets(begins, counts))
        out = np.empty((total, 2), np.int32)
        self._pass.run(n, out, begins, *rest)
        self._each = min(max(each, -(-2 * total // n)), _MOST)
        return out
