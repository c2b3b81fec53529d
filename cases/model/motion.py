"""How a body moves and stands at the start."""

from ..units import Angle, AngularSpeed, Rate
from .tables import Axis, Model, Point


class Spin(Model):
    """Rigid rotation about a line through ``centre``; ``rate`` is the rotation vector, rad/s."""

    centre: Point
    """A point of the line that the body turns about."""
    rate: tuple[AngularSpeed, AngularSpeed, AngularSpeed]
    """Rotation vector: its direction is the axis, right-handed, its length the rate."""


class Stretch(Model):
    """Uniform stretching: ``rate`` times the distance from ``centre`` is the velocity along each of x, y, z; 1/s."""

    centre: Point = (0.0, 0.0, 0.0)
    """The point that stays where it is."""
    rate: tuple[Rate, Rate, Rate]
    """Along each of x, y, z: positive stretches, negative shortens."""


class Turn(Model):
    """A body is turned about the line along ``axis`` through ``centre`` before anything else, right-handed."""

    axis: Axis
    """Direction of the line."""
    angle: Angle
    """Right-handed: ``"45 deg"``."""
    centre: Point = (0.0, 0.0, 0.0)
    """A point of the line."""
