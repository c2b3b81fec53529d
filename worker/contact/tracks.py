"""Reference motions: how slots are taken to move after a search, and how far they have left that.

A search takes every slot to go on along a straight line. What it leaves out would meet only if slots left these lines
by half the skin. A slot that does so gets another line, from where it is, with the mean velocity that it has had on the
old one, and it is searched for anew (registration.py).
"""

import numpy as np

from ..jit import njit
from ..state import Flags, Floats, Indices, extended

_V1, _V2, _N2 = "float64[::1]", "float64[:, ::1]", "int32[:, ::1]"


class Tracks:
    """The reference motions of the slots of a scene."""

    def __init__(self, x: Floats, course: Floats, faces: int, edges: int) -> None:
        """``x``, ``course`` (slots, 3): positions, m, and velocities, m/s, of the lines at the time of the search."""
        self.x, self.course = x.copy(), course.copy()
        self.since = np.zeros(len(x))
        """(slots,) when each line began, s after the search."""
        self.left = np.zeros(len(x))
        """(slots,) how far each slot leaves its line in the step ahead, m."""
        self.faces, self.edges = np.zeros(faces), np.zeros(edges)
        """(f,) and (e,) the largest of their corners, m."""
        self.t = 0.0
        """Of the step's beginning, s after the search."""
        self.end = 0.0
        """Of its end."""

    def add(self, x: Floats, course: Floats) -> None:
        """Takes up more slots, as they are, (n, 3) each."""
        n = len(x)
        self.x, self.course = extended(self.x, x - self.end * course), extended(self.course, course)
        self.since, self.left = extended(self.since, np.full(n, self.end)), extended(self.left, np.zeros(n))

    def inherit(self, heirs: Indices, parents: Indices) -> None:
        """The copies of slots are on the lines of their parents."""
        for column in (self.x, self.course, self.since, self.left):
            column[heirs] = column[parents]

    def take_over(self, slots: Indices, old: "Tracks") -> None:
        """The lines of ``old``, whose slots have the new numbers ``slots``, -1 for those that have gone."""
        self.t = self.end = old.end
        self.x -= self.t * self.course
        self.since[:] = self.t
        there, here = np.flatnonzero(slots >= 0), slots[slots >= 0]
        for name in ("x", "course", "since"):
            getattr(self, name)[here] = getattr(old, name)[there]

    def advance(self, x: Floats, v: Floats, faces: Indices, edges: Indices, dt: float, live: Flags) -> float:
        """A step ``dt`` from the positions ``x`` on with the velocities ``v`` before contact, (slots, 3) each; returns
        how far one of the ``live`` slots leaves its line, m.
        """
        self.t, self.end = self.end, self.end + dt
        self.measure(x, v, dt, faces, edges)
        return float(self.left[live].max(initial=0.0))

    def measure(self, x: Floats, v: Floats, dt: float, faces: Indices, edges: Indices) -> None:
        """How far everything leaves its line in the step: see ``advance``."""
        _leave(self.left, self.x, self.course, x, v, self.t, dt)
        _largest(self.faces, faces, 3, self.left)
        _largest(self.edges, edges, 2, self.left)

    def begin_anew(self, some: Flags, x: Floats) -> None:
        """New lines for ``some`` (slots,), from ``x`` (slots, 3) on."""
        _begin_anew(some, self.x, self.course, self.since, x, self.t)

    def positions(self) -> Floats:
        """(slots, 3) on the lines at the beginning of the step, m."""
        return np.asarray(self.x + self.t * self.course)


@njit(f"void({_V1}, {_V2}, {_V2}, {_V2}, {_V2}, float64, float64)", cache=True)
def _leave(left, line, course, x, v, t, dt):  # type: ignore[no-untyped-def]
    for a in range(len(left)):
        now, then = 0.0, 0.0
        for i in range(3):
            off = x[a, i] - line[a, i] - t * course[a, i]
            now += off * off
            off += dt * (v[a, i] - course[a, i])
            then += off * off
        left[a] = np.sqrt(max(now, then))


@njit(f"void({_V1}, {_N2}, int64, {_V1})", cache=True)
def _largest(out, corners, many, left):  # type: ignore[no-untyped-def]
    for f in range(len(out)):
        most = 0.0
        for k in range(many):
            most = max(most, left[corners[f, k]])
        out[f] = most


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
