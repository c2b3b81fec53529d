"""External loads and constraints of a rigid body: gravity, symmetry planes, prescribed motion."""

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from conoid.cases.model.schema import Boundary, Case, Gravity, Part, Prescribed, Rotation, Symmetry
from conoid.cases.shapes.geometry import AXES

from ..boundaries.course import Course
from ..boundaries.moving_axis import MovingAxis
from ..model.state import Floats


@dataclass
class Held:
    """Loads and constraints of one body."""

    free: Floats = field(default_factory=lambda: np.ones(3))
    """(3,) 1 for axes along which impulses may move the body, else 0."""
    turns: Floats = field(default_factory=lambda: np.ones(3))
    """(3,) 1 for axes about which impulses may rotate the body, else 0; the values are 1 for all axes, for one axis, or
    for none."""
    driven: dict[int, tuple[float, Course]] = field(default_factory=dict)
    """Dictionary of prescribed velocities; the keys are axes. A value contains the velocity along the axis, m/s, and
    its factor as a function of time."""
    spin: MovingAxis | None = None
    """Axis of the prescribed rotation; None if no rotation is prescribed."""
    pulls: list[tuple[Floats, Course]] = field(default_factory=list)
    """Accelerations of gravity, m/s^2, with their factors as functions of time."""
    prescribed: bool = False
    """True if any motion is prescribed. Walls do not stop a body with a prescribed motion."""

    @classmethod
    def of(cls, case: Case, part: Part, beside: Collection[int] = ()) -> "Held":
        """Collects the boundaries that act on the ``part``. Symmetry planes beside which the part starts are left out;
        ``beside`` marks them.
        """
        found = cls()
        for index, boundary in enumerate(case.boundaries):
            if index in beside:
                continue
            on_set = not isinstance(boundary, Symmetry) and getattr(boundary, "on", None) is not None
            if not on_set and (not boundary.parts or part.name in boundary.parts):
                found._take(boundary)
        return found

    def _take(self, boundary: Boundary) -> None:
        if isinstance(boundary, Gravity):
            self.pulls.append((np.array(boundary.acceleration), Course(boundary.course)))
        elif isinstance(boundary, Symmetry):
            self._fix(AXES.index(boundary.axis), 0.0, Course())
        elif isinstance(boundary, Prescribed):
            self.prescribed = True
            for axis in AXES:
                speed = getattr(boundary, axis)
                if speed is not None:
                    self._fix(AXES.index(axis), speed, Course(boundary.course))
        elif isinstance(boundary, Rotation):
            self.prescribed, self.free, self.turns = True, np.zeros(3), np.zeros(3)
            self.spin = MovingAxis(boundary)

    def _fix(self, axis: int, speed: float, course: Course) -> None:
        """Prescribes the velocity of all nodes along an axis, so that the body can turn about that axis only."""
        self.free[axis] = 0.0
        self.driven[axis] = speed, course
        self.turns = self.turns * (np.arange(3) == axis)

    def begin(self, speed: Floats, rate: Floats, centre: Floats) -> tuple[Floats, Floats]:
        """Returns the velocity of the ``centre``, m/s, and the rotation vector, rad/s, at the start."""
        if self.spin is not None:
            return self.spin.start(centre[None])[0], self.spin.mean_rate(0.0, 0.0)
        return self._driven(speed, 0.0, 0.0), rate * self.turns

    def kept(self, momentum: Floats) -> Floats:
        """(3,) angular momentum without the components that the constraints exclude."""
        return momentum if self.spin is not None else momentum * self.turns

    def kick(self, speed: Floats, centre: Floats, last_dt: float, dt: float, t: float) -> Floats:
        """(3,) velocity v*(n+1/2), computed from v(n-1/2), m/s."""
        if self.spin is not None:
            return self.spin.chords(centre[None], dt, t)[0] if dt > 0.0 else speed
        gained = speed
        for acceleration, course in self.pulls:
            factor = course.mean(t - 0.5 * last_dt, t + 0.5 * dt)
            gained = gained + 0.5 * (last_dt + dt) * factor * acceleration
        return self._driven(gained, t, t + dt)

    def _driven(self, speed: Floats, begin: float, end: float) -> Floats:
        found = np.array(speed)
        for axis, (given, course) in self.driven.items():
            found[axis] = given * course.mean(begin, end)
        return found

    def half(self, dt: float, t: float) -> Floats:
        """(3,) unit axis of the prescribed rotation of the step ``dt``, s, from the time ``t``, times the tangent of
        half of the rotation angle.
        """
        assert self.spin is not None
        axis, sine, cosine = self.spin.angle(dt, t)
        return np.asarray(axis * (sine / (1.0 + cosine)))
