"""Bounding boxes of the paths of nodes, edges and faces over the horizon of a search."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...kernels.jit import njit, record, types
from ...model.growing import Scratch
from ...model.state import Flags, Floats, Indices
from ...parallel.arguments import reader
from ...parallel.packing import offsets
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team

_PRIMITIVES = 1024
"""Number of primitives in a task. Chosen value: a task takes about 30 us, compared with 2 us to start a parallel
region."""
_EVERYWHERE = np.full((1, 2, 3), (((-np.inf,) * 3, (np.inf,) * 3)))
"""Hull that touches every box."""


@dataclass
class Primitives:
    """Points, edges or faces, given by their nodes. All have the same number of corners."""

    corners: Indices
    """(n, k) rows of the corner nodes of each primitive."""
    reach: Floats
    """(n,) reach of each primitive, m: distance from the hull of its corners, within which other primitives are
    candidates."""
    some: Indices | None = None
    """(m,) rows of the primitives that are searched; None if all are searched."""
    columns: int | None = None
    """Number of columns of ``corners`` that are corners of the primitive; None if all columns are corners."""

    @property
    def searched(self) -> Indices:
        """(m,) rows of the primitives that are searched."""
        return np.arange(len(self.corners), dtype=np.int32) if self.some is None else self.some

    @property
    def many(self) -> int:
        """Number of corners of a primitive."""
        return self.corners.shape[1] if self.columns is None else self.columns


class Lines(NamedTuple):
    """Straight lines along which the nodes of primitives are extrapolated."""

    x: Floats
    """(nodes, 3) positions, m."""
    v: Floats
    """(nodes, 3) velocities less the mean velocity, m/s."""
    horizon: float
    """Time for which the nodes are extrapolated, s."""
    part: Indices
    """(nodes,) part of each node."""


@dataclass
class Boxes:
    """Boxes of the swept volumes of primitives: (n, 3) lowest corners, and (n, 3) highest corners."""

    low: Floats
    high: Floats

    @property
    def hull(self) -> Floats:
        """(6,) lowest corner of all boxes, then minus the highest corner of all boxes; infinite if there are no
        boxes.
        """
        return np.asarray(_hull(self.low, self.high))

    def touching(self, hull: Floats) -> Flags:
        """(n,) True for each box that touches a hull."""
        return np.asarray(_in_hull(self.low, self.high, hull))


class Sought(NamedTuple):
    """Primitives of one side of a search, with their bounding boxes."""

    low: Floats
    """(m, 3) lowest corners of the boxes of the primitives."""
    high: Floats
    corners: Indices
    """(n, k) slots of the corners of all primitives."""
    many: int
    """Number of corners of a primitive. The corners are the first columns of ``corners``."""
    some: Indices
    """(m,) rows of the searched primitives."""


_B, _I, _F, _F1, _F2, _I1, _N1, _N2 = (
    types.boolean, types.int64, types.float64, types.float64[::1], types.float64[:, ::1], types.int64[::1],
    types.int32[::1], types.int32[:, ::1],
)  # fmt: skip
SOUGHT = record(Sought, _F2, _F2, _N2, _I, _N1)
LINES = record(Lines, _F2, _F2, _F, _N1)
_BOX = SOUGHT, _F1, LINES, types.boolean[:, ::1], types.float64[:, :, ::1]
_BOXED = *_BOX, types.float64[:, :, :, ::1], _I1, _N1
_PACK = SOUGHT, SOUGHT, _I1, _I1
_boxed, _packed = reader(*_BOXED), reader(*_PACK)


@njit("float64[::1](float64[:, ::1], float64[:, ::1])", cache=True)
def _hull(low, high):  # type: ignore[no-untyped-def]
    found = np.full(6, np.inf)
    for j in range(len(low)):
        for i in range(3):
            found[i], found[3 + i] = min(found[i], low[j, i]), min(found[3 + i], -high[j, i])
    return found


@njit("boolean[::1](float64[:, ::1], float64[:, ::1], float64[::1])", cache=True)
def _in_hull(low, high, hull):  # type: ignore[no-untyped-def]
    inside = np.empty(len(low), np.bool_)
    for j in range(len(low)):
        touch = True
        for i in range(3):
            touch &= low[j, i] <= -hull[3 + i] and high[j, i] >= hull[i]
        inside[j] = touch
    return inside


@njit("void(float64[:, :, ::1])", cache=True)
def _clear(hull):  # type: ignore[no-untyped-def]
    """Sets the hulls (parts, 2, 3) of all parts to those of parts without boxes."""
    for q in range(len(hull)):
        for i in range(3):
            hull[q, 0, i], hull[q, 1, i] = np.inf, -np.inf


@njit(_I(*_BOX, types.float64[:, :, ::1], _N1, _I, _I), cache=True)
def _box(out, reach, lines, allowed, hull, own, some, first, stop):  # type: ignore[no-untyped-def]
    """Sets the boxes and rows of the primitives ``some``, from ``first`` to ``stop``; a primitive is used only if it
    touches the ``hull`` (parts, 2, 3) of a part with which its own part may be in contact. Returns the number of used
    primitives. Sets ``own`` (parts, 2, 3) to the hulls of the parts of these primitives.
    """
    low, high, corners, x, v, n = out.low, out.high, out.corners, lines.x, lines.v, first
    _clear(own)
    for at in range(first, stop):
        j = some[at]
        mine = lines.part[corners[j, 0]]
        for i in range(3):
            least, most = np.inf, -np.inf
            for k in range(out.many):
                now = x[corners[j, k], i]
                then = now + lines.horizon * v[corners[j, k], i]
                least, most = min(least, now, then), max(most, now, then)
            low[n, i], high[n, i] = least - reach[j], most + reach[j]
        touching = False
        for q in range(len(hull)):
            touch = allowed[mine, q]
            for i in range(3):
                touch &= low[n, i] <= hull[q, 1, i] and high[n, i] >= hull[q, 0, i]
            touching |= touch
        if touching:
            for i in range(3):
                own[mine, 0, i], own[mine, 1, i] = min(own[mine, 0, i], low[n, i]), max(own[mine, 1, i], high[n, i])
            out.some[n] = j
            n += 1
    return n - first


@njit(TASK, cache=True)
def _boxes(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: computes the bounding boxes of a range of primitives (``_box``)."""
    out, reach, lines, allowed, hull, own, counts, some = _boxed(table)
    k = first // _PRIMITIVES
    counts[k] = _box(out, reach, lines, allowed, hull, own[k], some, first, stop)


