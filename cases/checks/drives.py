"""Prescribed motions: the velocity components that a boundary prescribes, and the components for which two boundaries
disagree.
"""

from ..model.boundaries import Boundary, Prescribed, Rotation
from ..model.courses import Course
from ..model.tables import Axis
from ..shapes.geometry import AXES, across

Motion = tuple[object, ...]
"""Prescribed velocity component as a function of time, as a tuple that can be compared: equal tuples mean equal
motions."""
REST: Motion = (0.0,)
"""Motion of a velocity component that is always 0."""


def motions(boundary: Boundary) -> dict[Axis, Motion]:
    """Returns the motion of each velocity component that the boundary prescribes; the result is empty if the boundary
    prescribes none.
    """
    if isinstance(boundary, Prescribed):
        given = {axis: getattr(boundary, axis) for axis in AXES}
        return {axis: _straight(speed, boundary.course) for axis, speed in given.items() if speed is not None}
    if isinstance(boundary, Rotation):
        return {axis: _round(boundary, axis) for axis in AXES}
    return {}


def clash(one: Boundary, other: Boundary) -> tuple[Axis, ...]:
    """Returns the velocity components for which the two boundaries prescribe different motions: a node cannot have
    both.
    """
    first, second = motions(one), motions(other)
    return tuple(axis for axis in AXES if axis in first and axis in second and first[axis] != second[axis])


def _straight(speed: float, course: Course) -> Motion:
    return (speed, course) if speed and any(factor for _, factor in course or ((0.0, 1.0),)) else REST


def _round(boundary: Rotation, axis: Axis) -> Motion:
    """Returns the motion of the velocity component along ``axis`` in a rotation; the component along the axis of the
    rotation is the velocity of this axis.
    """
    i, j = across(axis)
    rate = boundary.spin.rate
    along = _straight(boundary.velocity[AXES.index(axis)], boundary.velocity_course)
    if not (rate[i] or rate[j]):
        return along
    return (boundary.spin.centre, rate, boundary.course, boundary.velocity, boundary.velocity_course)
