"""Tables of candidate pairs, and the condition under which a pair is not tested.

A list of candidates is used for many steps, and in most steps most pairs are far apart. Every slot has a reference
motion on a straight line; ``left`` is the distance of the slot from this line in the next step. This distance is the
larger one of the distances at the beginning and at the end of the step, without contact. If the test of a pair shows
that its distance is larger than the distance of contact by ``slack``, the pair is not tested again as long as

    slack > U t + left_1 + left_2 (now) + left_1 + left_2 (when it was tested),

Here U is the relative speed of the two reference motions, and t is the time since the test. For a face or an edge,
``left`` is the distance of the farthest corner. Therefore a pair stores one number and U. The condition is exact: a
pair that is not tested cannot be active. Ranks may test different pairs without an effect on the answer.

If the face of a pair is turned away from the node, the pair is not tested until the face may have turned towards the
node (node_face.py).
"""

from dataclasses import dataclass, field

import numpy as np

from ...kernels.jit import njit
from ...model.growing import Rooms
from ...model.state import Flags, Floats, Indices, Ints
from ..narrow_phase.node_face import chain
from ..narrow_phase.tables import Pairs

_FRESH = {"until": -np.inf, "speed": np.nan, "turned": False, "kept": 0.0, "next": -1}
"""Initial values of a pair, with which the pair is tested in the next step."""


@dataclass
class PairTable:
    """Growing table of candidate pairs; see tables.Pairs."""

    rows: Indices = field(default_factory=lambda: np.zeros((0, 2), np.int32))
    until: Floats = field(default_factory=lambda: np.zeros(0))
    speed: Floats = field(default_factory=lambda: np.zeros(0))
    turned: Flags = field(default_factory=lambda: np.zeros(0, bool))
    kept: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    """(p, 4) stored impulse of each pair in the last step, multiplied by its row norm, m/s: along the normal, and
    across it. The stored impulse is zero if the pair was not active."""
    next: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    _active: Indices = field(default_factory=lambda: np.zeros(0, np.int32), init=False, repr=False)
    _tested: tuple[Indices, Ints, Ints] | None = field(default=None, init=False, repr=False)
    _rooms: Rooms = field(default_factory=lambda: Rooms("rows", *_FRESH), init=False, repr=False)

    def __len__(self) -> int:
        """Number of pairs."""
        return len(self.rows)

    def add(self, rows: Indices) -> None:
        """Adds pairs to the table. The added pairs are tested in the next step."""
        if len(rows):
            self._rooms.append(self, len(rows), rows=rows, **_FRESH)

    def take_tested(self, active: Indices, begins: Ints, counts: Ints) -> None:
        """Stores which pairs the tasks have tested. The pairs of a task are ``counts`` elements of ``active``, from
        ``begins`` on.
        """
        self._tested = active, begins, counts

    @property
    def tested(self) -> Indices:
        """(k,) pairs that the narrow phase of the last step tested."""
        if self._tested is None:
            return np.zeros(0, np.int32)
        active, begins, counts = self._tested
        return np.concatenate([active[:0], *(active[b : b + n] for b, n in zip(begins, counts, strict=True))])

    def hang(self, first: Indices, begin: int) -> None:
        """Adds the pairs from row ``begin`` on to the linked lists of their nodes; ``first`` (slots,): first pair of
        each list.
        """
        chain(first, self.next, self.rows, begin)

    def drop(self, one: Flags, two: Flags) -> None:
        """Removes the pairs whose first member is in ``one`` or whose second member is in ``two``."""
        n = _drop(self.rows, self.until, self.speed, self.turned, self.kept, one, two)
        for name in ("rows", "until", "speed", "turned", "kept", "next"):
            setattr(self, name, getattr(self, name)[:n])
        self._tested = None

    @property
    def pushed(self) -> Ints:
        """(k,) pairs that had impulses in the last step."""
        return np.asarray(_with_impulses(self.kept))

    def recall(self, first: Indices, rows: Indices, kept: Floats) -> None:
        """Sets the stored impulses of the pairs ``rows`` (k, 2), given by node and face, to ``kept`` (k, 4). Pairs that
        are not in the table are ignored. ``first``: see ``hang``.
        """
        _recall(self.kept, first, self.next, self.rows, rows, kept)

    def carried(self, one: Indices, two: Indices) -> "PairTable":
        """Returns the pairs after a change of the numbers of their members. ``one`` and ``two``: new numbers, -1 for a
        removed member. The pairs are ordered by the first member, so that successive pairs in a kernel have common
        data.
        """
        some, rows = _renumbered(self.rows, one, two, int(one.max(initial=-1)) + 1)
        return PairTable(
            rows, self.until[some], self.speed[some], self.turned[some], self.kept[some], np.empty(len(some), np.int32)
        )

    def wake(self) -> None:
        """Schedules all pairs for a test; the call is necessary after a change of the short lines and the mean
        normals.
        """
        some = ~np.isposinf(self.until)
        self.until[some], self.speed[some] = -np.inf, np.nan

    def arrays(self) -> Pairs:
        """Returns the table as a record for kernels."""
        if len(self._active) < len(self.rows):
            self._active = np.empty(2 * len(self.rows), np.int32)
        return Pairs(self.rows, self.until, self.speed, self.turned, self.next, self._active)


@njit("int64[::1](float64[:, ::1])", cache=True)
def _with_impulses(kept):  # type: ignore[no-untyped-def]
    rows, n = np.empty(len(kept), np.int64), 0
    for p in range(len(kept)):
        if kept[p, 0] != 0.0 or kept[p, 1] != 0.0 or kept[p, 2] != 0.0 or kept[p, 3] != 0.0:
            rows[n] = p
            n += 1
    return rows[:n].copy()


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
    """Returns the rows of ``pairs`` (p, 2) whose two members still exist, and the new numbers of these members. ``one``
    and ``two``: new numbers. The rows have the order of the new number of the first member, which is below ``n``.
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
