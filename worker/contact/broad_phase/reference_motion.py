"""Reference motions: the straight lines along which slots are extrapolated, and the distances of the slots from these
lines.

A search extrapolates every slot along a straight line. If the search excludes a pair, the pair can be active only after
a slot departs from its line by half of the skin. A slot that departs so far gets a new line and is registered again
(registration.py). The new line begins at the present position of the slot, with the mean velocity of the slot since the
last line.

The time for which a pair is not tested is measured from other lines, the short lines. All slots get new short lines
every few steps. A short line has the mean velocity of the slot in the last few steps, so it is much closer to the slot
than the line of the search. A new short line needs no registration (pairs.py).
"""

from typing import ClassVar

import numpy as np

from ...kernels.jit import njit
from ...model.columns import COPIED
from ...model.growing import spacious_copy
from ...model.state import Flags, Floats, Indices

_V1, _V2, _N2 = "float64[::1]", "float64[:, ::1]", "int32[:, ::1]"


class Lines:
    """Straight lines along which the slots are extrapolated."""

    COLUMNS: ClassVar = {"x": COPIED, "course": COPIED, "since": COPIED, "left": COPIED}
    """Rules for new rows of the columns with one value for each slot (model/columns.py)."""

    def __init__(self, x: Floats, course: Floats) -> None:
        """Begins the lines at time 0. ``x``, ``course`` (slots, 3): positions, m, and velocities, m/s."""
        self.x, self.course = spacious_copy(x), spacious_copy(course)
        self.since = np.zeros(len(x))
        """(slots,) time at which each line began, s after the search."""
        self.left = np.zeros(len(x))
        """(slots,) distance of each slot from its line in the present step, m: the larger of the distances at the
        beginning and at the end of the step."""

    def begin_at(self, first: int, x: Floats, course: Floats, t: float) -> None:
        """Begins the lines of the slots from ``first`` on, at the time ``t``. ``x``, ``course`` (n, 3): positions and
        velocities at this time.
        """
        self.x[first:], self.course[first:], self.since[first:] = x - t * course, course, t

    def take_over(self, slots: Indices, old: "Lines", t: float) -> None:
        """Copies the lines of ``old`` at the time ``t``. ``slots``: new number of each slot of ``old``, -1 for removed
        slots.
        """
        self.x -= t * self.course
        self.since[:] = t
        _take_over(self.x, self.course, self.since, slots, old.x, old.course, old.since)

    def begin_anew(self, some: "np.ndarray", x: Floats, t: float) -> None:
        """Begins new lines for the flagged slots ``some`` (slots,), at the positions ``x`` (slots, 3) and the time
        ``t``.
        """
        _begin_anew(some, self.x, self.course, self.since, x, t)


