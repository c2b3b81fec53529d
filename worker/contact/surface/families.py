"""Families of nodes. A family consists of a node of the initial mesh and all its copies. A rank with a tet at a node
has all nodes of the family.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from ...kernels.jit import njit, record, types
from ...model.columns import COPIED, ZERO
from ...model.growing import Scratch
from ...model.state import Bits, Indices, Ints
from ...model.topology import Split
from ...parallel.arguments import reader
from ...parallel.packing import offsets, range_offsets
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team

_N1, _N2, _I, _I1, _I2 = types.int32[::1], types.int32[:, ::1], types.int64, types.int64[::1], types.int64[:, ::1]
_CRACKS, _BITS, _RANGES = 512, 6, 4
"""Three constants of the sort: number of cracks in a task; number of bits of the index of a range of leaders; number of
ranges in a task. Chosen values: a task takes 5 to 10 us with 20,000 cracks, compared with 2 us to start a parallel
region."""
_ROWS = 4096
"""Number of cracks in a task; chosen value: a task takes 10 to 20 us, compared with 2 us to start a parallel region."""
_SPARE = 1 << 15
"""Number of items; the length of a working array is a multiple of it."""


@dataclass
class Families:
    """Families of the local nodes of a rank."""

    COLUMNS: ClassVar = {"root": COPIED, "ring": ZERO, "leader": COPIED, "marks": ZERO}
    """Columns with one value for each node (model/columns.py)."""

    root: Ints
    """(nodes,) global id of the node of the initial mesh from which each node originates."""
    ring: Indices
    """(nodes,) next local node of the family of each node, in cyclic order; the node itself if the family has one
    node."""
    leader: Indices
    """(nodes,) leader of the family of each node; the leader is the local node that represents the family."""
    marks: Bits
    """(nodes,) marks that kernels use to list nodes. All marks are 0 between two calls."""

    @classmethod
    def of(cls, root: Ints) -> "Families":
        """Links the nodes that have equal values in ``root`` (nodes,) in a ring."""
        (ring, leader), order = np.empty((2, len(root)), np.int32), np.argsort(root, kind="stable")
        first = np.flatnonzero(np.append(True, np.diff(root[order]) != 0)[: len(root)])
        following, ends = np.roll(order, -1), np.append(first, len(root))[1:]
        following[ends - 1] = order[first]
        ring[order], leader[order] = following, np.repeat(order[first], ends - first)
        return cls(root, ring, leader, np.zeros(len(root), np.uint8))

    def link(self, split: Split) -> None:
        """Adds the copies of separated nodes to the rings of their parents. The columns must already have the rows of
        the copies.
        """
        _insert(self.ring, split.copies.parents, split.first)


@njit("void(int32[::1], int64[::1], int64)", cache=True)
def _insert(ring, parents, first):  # type: ignore[no-untyped-def]
    """Inserts copies into the rings, each after its parent. The local indices of the copies start at ``first``."""
    for c in range(len(parents)):
        ring[first + c], ring[parents[c]] = ring[parents[c]], first + c


class Corners(NamedTuple):
    """Corners of narrow sides, at nodes that have separated into three pieces or more. The corners are ordered by
    family.
    """

    members: Indices
    """Nodes of the families, family after family."""
    begin: Indices
    """(families + 1,) index in ``members`` of the first member of each family."""
    among: Indices
    """(nodes,) index in ``members`` of each node of a family."""
    corners: Indices
    """Codes of the corners, family after family. A code is 8 crack + 4 side + corner (0 to 2)."""
    start: Indices
    """(families + 1,) index in ``corners`` of the first corner of each family."""


CORNERS = record(Corners, _N1, _N1, _N1, _N1, _N1)
_GATHER = _N1, _N1, _I1, _I2, _N2, types.int32[:, :, ::1], _I, _N1, _N1, _I
_SPREAD = _N1, _N1, _I2, _N1, _N1, _I1, _I
_COUNT = _N1, _N1, _I1, _I1, _N1, _I1, _N1, _I
_LIST = CORNERS, _N1, _N1, _I1, _I1, _I1, _N1, _N1, _I1, _N1
_read_gather, _read_spread, _read_count, _read_list = (
    reader(*_GATHER),
    reader(*_SPREAD),
    reader(*_COUNT),
    reader(*_LIST),
)


class CornerLists:
    """Passes of the threads that list the corners of narrow sides, ordered by family. The list of corners is made by a
    counting sort of the leaders of families, first by ranges of leaders, then within each range.
    """

    def __init__(self, team: Team) -> None:
        self._gather, self._spread = (
            Pass(team, _gather, *_GATHER, size=_CRACKS),
            Pass(team, _spread, *_SPREAD, size=_CRACKS),
        )
        self._count, self._list = Pass(team, _count, *_COUNT, size=_RANGES), Pass(team, _list, *_LIST, size=_RANGES)
        self._scratch = Scratch()
        self.touching = TouchingRows(team)
        """Pass of the threads that finds the cracks at marked nodes."""

    def of(self, cracks: Indices, sides: Indices, block: int, families: Families) -> Corners:
        """Returns the ``Corners`` of a ``block``, which are valid until the next call for this block.

        ``cracks`` (m, 6) nodes of all cracks and ``sides`` (m, 2, 3): see Cracks.
        """
        m, nodes, ring = len(cracks), len(families.ring), families.ring
        shift = max(0, (nodes - 1).bit_length() - _BITS)
        many, ranges, of = self._gather.many(m), 1 << _BITS, self._scratch.of
        code, leader, codes, leaders, heads = self._rooms(6 * m)
        counts, by_range, begins = of("counts", many), of("by range", many, np.int64, ranges), of("begins", ranges + 1)
        self._gather.run(m, code, leader, counts, by_range, cracks, sides, block, ring, families.leader, shift)
        n = int(range_offsets(begins, by_range))
        self._spread.run(m, codes, leaders, by_range, code, leader, counts, shift)
        some, all_members, first, first_member = (of(f"sizes {k}", ranges) for k in range(4))
        number = of("number", nodes, np.int32)
        self._count.run(ranges, number, heads, some, all_members, leaders, begins, ring, shift)
        f, total = int(offsets(first, some)), int(offsets(first_member, all_members))
        found = self._found(block, total, f, nodes, n)
        self._list.run(ranges, found, number, heads, some, first, first_member, codes, leaders, begins, ring)
        return found

    def _rooms(self, n: int) -> list[Indices]:
        """Returns working arrays of at least ``n`` items. If the number of corners grows little, the same arrays are
        returned again.
        """
        enough = -(-n // _SPARE) * _SPARE
        return [self._scratch.of(name, enough, np.int32) for name in ("code", "leader", "codes", "leaders", "heads")]

    def _found(self, block: int, members: int, families: int, nodes: int, corners: int) -> Corners:
        """Returns the arrays to which the result is written."""
        of = self._scratch.of
        found = Corners(
            of(f"members {block}", members, np.int32), of(f"begin {block}", families + 1, np.int32),
            of(f"among {block}", nodes, np.int32), of(f"corners {block}", corners, np.int32),
            of(f"start {block}", families + 1, np.int32),
        )  # fmt: skip
        found.begin[families], found.start[families] = members, corners
        return found


@njit(TASK, cache=True)
def _gather(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: lists the corners of narrow sides in families of three nodes or more, and counts the corners in each range
    of leaders.
    """
    code, leader, counts, by_range, cracks, sides, block, ring, leads, shift = _read_gather(table)
    k, n = first // _CRACKS, 6 * first
    for r in range(by_range.shape[1]):
        by_range[k, r] = 0
    for c in range(first, stop):
        for h in range(2):
            if sides[c, h, 1] < 0 or sides[c, h, 0] != block:
                continue
            for i in range(3):
                p = cracks[c, 3 * h + i]
                if p != cracks[c, 3 - 3 * h + i] and ring[ring[p]] != p:
                    code[n], leader[n] = 8 * c + 4 * h + i, leads[p]
                    by_range[k, leads[p] >> shift] += 1
                    n += 1
    counts[k] = n - 6 * first


