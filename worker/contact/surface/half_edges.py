"""Search for pairs of half edges. A half edge is an edge of one face; a pair makes an edge between two faces. The half
edges are found by a counting sort by their lower nodes.

The sort is first by ranges of nodes, then by nodes within each range, so that the threads of a rank can share all
passes.
"""

import numpy as np

from ...kernels.jit import njit, types
from ...model.growing import Scratch
from ...model.state import Flags, Floats, Indices
from ...parallel.arguments import reader
from ...parallel.packing import Packing, offsets, range_offsets
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team

_FACES, _BITS, _RANGES = 1024, 6, 4
"""Three constants of the sort: number of faces in a task; number of bits of the index of a range of nodes; number of
ranges in a task. Chosen values: a task takes about 20 us with 60,000 faces, compared with 2 us to start a parallel
region."""
_EACH = 3
"""Number of edges for each face for which memory is reserved, as a mean over the faces of a task."""
_I, _F, _I1, _I2, _N1, _N2 = (
    types.int64, types.float64, types.int64[::1], types.int64[:, ::1], types.int32[::1], types.int32[:, ::1],
)  # fmt: skip
_HALVES = _N2, types.boolean[:, ::1], _I
_COUNT = _I2, *_HALVES
_SPREAD = _N1, _N1, _I2, *_HALVES
_ARRANGE = _I1, _N1, _N1, _N1, _N1, _I1, _N2, _I
_MATCH = _N2, _I1, _I1, _I1, _N1, _N1, _N2, types.boolean[:, ::1], types.float64[:, ::1], _F
_read_count, _read_spread = reader(*_COUNT), reader(*_SPREAD)
_read_arrange, _read_match = reader(*_ARRANGE), reader(*_MATCH)


