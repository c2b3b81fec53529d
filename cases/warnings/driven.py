"""Warnings about prescribed motions that move a body through a wall, or through another body with prescribed motion."""

import math
from collections.abc import Iterator
from itertools import chain, combinations, islice, pairwise
from typing import NamedTuple

from ..checks.drives import motions
from ..model.boundaries import Prescribed, Wall
from ..model.courses import Course, factor_at
from ..model.schema import Case, Part
from ..model.solids import Measured
from ..reading.problems import Problem, problem
from ..shapes.geometry import AXES, Generated, Vector, bounds, index, lowest_along
from ..shapes.loaded import near
from ..shapes.placed import Placed

_TIMES = 200
"""Number of times up to the end of the run at which the path of a body is checked; one path then takes a millisecond
(reason of the chosen value)."""
_MOST = 200
"""Largest number of bodies, and of pairs of bodies, that are checked; they take a second at most (chosen values)."""
_TOUCH = 1e-9
"""Largest depth of contact without a warning, divided by the size of a body. The depth is far above rounding errors and
far below any gap (chosen value)."""


class Driven(NamedTuple):
    """A body whose motion a boundary prescribes (drives)."""

    number: int
    """Index of the boundary that drives the body."""
    drive: Prescribed
    part: Part
    mesh: Generated
    ways: list[Vector]
    """Displacement of the driven nodes of the body at each time, m. Components that the boundary does not prescribe
    continue at the initial velocity."""


def passing(case: Case) -> Iterator[Problem]:
    """Yields a warning for each boundary that drives nodes behind a wall, or drives a body into another driven body.

    Prescribed rotations, mesh files, and bodies that are turned, rotate or stretch give no warning.
    """
    driven = list(islice(_driven(case), _MOST))
    reported: set[int] = set()
    for number, message in chain(_through_walls(case, driven), _through_bodies(case, driven)):
        if number not in reported:
            reported.add(number)
            yield problem(("boundaries", number), ..., message)


def _through_walls(case: Case, driven: list[Driven]) -> Iterator[tuple[int, str]]:
    for j, wall in case.boundaries_of(Wall):
        for body in driven:
            held = wall.plain and (not wall.parts or body.part.name in wall.parts)
            depth = _behind(body, wall.point, wall.normal or wall.point) if held else 0.0
            if depth > _TOUCH * _size(body.mesh):
                message = f"nodes of {body.part.name!r} move {depth:.3g} m behind boundaries[{j}], a wall"
                yield body.number, f"{message}; walls do not stop driven nodes"


def _behind(body: Driven, point: Vector, way: Vector) -> float:
    """Returns the largest depth behind a wall that driven nodes reach, m; minus infinity if none gets behind it."""
    length, drive = math.hypot(*way), body.drive
    normal = way[0] / length, way[1] / length, way[2] / length
    low, high = _bounds(body.mesh)
    if drive.low is not None and drive.high is not None:
        (a, b, c), (d, e, f) = map(max, low, drive.low), map(min, high, drive.high)
        low, high = (a, b, c), (d, e, f)
    if any(a > b + near(Placed(body.mesh)) for a, b in zip(low, high, strict=True)):
        return -math.inf
    lowest = sum(min(n * a, n * b) for n, a, b in zip(normal, low, high, strict=True))
    if _whole(drive):
        lowest = max(lowest, lowest_along(body.mesh, normal))
    return _dot(normal, point) - lowest - min(_dot(normal, way) for way in body.ways)


def _through_bodies(case: Case, driven: list[Driven]) -> Iterator[tuple[int, str]]:
    """Yields each body that collides with another one, along an axis along which both are driven: the index of its
    boundary, and the text of the warning.
    """
    if case.contact is None:
        return
    meeting = [each for each in driven if not case.contact.parts or each.part.name in case.contact.parts]
    pairs = (
        (one, other, axes)
        for one, other in combinations([each for each in meeting if _whole(each.drive)], 2)
        if one.number != other.number and one.part is not other.part
        if (axes := {index(axis) for axis in motions(one.drive).keys() & motions(other.drive).keys()})
    )
    for one, other, axes in islice(pairs, _MOST):
        boxes = _bounds(one.mesh), _bounds(other.mesh)
        if any(_enter(*boxes, *ways, axes) for ways in zip(one.ways, other.ways, strict=True)):
            message = f"{other.part.name!r} moves into {one.part.name!r}, which boundaries[{one.number}] drives"
            yield other.number, f"{message}; contact does not change prescribed motion"


def _enter(one: tuple[Vector, Vector], other: tuple[Vector, Vector], way: Vector, its: Vector, axes: set[int]) -> bool:
    """Whether two boxes that are separate along one of the ``axes`` at the start overlap on their paths."""
    (low, high), (low2, high2) = one, other
    margin = _TOUCH * max(b - a for a, b in zip(low + low2, high + high2, strict=True))
    apart = any(min(high[d], high2[d]) - max(low[d], low2[d]) <= margin for d in axes)
    by = [b - a for a, b in zip(way, its, strict=True)]
    return apart and all(min(high[d], high2[d] + by[d]) - max(low[d], low2[d] + by[d]) > margin for d in range(3))


# Bodies and their ways ------------------------------------------------------------------------------------------------


def _driven(case: Case) -> Iterator[Driven]:
    whole = [each for _, each in case.boundaries_of(Prescribed) if _whole(each)]
    for number, drive in case.boundaries_of(Prescribed):
        for part in case.parts:
            mesh, steady = part.mesh, part.turn is None and part.spin is None and part.stretch is None
            if steady and not isinstance(mesh, Measured) and _drives(drive, part):
                drives = [drive, *(each for each in whole if _drives(each, part))]
                yield Driven(number, drive, part, mesh, list(_ways(case, drives, part)))


def _drives(drive: Prescribed, part: Part) -> bool:
    return not drive.parts or part.name in drive.parts


def _whole(drive: Prescribed) -> bool:
    return drive.low is None and drive.high is None and drive.on is None


def _ways(case: Case, drives: list[Prescribed], part: Part) -> Iterator[Vector]:
    for time in (case.run.end_time * (k + 1) / _TIMES for k in range(_TIMES)):
        x, y, z = (_way(drives, d, time, part.velocity[d]) for d in range(3))
        yield x, y, z


def _way(drives: list[Prescribed], direction: int, time: float, speed: float) -> float:
    for drive in drives:
        given: float | None = getattr(drive, AXES[direction])
        if given is not None:
            return given * _integral(drive.course, time)
    return speed * time


def _integral(course: Course, time: float) -> float:
    """Returns the integral of the factor of a course from time 0 to ``time``, s."""
    if not course:
        return time
    times = sorted({0.0, time, *(t for t, _ in course if 0.0 < t < time)})
    return sum(0.5 * (b - a) * (factor_at(course, a) + factor_at(course, b)) for a, b in pairwise(times))


def _size(mesh: Generated) -> float:
    return max(high - low for low, high in zip(*_bounds(mesh), strict=True))


def _bounds(mesh: Generated) -> tuple[Vector, Vector]:
    return bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)


def _dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
