"""Orientation and motion of a body at the start of the run."""

from ..units import Angle, AngularSpeed, Rate
from .tables import Axis, Model, Point


class Spin(Model):
    """Rigid rotation of a body about a line through ``centre``."""

    centre: Point
    """Point of the axis of rotation."""
    rate: tuple[AngularSpeed, AngularSpeed, AngularSpeed]
    """Rotation vector: its direction is the axis (right-handed), its length is the angular velocity."""


class Stretch(Model):
    """Uniform stretching of a body: the velocity along each of x, y, z is ``rate`` times the distance from
    ``centre``.
    """

    centre: Point = (0.0, 0.0, 0.0)
    """Point that the stretching does not move."""
    rate: tuple[Rate, Rate, Rate]
    """Stretching rate along x, y, z: positive values lengthen, negative values shorten."""


class Turn(Model):
    """Rotation of a body about the line along ``axis`` through ``centre``, right-handed. The rotation is applied to the
    mesh first: velocities and boundaries refer to the turned body.
    """

    axis: Axis
    """Direction of the axis of rotation."""
    angle: Angle
    """Angle of rotation, such as ``"45 deg"``."""
    centre: Point = (0.0, 0.0, 0.0)
    """Point of the axis of rotation."""
