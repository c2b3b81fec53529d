"""Prescribed motion: the components that a boundary prescribes, and conflicts between two boundaries."""

from ..model.boundaries import Boundary, Course, Prescribed, Rotation
from ..model.tables import Axis
from ..shapes.geometry import AXES, across

Motion = tuple[object, ...]
"""Motion of a velocity component over time; two motions are equal if the tuples are equal."""
REST: Motion = (0.0,)
"""Motion of a velocity component that stays zero."""


def motions(boundary: Boundary) -> dict[Axis, Motion]:
    """Returns the motion of each velocity component that a boundary prescribes; empty without prescribed motion."""
    if isinstance(boundary, Prescribed):
        given = {axis: getattr(boundary, axis) for axis in AXES}
        return {axis: _straight(speed, boundary.course) for axis, speed in given.items() if speed is not None}
    if isinstance(boundary, Rotation):
        return {axis: _round(boundary, axis) for axis in AXES}
    return {}


def clash(one: Boundary, other: Boundary) -> tuple[Axis, ...]:
    """Returns the velocity components for which two boundaries prescribe different motions: a node cannot follow
    both.
    """
    first, second = motions(one), motions(other)
    return tuple(axis for axis in AXES if axis in first and axis in second and first[axis] != second[axis])


def _straight(speed: float, course: Course) -> Motion:
    return (speed, course) if speed and any(factor for _, factor in course or ((0.0, 1.0),)) else REST


def _round(boundary: Rotation, axis: Axis) -> Motion:
    """Returns the motion of a rotation; the component along its axis is zero."""
    i, j = across(axis)
    rate = boundary.spin.rate
    return (boundary.spin.centre, rate) if rate[i] or rate[j] else REST
