"""Tables of candidate pairs, and when a pair need not be tested.

A list of candidates serves many steps, and in most of them most of its pairs are far apart. Every slot has a reference
motion, on a straight line; ``left`` is how far the slot has left it in the step ahead, the larger of the distances at
its beginning and its end without contact. When a pair is tested and is ``slack`` further apart than it could meet at,
it is left alone as long as

    slack > U t + left_1 + left_2, now, + left_1 + left_2, when it was tested,

with U the relative speed of the two reference motions and t the time since; of a face or an edge, ``left`` is that of
its farthest corner. So a pair keeps one number and its U. It is exact: a pair that is left alone would not have met. No
bit of the answer depends on it, and ranks need not agree.

A pair whose node does not face the face is left alone until the face may have turned to it (node_face.py).
"""

from dataclasses import dataclass, field

import numpy as np

from ...kernels.jit import njit
from ...model.growing import Rooms
from ...model.state import Flags, Floats, Indices, Ints
from ..narrow_phase.node_face import chain
from ..narrow_phase.tables import Pairs

_FRESH = {"until": -np.inf, "speed": np.nan, "turned": False, "kept": 0.0, "next": -1}
"""What a pair begins with: it is tested in the next step."""


@dataclass
class PairTable:
    """A growing table of candidate pairs; see tables.Pairs."""

    rows: Indices = field(default_factory=lambda: np.zeros((0, 2), np.int32))
    until: Floats = field(default_factory=lambda: np.zeros(0))
    speed: Floats = field(default_factory=lambda: np.zeros(0))
    turned: Flags = field(default_factory=lambda: np.zeros(0, bool))
    kept: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    """(p, 4) the pair's impulse of the last step times its row norm, zero where it was not active: along the normal,
    and across, m/s."""
    next: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    _active: Indices = field(default_factory=lambda: np.zeros(0, np.int32), init=False, repr=False)
    _tested: tuple[Indices, Ints, Ints] | None = field(default=None, init=False, repr=False)
    _rooms: Rooms = field(default_factory=lambda: Rooms("rows", *_FRESH), init=False, repr=False)

    def __len__(self) -> int:
        """Number of pairs."""
        return len(self.rows)

    def add(self, rows: Indices) -> None:
        """Takes up more pairs, to be tested in the next step."""
        if len(rows):
            self._rooms.append(self, len(rows), rows=rows, **_FRESH)

    def take_tested(self, active: Indices, begins: Ints, counts: Ints) -> None:
        """The pairs that tasks have tested: of ``active``, ``counts`` from each of ``begins`` on."""
        self._tested = active, begins, counts

    @property
    def tested(self) -> Indices:
        """(k,) pairs that the narrow phase of the last step has tested."""
        if self._tested is None:
            return np.zeros(0, np.int32)
        active, begins, counts = self._tested
        return np.concatenate([active[:0], *(active[b : b + n] for b, n in zip(begins, counts, strict=True))])

    def hang(self, first: Indices, begin: int) -> None:
        """Hangs the pairs from row ``begin`` on into the chains of their nodes, ``first`` (slots,)."""
        chain(first, self.next, self.rows, begin)

    def drop(self, one: Flags, two: Flags) -> None:
        """Takes out the pairs whose first thing is among ``one`` or whose second thing is among ``two``."""
        n = _drop(self.rows, self.until, self.speed, self.turned, self.kept, one, two)
        for name in ("rows", "until", "speed", "turned", "kept", "next"):
            setattr(self, name, getattr(self, name)[:n])
        self._tested = None

    @property
    def pushed(self) -> Ints:
        """(k,) which pairs have had impulses in the last step."""
        return np.flatnonzero(self.kept.any(axis=1))

    def recall(self, first: Indices, rows: Indices, kept: Floats) -> None:
        """Pairs of nodes and faces that are among ``rows`` (k, 2) have what these have ``kept``, (k, 4); ``first``: see
        ``hang``.
        """
        _recall(self.kept, first, self.next, self.rows, rows, kept)

    def carried(self, one: Indices, two: Indices) -> "PairTable":
        """The pairs whose things have new numbers ``one`` and ``two``, -1 for those that have gone; in the order of the
        first things, so that what a kernel takes for one pair is at hand for the next.
        """
        some, rows = _renumbered(self.rows, one, two, int(one.max(initial=-1)) + 1)
        return PairTable(
            rows, self.until[some], self.speed[some], self.turned[some], self.kept[some], np.empty(len(some), np.int32)
        )

    def wake(self) -> None:
        """Every pair has to be tested: short lines and mean normals are others."""
        some = ~np.isposinf(self.until)
        self.until[some], self.speed[some] = -np.inf, np.nan

    def arrays(self) -> Pairs:
        """As kernels take it."""
        if len(self._active) < len(self.rows):
            self._active = np.empty(2 * len(self.rows), np.int32)
        return Pairs(self.rows, self.until, self.speed, self.turned, self.next, self._active)


@njit("void(float64[:, ::1], int32[::1], int32[::1], int32[:, ::1], int32[:, ::1], float64[:, ::1])", cache=True)
def _recall(kept, first, following, pairs, rows, values):  # type: ignore[no-untyped-def]
    for k in range(len(rows)):
        p = first[rows[k, 0]]
        while p >= 0 and pairs[p, 1] != rows[k, 1]:
            p = following[p]
        if p >= 0:
            for i in range(4):
                kept[p, i] = values[k, i]


@njit("Tuple((int64[::1], int32[:, ::1]))(int32[:, ::1], int32[::1], int32[::1], int64)", cache=True)
def _renumbered(pairs, one, two, n):  # type: ignore[no-untyped-def]
    """Which ``pairs`` (p, 2) both ``one`` and ``two`` have numbers for, by ascending number of the first thing, which
    is less than ``n``; and their numbers.
    """
    begin = np.zeros(n + 1, np.int64)
    for p in range(len(pairs)):
        if one[pairs[p, 0]] >= 0 and two[pairs[p, 1]] >= 0:
            begin[one[pairs[p, 0]] + 1] += 1
    for a in range(n):
        begin[a + 1] += begin[a]
    some, rows = np.empty(begin[n], np.int64), np.empty((begin[n], 2), np.int32)
    for p in range(len(pairs)):
        a, b = one[pairs[p, 0]], two[pairs[p, 1]]
        if a >= 0 and b >= 0:
            at = begin[a]
            begin[a] += 1
            some[at], rows[at, 0], rows[at, 1] = p, a, b
    return some, rows


@njit(
    "int64(int32[:, ::1], float64[::1], float64[::1], boolean[::1], float64[:, ::1], boolean[::1], boolean[::1])",
    cache=True,
)
def _drop(rows, until, speed, turned, kept, one, two):  # type: ignore[no-untyped-def]
    n = 0
    for p in range(len(rows)):
        a, b = rows[p, 0], rows[p, 1]
        if one[a] or two[b]:
            continue
        if n < p:
            rows[n, 0], rows[n, 1] = a, b
            until[n], speed[n], turned[n] = until[p], speed[p], turned[p]
            for i in range(4):
                kept[n, i] = kept[p, i]
        n += 1
    return n
