"""Families: a family is all copies of one original node of the start, with the node itself. A rank with a tet at a node
has all nodes of the family.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...kernels.jit import njit, record, types
from ...model.growing import Scratch
from ...model.state import Flags, Indices, Ints, extended
from ...model.topology import Split
from ...parallel.arguments import reader
from ...parallel.packing import offsets, range_offsets
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team

_N1, _N2, _I, _I1, _I2 = types.int32[::1], types.int32[:, ::1], types.int64, types.int64[::1], types.int64[:, ::1]
_CRACKS, _BITS, _RANGES = 512, 6, 4
"""Number of cracks in a task; number of bits of the index of a range of leaders; number of ranges in a task. Chosen
values: a task takes 5 to 10 us with 20,000 cracks, compared with 2 us to start a parallel region."""
_SPARE = 1 << 15
"""Working arrays have multiples of so many items."""


@dataclass
class Families:
    """Families of the local nodes."""

    root: Ints
    """(nodes,) global id of the original node at the start of the run."""
    ring: Indices
    """(nodes,) next local node of the family, cyclic; the node itself if the family has one node."""
    leader: Indices
    """(nodes,) local node that represents the family."""

    @classmethod
    def of(cls, root: Ints) -> "Families":
        """Links the nodes of each ``root`` (nodes,) in a ring."""
        (ring, leader), order = np.empty((2, len(root)), np.int32), np.argsort(root, kind="stable")
        first = np.flatnonzero(np.append(True, np.diff(root[order]) != 0)[: len(root)])
        following, ends = np.roll(order, -1), np.append(first, len(root))[1:]
        following[ends - 1] = order[first]
        ring[order], leader[order] = following, np.repeat(order[first], ends - first)
        return cls(root, ring, leader)

    def grow(self, split: Split) -> None:
        """Adds the copies of a split."""
        parents = split.copies.parents
        self.root = extended(self.root, self.root[parents])
        self.ring = extended(self.ring, np.zeros(len(parents), np.int32))
        self.leader = extended(self.leader, self.leader[parents])
        _insert(self.ring, parents, split.first)

    def members(self, nodes: Ints) -> Flags:
        """(nodes,) nodes in the family of one of the ``nodes`` (k,)."""
        return np.asarray(_members(self.ring, nodes))


@njit("void(int32[::1], int64[::1], int64)", cache=True)
def _insert(ring, parents, first):  # type: ignore[no-untyped-def]
    """Inserts copies, numbered from ``first`` on, into the ring after their parents."""
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


class Corners(NamedTuple):
    """Corners of narrow sides at nodes that have separated into three pieces or more, by family."""

    members: Indices
    """Nodes of the families, one family after the other."""
    begin: Indices
    """(families + 1,) offsets of the members of each family."""
    among: Indices
    """(nodes,) position of a node of a family in ``members``."""
    corners: Indices
    """Codes 8 crack + 4 side + corner (0 to 2), one family after the other."""
    start: Indices
    """(families + 1,) offsets of the corners of each family."""


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
    """Passes that list the corners of narrow sides by family: a counting sort by the leader of the family, first by
    ranges of leaders, then within each range.
    """

    def __init__(self, team: Team) -> None:
        self._gather, self._spread = (
            Pass(team, _gather, *_GATHER, size=_CRACKS),
            Pass(team, _spread, *_SPREAD, size=_CRACKS),
        )
        self._count, self._list = Pass(team, _count, *_COUNT, size=_RANGES), Pass(team, _list, *_LIST, size=_RANGES)
        self._scratch = Scratch()

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
        """Working arrays of at least ``n`` items, the same ones while the number of corners grows little."""
        enough = -(-n // _SPARE) * _SPARE
        return [self._scratch.of(name, enough, np.int32) for name in ("code", "leader", "codes", "leaders", "heads")]

    def _found(self, block: int, members: int, families: int, nodes: int, corners: int) -> Corners:
        """Returns arrays for the result."""
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
    """Task: lists the corners of narrow sides in families of three nodes or more, and counts them by range."""
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
    """Task: sorts corners by ranges of leaders."""
    codes, leaders, places, code, leader, counts, shift = _read_spread(table)
    k = first // _CRACKS
    for i in range(6 * first, 6 * first + counts[k]):
        r = leader[i] >> shift
        at = places[k, r]
        codes[at], leaders[at], places[k, r] = code[i], leader[i], at + 1


@njit(TASK, cache=True)
def _count(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets ``number`` (nodes,) to the number of corners of each leader of some ranges, lists the leaders with
    corners in ``heads``, and counts these and the members of their families.
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
    """Task: lists the families of some ranges, with their members and corners."""
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
