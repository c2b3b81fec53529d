"""Reference motions: how slots are taken to move, and how far they have left that.

A search takes every slot to go on along a straight line. What it leaves out would meet only if slots left these lines
by half the skin. A slot that does so gets another line, from where it is, with the mean velocity that it has had on the
old one, and it is searched for anew (registration.py).

How long a pair may be left alone is measured from other lines, which are drawn anew every few steps for all: with the
mean velocities of these steps they are much closer to the slots, and nobody has to be searched for (pairs.py).
"""

import numpy as np

from ...kernels.jit import njit
from ...model.growing import Rooms
from ...model.state import Flags, Floats, Indices

_V1, _V2, _N2 = "float64[::1]", "float64[:, ::1]", "int32[:, ::1]"


class Lines:
    """A straight line for every slot."""

    def __init__(self, x: Floats, course: Floats) -> None:
        """``x``, ``course`` (slots, 3): positions, m, and velocities, m/s, at time 0."""
        self.x, self.course = x.copy(), course.copy()
        self.since = np.zeros(len(x))
        """(slots,) when each line began, s."""
        self.left = np.zeros(len(x))
        """(slots,) how far each slot leaves its line in the step ahead, the larger of beginning and end, m."""
        self._rooms = Rooms("x", "course", "since", "left")

    def add(self, x: Floats, course: Floats, t: float) -> None:
        """Takes up more slots, as they are at time ``t``, (n, 3) each."""
        self._rooms.append(self, len(x), x=x - t * course, course=course, since=t, left=0.0)

    def inherit(self, heirs: Indices, parents: Indices) -> None:
        """The copies of slots are on the lines of their parents."""
        for column in (self.x, self.course, self.since, self.left):
            column[heirs] = column[parents]

    def take_over(self, slots: Indices, old: "Lines", t: float) -> None:
        """At time ``t``: the lines of ``old``, whose slots have the new numbers ``slots``, -1 for none any more."""
        self.x -= t * self.course
        self.since[:] = t
        there, here = np.flatnonzero(slots >= 0), slots[slots >= 0]
        for name in ("x", "course", "since"):
            getattr(self, name)[here] = getattr(old, name)[there]

    def measure(self, x: Floats, v: Floats, t: float, dt: float) -> None:
        """How far the slots leave their lines in a step ``dt`` from ``t`` on: positions ``x`` and velocities ``v``
        before contact, (slots, 3) each.
        """
        _leave(self.left, self.x, self.course, x, v, t, dt)

    def begin_anew(self, some: "np.ndarray", x: Floats, t: float) -> None:
        """New lines for ``some`` (slots,), from ``x`` (slots, 3) at time ``t`` on."""
        _begin_anew(some, self.x, self.course, self.since, x, t)


class ReferenceMotion:
    """The reference motions of the slots of a scene."""

    def __init__(self, x: Floats, course: Floats, faces: int, edges: int, drift: Floats, until: float) -> None:
        """``x``, ``course`` (slots, 3): positions, m, and velocities, m/s, at the time of the search."""
        self.drift = drift
        """(3,) mean velocity, m/s."""
        self.until = until
        """What is searched is searched for until then, s after the search."""
        self.searched, self.short = Lines(x, course), Lines(x, course)
        """Along which slots have been searched, and from which pairs are measured."""
        self.faces, self.edges = np.zeros(faces), np.zeros(edges)
        """(f,) and (e,) the largest of what their corners leave the short lines, m."""
        self.t = 0.0
        """Of the step's beginning, s after the search."""
        self.end = 0.0
        """Of its end."""
        self.beyond = 0.0
        """How long after that lines are measured, s."""
        self.strayed = 0.0
        """How far any slot that is watched leaves the line that is searched in the step, m."""

    def add(self, x: Floats, course: Floats) -> None:
        """Takes up more slots, as they are, (n, 3) each."""
        self.searched.add(x, course, self.end)
        self.short.add(x, course, self.end)

    def inherit(self, heirs: Indices, parents: Indices) -> None:
        """The copies of slots move as their parents do."""
        self.searched.inherit(heirs, parents)
        self.short.inherit(heirs, parents)

    def take_over(self, slots: Indices, old: "ReferenceMotion") -> None:
        """The lines of ``old``, whose slots have the new numbers ``slots``, -1 for those that have gone."""
        self.t = self.end = old.end
        self.searched.take_over(slots, old.searched, self.t)
        self.short.take_over(slots, old.short, self.t)

    def advance(self, dt: float, beyond: float = 0.0) -> None:
        """A step ``dt`` begins; what slots leave is measured ``beyond`` its end, s."""
        self.t, self.end, self.beyond = self.end, self.end + dt, beyond

    def measure(self, x: Floats, v: Floats, faces: Indices, edges: Indices) -> None:
        """How far everything leaves its lines in the step and ``beyond``: see Lines."""
        dt = self.end - self.t + self.beyond
        self.searched.measure(x, v, self.t, dt)
        self.short.measure(x, v, self.t, dt)
        _largest(self.faces, faces, 3, self.short.left)
        _largest(self.edges, edges, 2, self.short.left)

    def farthest(self, some: Flags) -> float:
        """How far any of ``some`` (slots,) leaves the line that is searched in the step, m."""
        return float(self.searched.left[some].max(initial=0.0))

    def begin_anew(self, some: "np.ndarray", x: Floats) -> None:
        """New lines to search along for ``some`` (slots,), from ``x`` (slots, 3) on."""
        self.searched.begin_anew(some, x, self.t)

    def aim(self, some: "np.ndarray", x: Floats, v: Floats) -> None:
        """Lines to search along for ``some`` (slots,) that have been knocked: from ``x`` on, with velocities ``v``."""
        lines = self.searched
        lines.course[some], lines.x[some], lines.since[some] = v[some], (x - self.t * v)[some], self.t

    def shorten(self, x: Floats) -> None:
        """New short lines for all, from ``x`` (slots, 3) on."""
        self.short.begin_anew(np.ones(len(x), bool), x, self.t)

    def positions(self) -> Floats:
        """(slots, 3) on the lines that are searched, at the beginning of the step, m."""
        return np.asarray(self.searched.x + self.t * self.searched.course)


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