class ReferenceMotion:
    """Reference motions (straight lines of extrapolation) of the slots of a scene."""

    def __init__(self, x: Floats, course: Floats, faces: int, edges: int, drift: Floats, until: float) -> None:
        """``x``, ``course`` (slots, 3): positions, m, and velocities, m/s, at the time of the search."""
        self.drift = drift
        """(3,) mean velocity of all surface nodes at the search, m/s."""
        self.until = until
        """Time up to which the candidate pairs are complete, s after the search."""
        self.searched, self.short = Lines(x, course), Lines(x, course)
        """Two kinds of lines: the lines of the search, and the short lines. The bounds of pairs refer to the short
        lines."""
        self.faces, self.edges = np.zeros(faces), np.zeros(edges)
        """Largest distance of a corner from its short line, m: (f,) for each face, and (e,) for each edge."""
        self.t = 0.0
        """Time at the beginning of the step, s after the search."""
        self.end = 0.0
        """Time at the end of the step, s after the search."""
        self.beyond = 0.0
        """Time after the end of the step for which distances are also measured, s."""
        self.strayed = 0.0
        """Largest distance of a tracked slot from its search line in the step, m."""

    def begin_at(self, first: int, x: Floats, course: Floats) -> None:
        """Begins the lines of the slots from ``first`` on. ``x``, ``course`` (n, 3): present positions and velocities
        of these slots.
        """
        self.searched.begin_at(first, x, course, self.end)
        self.short.begin_at(first, x, course, self.end)

    def take_over(self, slots: Indices, old: "ReferenceMotion") -> None:
        """Copies the lines of ``old``. ``slots``: new number of each slot of ``old``, -1 for removed slots."""
        self.t = self.end = old.end
        self.searched.take_over(slots, old.searched, self.t)
        self.short.take_over(slots, old.short, self.t)

    def advance(self, dt: float, beyond: float = 0.0) -> None:
        """Begins a step of length ``dt``, s. Distances are measured up to the time ``beyond`` after the end of the
        step, s.
        """
        self.t, self.end, self.beyond = self.end, self.end + dt, beyond

    def farthest(self, some: Flags) -> float:
        """Largest distance of the flagged slots ``some`` (slots,) from their search lines in the step, m."""
        return float(farthest(self.searched.left, some, 0, len(some)))

    def begin_anew(self, some: "np.ndarray", x: Floats) -> None:
        """Begins new search lines for the flagged slots ``some`` (slots,), at the positions ``x`` (slots, 3)."""
        self.searched.begin_anew(some, x, self.t)

    def aim(self, some: "np.ndarray", x: Floats, v: Floats) -> None:
        """Begins new search lines for the flagged slots ``some`` (slots,), whose velocity has changed suddenly. The
        lines begin at ``x`` with the velocities ``v``."""
        lines = self.searched
        lines.course[some], lines.x[some], lines.since[some] = v[some], (x - self.t * v)[some], self.t

    def shorten(self, x: Floats) -> None:
        """Begins new short lines for all slots, at the positions ``x`` (slots, 3)."""
        self.short.begin_anew(np.ones(len(x), bool), x, self.t)

    def positions(self) -> Floats:
        """(slots, 3) positions on the search lines at the beginning of the step, m."""
        return np.asarray(self.searched.x + self.t * self.searched.course)


@njit(f"void({_V1}, {_V2}, {_V2}, {_V2}, {_V2}, float64, float64, int64, int64)", cache=True)
def leave(left, line, course, x, v, t, dt, first, stop):  # type: ignore[no-untyped-def]
    """Sets the distances of the slots from ``first`` to ``stop`` from their lines, in a step of length ``dt`` from time
    ``t`` on. ``x``, ``v`` (slots, 3): positions and velocities before contact.
    """
    for a in range(first, stop):
        now, then = 0.0, 0.0
        for i in range(3):
            off = x[a, i] - line[a, i] - t * course[a, i]
            now += off * off
            off += dt * (v[a, i] - course[a, i])
            then += off * off
        left[a] = np.sqrt(max(now, then))


@njit(f"float64({_V1}, boolean[::1], int64, int64)", cache=True)
def farthest(left, some, first, stop):  # type: ignore[no-untyped-def]
    """Largest distance from their lines, m, of those slots from ``first`` to ``stop`` that are among ``some``
    (slots,).
    """
    most = 0.0
    for a in range(first, stop):
        most = max(most, left[a] if some[a] else 0.0)
    return most


@njit(f"void({_V1}, {_N2}, int64, {_V1}, int64, int64)", cache=True)
def largest(out, corners, many, left, first, stop):  # type: ignore[no-untyped-def]
    """Sets, for each row from ``first`` to ``stop``, the largest distance of its first ``many`` corners from their
    lines."""
    for f in range(first, stop):
        most = 0.0
        for k in range(many):
            most = max(most, left[corners[f, k]])
        out[f] = most


@njit(f"void({_V2}, {_V2}, {_V1}, int32[::1], {_V2}, {_V2}, {_V1})", cache=True)
def _take_over(line, course, since, slots, old_line, old_course, old_since):  # type: ignore[no-untyped-def]
    for k in range(len(slots)):
        a = slots[k]
        if a >= 0:
            since[a] = old_since[k]
            for i in range(3):
                line[a, i], course[a, i] = old_line[k, i], old_course[k, i]


@njit(f"void(boolean[::1], {_V2}, {_V2}, {_V1}, {_V2}, float64)", cache=True)
def _begin_anew(some, line, course, since, x, t):  # type: ignore[no-untyped-def]
    for a in range(len(some)):
        if some[a]:
            passed = t - since[a]
            for i in range(3):
                if passed > 0.0:
                    course[a, i] += (x[a, i] - line[a, i] - t * course[a, i]) / passed
                line[a, i] = x[a, i] - t * course[a, i]
            since[a] = t
