"""Warnings about parts that move at the start but touch nothing before the end of the run, for example because a length
has a wrong unit.
"""

import math
from collections.abc import Iterator

from ..model.schema import Case, Part, Symmetry, Wall
from ..model.solids import Measured
from ..reading.problems import Problem, problem
from ..shapes.geometry import Vector, lowest_along
from ..shapes.placed import Placed

Bounds = tuple[Vector, Vector]


def strangers(case: Case) -> Iterator[Problem]:
    """Yields a warning for each moving part that can touch no other part and no wall before ``run.end_time``.

    A case gives no warning if it has mesh files, parts that rotate or stretch, or boundaries other than planes of
    symmetry and fixed plane walls. A part gives no warning if parts that collide with each other before the end can hit
    it afterwards.
    """
    walls = [boundary for boundary in case.boundaries if isinstance(boundary, Wall) and boundary.plain]
    others = [boundary for boundary in case.boundaries if not isinstance(boundary, Symmetry) and boundary not in walls]
    boxes = [_box(part) for part in case.parts]
    if others or case.contact is None or None in boxes or len(case.parts) + len(walls) < 2:
        return
    known = [box for box in boxes if box is not None]
    times = [
        [math.inf if j == i else _meeting(known[i], known[j], part, each) for j, each in enumerate(case.parts)]
        for i, part in enumerate(case.parts)
    ]
    ways = [_way(case, i, met) for i, met in enumerate(times)]
    for i, part in enumerate(case.parts):
        soonest = min([*times[i], *(_arrival(part, wall) for wall in walls)])
        if not any(part.velocity) or soonest <= case.run.end_time:
            continue
        own = math.hypot(*part.velocity) * case.run.end_time
        if not any(_gap(known[i], box) <= way + own for box, way in zip(known, ways, strict=True)):
            when = "nothing at all" if soonest == math.inf else f"nothing before {soonest:.3g} s"
            message = f"{part.name!r} meets {when}; the run ends at {case.run.end_time:.3g} s"
            yield problem(("parts", i, "velocity"), ..., message)


def _way(case: Case, i: int, times: list[float]) -> float:
    """Returns the largest distance that part ``i`` can have moved at the end of the run, m, after collisions at
    ``times``, s. A collision can give a part its own speed plus twice the speed of the collision. If no collision is
    before the end, the result is minus infinity.
    """
    own, end = case.parts[i].velocity, case.run.end_time
    speeds = [math.dist(own, each.velocity) for each, when in zip(case.parts, times, strict=True) if when < end]
    most = max(speeds, default=0.0)
    return (math.hypot(*own) + 2.0 * most) * end if most > 0.0 else -math.inf


def _gap(box: Bounds, other: Bounds) -> float:
    """Returns the distance between two boxes, m."""
    return math.hypot(*(max(a - high, low - b, 0.0) for low, high, a, b in zip(*box, *other, strict=True)))


def _box(part: Part) -> Bounds | None:
    if isinstance(part.mesh, Measured) or part.spin is not None or part.stretch is not None or part.jitter > 0.0:
        return None
    return Placed(part.mesh, part.turn).bounds()


def _meeting(box: Bounds, other: Bounds, part: Part, met: Part) -> float:
    """Returns the time at which the bounding boxes of two moving bodies touch, s; infinity if they never touch."""
    begin, end = 0.0, math.inf
    for low, high, a, b, v, w in zip(*box, *other, part.velocity, met.velocity, strict=True):
        speed = v - w
        if speed == 0.0:
            enter, leave = (0.0, math.inf) if a <= high and low <= b else (math.inf, math.inf)
        else:
            enter, leave = sorted(((a - high) / speed, (b - low) / speed))
        begin, end = max(begin, enter), min(end, leave)
    return begin if begin <= end else math.inf


def _arrival(part: Part, wall: Wall) -> float:
    """Returns the time at which a moving body reaches a wall, s; infinity if it never reaches the wall."""
    if wall.parts and part.name not in wall.parts:
        return math.inf
    way = wall.normal or wall.point
    length = math.hypot(*way)
    normal = (way[0] / length, way[1] / length, way[2] / length)
    closing = -sum(n * v for n, v in zip(normal, part.velocity, strict=True))
    if closing <= 0.0 or isinstance(part.mesh, Measured):
        return math.inf
    level = sum(n * x for n, x in zip(normal, wall.point, strict=True))
    return 0.0 if part.turn is not None else max(0.0, (lowest_along(part.mesh, normal) - level) / closing)
