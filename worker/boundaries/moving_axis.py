"""Prescribed rotation about an axis that may move: velocities at the start, displacements of a step."""

import math

import numpy as np

from conoid.cases.model.schema import Rotation

from ..materials.turning import sine_and_cosine
from ..model.state import Floats
from .course import Course


class MovingAxis:
    """Axis of a prescribed rotation. The axis keeps its direction; it may move with a prescribed velocity."""

    def __init__(self, spec: Rotation) -> None:
        self._point, self.rate = np.array(spec.spin.centre), np.array(spec.spin.rate)
        """Point of the axis at the start, m; and rotation vector without the factor of its course, rad/s."""
        self._velocity = np.array(spec.velocity)
        self._turning, self._moving = Course(spec.course), Course(spec.velocity_course)
        self._speed = math.sqrt(sum(float(component) ** 2 for component in self.rate))

    @property
    def fastest(self) -> float:
        """Largest angular velocity at any time, rad/s."""
        return self._speed * self._turning.largest

    def mean_rate(self, begin: float, end: float) -> Floats:
        """(3,) mean rotation vector between two times, s; rad/s."""
        return np.asarray(self._turning.mean(begin, end) * self.rate)

    def start(self, x: Floats) -> Floats:
        """Returns the velocities (n, 3), m/s, of points ``x`` (n, 3) at the start."""
        return np.asarray(np.cross(self.mean_rate(0.0, 0.0), x - self._point) + self._moved(0.0, 0.0))

    def chords(self, x: Floats, dt: float, t: float) -> Floats:
        """Returns the mean velocities (n, 3), m/s, of points ``x`` (n, 3) in the step ``dt``, s, from the time ``t``:
        their exact displacements divided by ``dt``.
        """
        r = x - (self._point + t * self._moved(0.0, t))
        if self._speed == 0.0:
            return np.zeros(x.shape) + self._moved(t, t + dt)
        axis, sine, cosine = self.angle(dt, t)
        across = np.cross(axis, r)
        chord: Floats = (sine * across + (1.0 - cosine) * np.cross(axis, across)) / dt
        return chord + self._moved(t, t + dt)

    def angle(self, dt: float, t: float) -> tuple[Floats, float, float]:
        """Returns the unit vector (3,) along the axis, and sine and cosine of the angle of rotation in the step ``dt``,
        s, from the time ``t``. Without rotation the vector is zero.
        """
        if self._speed == 0.0:
            return self.rate, 0.0, 1.0
        return self.rate / self._speed, *sine_and_cosine(self._speed * dt * self._turning.mean(t, t + dt))

    def _moved(self, begin: float, end: float) -> Floats:
        """(3,) mean velocity of the axis between two times, s; m/s."""
        return np.asarray(self._moving.mean(begin, end) * self._velocity)