@njit(TASK, cache=True)
def _pack(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: copies the boxes found by one task to their places in the common array."""
    out, found, begins, counts = _packed(table)
    k = first // _PRIMITIVES
    for p in range(counts[k]):
        to, fro = begins[k] + p, first + p
        out.some[to] = found.some[fro]
        for i in range(3):
            out.low[to, i], out.high[to, i] = found.low[fro, i], found.high[fro, i]


@njit("void(float64[:, :, ::1], float64[:, :, :, ::1])", cache=True)
def _join(hull, own):  # type: ignore[no-untyped-def]
    """Sets the ``hull`` of each part to the smallest box that contains the hulls of all tasks."""
    _clear(hull)
    for k in range(len(own)):
        for q in range(len(hull)):
            for i in range(3):
                hull[q, 0, i] = min(hull[q, 0, i], own[k, q, 0, i])
                hull[q, 1, i] = max(hull[q, 1, i], own[k, q, 1, i])


def everywhere(parts: int) -> Floats:
    """(parts, 2, 3) hulls that touch every box."""
    return np.repeat(_EVERYWHERE, parts, axis=0)


class Boxing:
    """Passes that compute the boxes of the primitives on one side of a search."""

    def __init__(self, team: Team) -> None:
        self._pass = Pass(team, _boxes, *_BOXED, size=_PRIMITIVES)
        self._pack, self._scratch = Pass(team, _pack, *_PACK, size=_PRIMITIVES), Scratch()

    def of(self, things: Primitives, lines: Lines, allowed: Flags, hull: Floats) -> tuple[Sought, Floats]:
        """Returns the primitives that touch the ``hull`` (parts, 2, 3) of a part with which their own part may be in
        contact, and the hulls of the parts of these primitives. ``allowed`` (parts, parts): pairs of parts that may be
        in contact. The result is valid until the next call.
        """
        some = things.searched
        n, many = len(some), self._pass.many(len(some))
        out, own, counts = self._room(things, n, "all"), np.empty((many, *hull.shape)), np.empty(many, np.int64)
        self._pass.run(n, out, things.reach, lines, allowed, hull, own, counts, some)
        begins, mine = np.empty(many, np.int64), np.empty(hull.shape)
        _join(mine, own)
        total = int(offsets(begins, counts))
        if total == n:
            return out, mine
        packed = self._room(things, total, "packed")
        self._pack.run(n, packed, out, begins, counts)
        return packed, mine

    def _room(self, things: Primitives, n: int, name: str) -> Sought:
        of = self._scratch.of
        low, high = (of(f"{name} {side}", n, np.float64, 3) for side in ("low", "high"))
        return Sought(low, high, things.corners, things.many, of(f"{name} rows", n, np.int32))


def swept(things: Primitives, x: Floats, v: Floats, horizon: float) -> Boxes:
    """Bounding boxes of the searched primitives over the horizon; the boxes include the reach. ``x`` and ``v`` (nodes,
    3).
    """
    some, n = things.searched, len(things.searched)
    out = Sought(np.empty((n, 3)), np.empty((n, 3)), things.corners, things.many, np.empty(n, np.int32))
    lines = Lines(x, v, horizon, np.zeros(len(x), np.int32))
    _box(out, things.reach, lines, np.ones((1, 1), bool), _EVERYWHERE, np.empty((1, 2, 3)), some, 0, n)
    return Boxes(out.low, out.high)