@njit(TASK, cache=True)
def _count(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: counts the half edges of faces in each range of their lower nodes."""
    counts, corners, half, shift = _read_count(table)
    task = first // _FACES
    for r in range(counts.shape[1]):
        counts[task, r] = 0
    for f in range(first, stop):
        for k in range(3):
            if half[f, k]:
                counts[task, min(corners[f, k], corners[f, (k + 1) % 3]) >> shift] += 1


@njit(TASK, cache=True)
def _spread(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sorts the half edges of faces by ranges of their lower nodes. A half edge is stored as its higher node and
    the number 3 face + corner.
    """
    higher, which, places, corners, half, shift = _read_spread(table)
    task = first // _FACES
    for f in range(first, stop):
        for k in range(3):
            if half[f, k]:
                a, b = corners[f, k], corners[f, (k + 1) % 3]
                r = min(a, b) >> shift
                at = places[task, r]
                higher[at], which[at], places[task, r] = max(a, b), 3 * f + k, at + 1


@njit("int32(int32[:, ::1], int64)", cache=True, forceinline=True)
def _lower(corners, which):  # type: ignore[no-untyped-def]
    """Number of the lower node of a half edge."""
    f, k = which // 3, which % 3
    return min(corners[f, k], corners[f, (k + 1) % 3])


@njit(TASK, cache=True)
def _arrange(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sorts the half edges of some ranges by their lower nodes. Sets ``begin`` (nodes + 1,) to the first half
    edge of each node.
    """
    begin, higher, which, mixed_higher, mixed_which, begins, corners, shift = _read_arrange(table)
    for r in range(first, stop):
        low, high = min(r << shift, len(begin) - 1), min((r + 1) << shift, len(begin) - 1)
        for a in range(low, high):
            begin[a] = 0
        for i in range(begins[r], begins[r + 1]):
            begin[_lower(corners, mixed_which[i])] += 1
        total = begins[r]
        for a in range(low, high):
            total += begin[a]
            begin[a] = total
        for i in range(begins[r + 1] - 1, begins[r] - 1, -1):
            a = _lower(corners, mixed_which[i])
            begin[a] -= 1
            higher[begin[a]], which[begin[a]] = mixed_higher[i], mixed_which[i]


@njit(TASK, cache=True)
def _match(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: finds the edges of faces. Writes as many edges as ``found`` has rows; see HalfEdges.pairs."""
    found, places, counts, begin, higher, which, corners, half, units, sharp = _read_match(table)
    task = first // _FACES
    n, end = places[task], places[task + 1]
    for f in range(first, stop):
        start = n
        for k in range(3):
            if not half[f, k]:
                continue
            a, b, c = corners[f, k], corners[f, (k + 1) % 3], corners[f, (k + 2) % 3]
            low, high = min(a, b), max(a, b)
            for i in range(begin[low], begin[low + 1]):
                if higher[i] != high or which[i] <= 3 * f + k:
                    continue
                g, m = which[i] // 3, which[i] % 3
                if corners[g, m] == a or corners[g, (m + 2) % 3] == c:
                    continue
                cosine = units[f, 0] * units[g, 0] + units[f, 1] * units[g, 1] + units[f, 2] * units[g, 2]
                n += 1
                if n > end:
                    continue
                j = n - 1
                while j > start and found[j - 1, 2] > g:
                    for q in range(5):
                        found[j, q] = found[j - 1, q]
                    j -= 1
                found[j, 0], found[j, 1], found[j, 2], found[j, 3], found[j, 4] = f, k, g, m, cosine < sharp
    counts[task] = n - places[task]


class HalfEdges:
    """Passes over the half edges of faces."""

    def __init__(self, team: Team) -> None:
        self._count, self._spread = Pass(team, _count, *_COUNT, size=_FACES), Pass(team, _spread, *_SPREAD, size=_FACES)
        self._arrange = Pass(team, _arrange, *_ARRANGE, size=_RANGES)
        self._match, self._packing = Pass(team, _match, *_MATCH, size=_FACES), Packing(team, _FACES)
        self._scratch = Scratch()

    def pairs(self, corners: Indices, half: Flags, units: Floats, nodes: int, sharp: float) -> Indices:
        """(p, 5) edges, ordered by face and then by other face. Columns: a face and the number of its half edge; the
        other face and the number of its half edge; sharpness.

        ``corners`` (f, 3 or more): corners of faces in the order of ascending face ids; corners are below ``nodes``.
        ``half`` (f, 3): True for each half edge that must be matched; half edge k goes from corner k to the next
        corner. ``sharp``: cosine of the smallest angle between the normals ``units`` of the two faces.
        """
        n, shift, ranges, of = len(corners), max(0, (nodes - 1).bit_length() - _BITS), 1 << _BITS, self._scratch.of
        tasks = self._count.many(n)
        counts, begins = np.empty((tasks, ranges), np.int64), np.empty(ranges + 1, np.int64)
        self._count.run(n, counts, corners, half, shift)
        many = int(range_offsets(begins, counts))
        mixed, ordered = ([of(f"{a} {b}", many, np.int32) for b in ("higher", "which")] for a in ("mixed", "ordered"))
        self._spread.run(n, *mixed, counts, corners, half, shift)
        begin = of("begin", nodes + 1)
        begin[nodes] = many
        self._arrange.run(ranges, begin, *ordered, *mixed, begins, corners, shift)
        room, found = _EACH * np.minimum(_FACES * np.arange(tasks + 1), n), of("found", _EACH * n, np.int32, 5)
        number, places = np.empty(tasks, np.int64), np.empty(tasks, np.int64)
        rest = begin, *ordered, corners, half, units, sharp
        self._match.run(n, found, room, number, *rest)
        total = int(offsets(places, number))
        out = np.empty((total, 5), np.int32)
        if (number > np.diff(room)).any():
            self._match.run(n, out, np.append(places, total), number, *rest)
        else:
            self._packing.run(n, out, found, places, number, _EACH)
        return out