@njit(TASK, cache=True)
def _spread(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sorts the corners by ranges of leaders."""
    codes, leaders, places, code, leader, counts, shift = _read_spread(table)
    k = first // _CRACKS
    for i in range(6 * first, 6 * first + counts[k]):
        r = leader[i] >> shift
        at = places[k, r]
        codes[at], leaders[at], places[k, r] = code[i], leader[i], at + 1


@njit(TASK, cache=True)
def _count(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets ``number`` (nodes,) to the number of corners of each leader in some ranges. Lists the leaders with
    corners in ``heads``, and counts these leaders and the members of their families.
    """
    number, heads, some, members, leaders, begins, ring, shift = _read_count(table)
    for r in range(first, stop):
        begin, end = min(r << shift, len(number)), min((r + 1) << shift, len(number))
        n, total = begins[r], 0
        for a in range(begin, end):
            number[a] = 0
        for i in range(begins[r], begins[r + 1]):
            number[leaders[i]] += 1
        for a in range(begin, end):
            if number[a] > 0:
                heads[n], n, total, d = a, n + 1, total + 1, ring[a]
                while d != a:
                    total, d = total + 1, ring[d]
        some[r], members[r] = n - begins[r], total


@njit(TASK, cache=True)
def _list(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: lists the families of some ranges of leaders, with the members and corners of the families."""
    out, number, heads, some, first_family, first_member, codes, leaders, begins, ring = _read_list(table)
    for r in range(first, stop):
        f, m, n = first_family[r], first_member[r], begins[r]
        for i in range(begins[r], begins[r] + some[r]):
            a = heads[i]
            out.begin[f], out.start[f], d, f = m, n, a, f + 1
            n, number[a] = n + number[a], n
            while m == out.begin[f - 1] or d != a:
                out.members[m], out.among[d], d, m = d, m, ring[d], m + 1
        for i in range(begins[r], begins[r + 1]):
            a = leaders[i]
            out.corners[number[a]] = codes[i]
            number[a] += 1


_TOUCHING = _I1, _I1, _N2, types.uint8[::1]
_read_touching = reader(*_TOUCHING)


class TouchingRows:
    """Pass of the threads that finds the rows of a table that contain a marked element."""

    def __init__(self, team: Team) -> None:
        self._pass, self._scratch = Pass(team, _touching, *_TOUCHING, size=_ROWS), Scratch()

    def of(self, table: Indices, marks: Bits) -> Ints:
        """Returns the rows, ascending, of ``table`` (n, 6) that contain a marked element."""
        rows, counts = self._scratch.of("rows", len(table)), self._scratch.of("counts", self._pass.many(len(table)))
        self._pass.run(len(table), rows, counts, table, marks)
        return np.asarray(_packed(rows, counts))


@njit(TASK, cache=True)
def _touching(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: lists the rows that contain a marked element."""
    rows, counts, nodes, marks = _read_touching(table)
    n = first
    for i in range(first, stop):
        some = 0
        for k in range(6):
            some |= marks[nodes[i, k]]
        if some:
            rows[n], n = i, n + 1
    counts[first // _ROWS] = n - first


@njit("int64[::1](int64[::1], int64[::1])", cache=True)
def _packed(rows, counts):  # type: ignore[no-untyped-def]
    """Returns the rows that the tasks have listed, as one array."""
    out, n = np.empty(counts.sum(), np.int64), 0
    for k in range(len(counts)):
        for i in range(_ROWS * k, _ROWS * k + counts[k]):
            out[n], n = rows[i], n + 1
    return out
