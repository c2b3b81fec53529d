"""Checks of the boundaries of a case that involve several tables: names of parts, boxes without nodes or faces, bodies
behind walls.
"""

import itertools
import math
from collections.abc import Iterator

from ..model.bodies import Box, Loose, Plate, Tube
from ..model.courses import Course
from ..model.schema import Case, Gravity, Part, Prescribed, Rotation, Symmetry, Traction, Wall
from ..model.solids import Measured
from ..reading.problems import Location, Problem, problem
from ..reading.similar import choices, nearest
from ..shapes.geometry import Vector, index, lowest_along
from ..shapes.images import mirrors
from ..shapes.loaded import near
from ..shapes.placed import Placed
from ..shapes.region import GENERATED
from ..warnings.idle import idle
from .drives import clash

ROUNDING = 1e-9
"""Two lengths or times with a smaller relative difference count as equal. The tolerance is far above the rounding of
units (1e-16) and far below any tolerance of a drawing (chosen value)."""


def check_boundaries(case: Case) -> Iterator[Problem]:
    """Yields the problems of the boundaries of a case, in the order of their keys."""
    names = [part.name for part in case.parts]
    for i, boundary in enumerate(case.boundaries):
        for j, name in enumerate(boundary.parts):
            if name not in names:
                yield problem(("boundaries", i, "parts", j), name, f"no part of this name; {nearest(name, names)}")
        if isinstance(boundary, Prescribed):
            yield from _prescribed(boundary, ("boundaries", i))
        elif isinstance(boundary, Rotation):
            yield from _rotation(boundary, ("boundaries", i))
        elif isinstance(boundary, Gravity):
            yield from _gravity(boundary, ("boundaries", i))
        elif isinstance(boundary, Traction):
            yield from _traction(boundary, ("boundaries", i))
        yield from _out_of_reach(case, i)
    yield from _two_drives(case)


def _out_of_reach(case: Case, number: int) -> Iterator[Problem]:
    """Yields a problem for a plane or a box that contains no body of the boundary, and for a traction whose box lies
    completely inside a body. The function cannot find a box that lies between the nodes of a body; the worker reports
    such a box.
    """
    boundary = case.boundaries[number]
    parts = [part for part in case.parts if not boundary.parts or part.name in boundary.parts]
    known = {part.name: Placed(part.mesh, part.turn) for part in parts if not isinstance(part.mesh, Measured | Loose)}
    if not known or len(known) < len(parts):
        return
    bodies = [body.bounds() for body in known.values()]
    if isinstance(boundary, Symmetry):
        d = index(boundary.axis)
        margin = GENERATED * max(abs(x) for body in bodies for corner in body for x in corner)
        apart = not any(low[d] - margin <= boundary.at <= high[d] + margin for low, high in bodies)
        if apart and not any(
            _comes(case, part, d, boundary.at - low[d]) for part, (low, _) in zip(parts, bodies, strict=True)
        ):
            reach = f"{min(low[d] for low, _ in bodies):g} and {max(high[d] for _, high in bodies):g} m"
            message = (
                f"no body lies on this plane or moves towards it: the bodies are between {reach} along {boundary.axis}"
            )
            yield problem(("boundaries", number, "at"), f"{boundary.at:g} m", message)
    elif isinstance(boundary, Prescribed | Traction) and boundary.low is not None and boundary.high is not None:
        box = list(zip(boundary.low, boundary.high, strict=True))
        if any(a > b for a, b in box):
            return
        margin = max(near(body) for body in known.values())
        wider = [(a - margin, b + margin) for a, b in box]
        reached = {name: body for name, body in known.items() if _meet(wider, body.bounds())}
        if not reached:
            low, high = (
                [pick(x) for x in zip(*corners, strict=True)]
                for pick, corners in zip((min, max), zip(*bodies, strict=True), strict=True)
            )
            reach = " to ".join(f"({', '.join(f'{x:g}' for x in corner)})" for corner in (low, high))
            yield problem(("boundaries", number), ..., f"the box contains no body; the bodies are in {reach} m")
        elif isinstance(boundary, Traction) and all(_surrounds(body, wider) for body in reached.values()):
            message = f"the box lies inside {choices(reached)}; tractions act on surfaces"
            yield problem(("boundaries", number), ..., message)
        else:
            yield from idle(case, number)


def _meet(box: list[tuple[float, float]], body: tuple[Vector, Vector]) -> bool:
    return all(a <= top and b >= bottom for (a, b), bottom, top in zip(box, *body, strict=True))


def _surrounds(body: Placed, box: list[tuple[float, float]]) -> bool:
    """Whether the box lies inside the body. The function tests the corners of the box. This test is exact for bodies
    without holes and slits.
    """
    if isinstance(body.mesh, Tube) or (isinstance(body.mesh, Box | Plate) and body.mesh.slit is not None):
        return False
    first, second, third = box
    return all(body.holds((x, y, z)) for x, y, z in itertools.product(first, second, third))


def _comes(case: Case, part: Part, axis: int, way: float) -> bool:
    """Whether the part may move along ``axis`` in the direction of the sign of ``way``. The result is true if the
    motion of the part is unknown or driven.
    """
    pulls = [boundary.acceleration[axis] for boundary in case.boundaries if isinstance(boundary, Gravity)]
    unknown = part.spin is not None or part.stretch is not None or part.jitter > 0.0
    driven = any(isinstance(boundary, Prescribed | Rotation | Traction) for boundary in case.boundaries)
    return unknown or driven or any(speed * way > 0.0 for speed in (part.velocity[axis], *pulls))


def _two_drives(case: Case) -> Iterator[Problem]:
    """Yields a problem for two boundaries that prescribe different motions of a whole part. The worker checks
    boundaries with boxes, because it has the nodes.
    """
    drives = [(i, each) for i, each in enumerate(case.boundaries) if isinstance(each, Rotation) or _whole(each)]
    drives = [(i, each) for i, each in drives if getattr(each, "on", None) is None]
    names = [part.name for part in case.parts]
    for (i, first), (j, second) in itertools.combinations(drives, 2):
        shared = [name for name in names if all(not each.parts or name in each.parts for each in (first, second))]
        axes = clash(first, second)
        if shared and axes:
            what = f"the velocity of part {shared[0]!r} along {choices(axes)}"
            message = f"prescribes {what}, which boundaries[{i}] prescribes differently; keep one of the two"
            yield problem(("boundaries", j), ..., message)


def _whole(boundary: object) -> bool:
    return isinstance(boundary, Prescribed) and boundary.low is None and boundary.high is None and boundary.on is None


def _prescribed(boundary: Prescribed, location: Location) -> Iterator[Problem]:
    if boundary.x is None and boundary.y is None and boundary.z is None:
        yield problem(location, ..., "needs at least one of x, y, z")
    yield from _box(boundary, location)
    yield from _course(boundary, location)


def _gravity(boundary: Gravity, location: Location) -> Iterator[Problem]:
    if not any(boundary.acceleration):
        yield problem((*location, "acceleration"), "0, 0, 0", "must not be zero")
    yield from _course(boundary, location)


def _traction(boundary: Traction, location: Location) -> Iterator[Problem]:
    if (boundary.stress is None) == (boundary.pressure is None):
        yield problem(location, ..., "needs either stress or pressure")
    elif boundary.stress is not None and not any(boundary.stress):
        yield problem((*location, "stress"), "0, 0, 0", "must not be zero")
    elif boundary.pressure == 0.0:
        yield problem((*location, "pressure"), 0, "must not be zero")
    if boundary.follows and boundary.pressure is None:
        yield problem((*location, "follows"), True, "needs pressure; a stress cannot follow the surface")
    if (round_ := boundary.cylinder) is not None and round_.inner_radius > round_.radius:
        message = f"must not be above radius, {round_.radius:g} m"
        yield problem((*location, "cylinder", "inner_radius"), f"{round_.inner_radius:g} m", message)
    yield from _box(boundary, location)
    yield from _course(boundary, location)


def _rotation(boundary: Rotation, location: Location) -> Iterator[Problem]:
    yield from _course(boundary, location)
    yield from _later(boundary.velocity_course, (*location, "velocity_course"))
    if boundary.course and not any(boundary.spin.rate):
        yield problem((*location, "course"), ..., "multiplies spin.rate, which is zero")
    if boundary.velocity_course and not any(boundary.velocity):
        yield problem((*location, "velocity_course"), ..., "multiplies velocity, which is zero")


def _course(boundary: Prescribed | Rotation | Gravity | Traction | Wall, location: Location) -> Iterator[Problem]:
    yield from _later(boundary.course, (*location, "course"))


def _later(course: Course, location: Location) -> Iterator[Problem]:
    """Yields a problem for each time that is not later than the time before it."""
    for k, ((before, _), (after, _)) in enumerate(itertools.pairwise(course)):
        if not after > before:
            yield problem((*location, k + 1, 0), after, f"must be later than the time before it, {before:g} s")


def _box(boundary: Prescribed | Traction, location: Location) -> Iterator[Problem]:
    if (boundary.low is None) != (boundary.high is None):
        yield problem(location, ..., "needs both low and high, or neither for the whole parts")
    elif boundary.low is not None and boundary.high is not None:
        yield from ordered(boundary.low, boundary.high, location)


def ordered(low: tuple[float, ...], high: tuple[float, ...], location: Location) -> Iterator[Problem]:
    """Yields a problem for corners of a box if ``high`` is below ``low``."""
    for d, (a, b) in enumerate(zip(low, high, strict=True)):
        if a > b:
            yield problem((*location, "high", d), b, f"must not be below low[{d}], {a}")


def check_walls(case: Case) -> Iterator[Problem]:
    """Yields a problem for two walls with the same name, for a wall without a normal, and for a part that starts behind
    a wall.
    """
    walls = [(i, boundary) for i, boundary in enumerate(case.boundaries) if isinstance(boundary, Wall)]
    seen: set[str] = set()
    for i, wall in walls:
        if wall.name in seen:
            yield problem(("boundaries", i, "name"), wall.name, "an earlier wall has this name; use different names")
        seen.add(wall.name)
        yield from _shape(wall, ("boundaries", i))
        yield from _course(wall, ("boundaries", i))
        yield from _off_mirrors(case, wall, ("boundaries", i))
        if wall.normal is not None and any(wall.normal) and wall.shape == "plane":
            yield from _behind(case, i, wall.point, wall.normal, wall.parts)


def _off_mirrors(case: Case, wall: Wall, location: Location) -> Iterator[Problem]:
    """Yields a problem for a free wall that a plane of symmetry maps to itself, and that moves across the plane."""
    for number, plane in mirrors(case, wall) if wall.mass is not None else ():
        d = index(plane.axis)
        if wall.velocity[d]:
            message = f"the plane of symmetry boundaries[{number}] cuts this wall, which cannot move across it; use 0"
            yield problem((*location, "velocity", d), f"{wall.velocity[d]:g} m/s", message)


def _shape(wall: Wall, location: Location) -> Iterator[Problem]:
    """Yields a problem for each key that the shape of a wall needs and the case lacks, and for each key that the shape
    does not have.
    """
    needed = {"plane": ("normal",), "cylinder": ("axis", "radius"), "sphere": ("radius",)}[wall.shape]
    for key in ("normal", "axis", "radius"):
        value = getattr(wall, key)
        if key in needed and value is None:
            yield problem((*location, key), ..., f"this key is missing; a {wall.shape} needs {choices(needed)}")
        elif key not in needed and value is not None:
            yield problem((*location, key), ..., f"a {wall.shape} has no {key}; it needs {choices(needed)}")
        elif isinstance(value, tuple) and not any(value):
            yield problem((*location, key), "0, 0, 0", "must not be zero")
    if wall.shape == "plane" and wall.side == "inside":
        yield problem((*location, "side"), wall.side, "a plane has no inside; reverse its normal")
    if wall.course and wall.mass is not None:
        yield problem((*location, "course"), ..., "a wall with a mass is free; remove course or mass")
    elif wall.course and not any(wall.velocity):
        yield problem((*location, "course"), ..., "multiplies velocity, which is zero")


def _behind(case: Case, number: int, point: Vector, way: Vector, parts: tuple[str, ...]) -> Iterator[Problem]:
    length = math.hypot(*way)
    normal = (way[0] / length, way[1] / length, way[2] / length)
    level = sum(n * x for n, x in zip(normal, point, strict=True))
    for part in case.parts:
        if isinstance(part.mesh, Measured) or part.turn is not None or (parts and part.name not in parts):
            continue
        depth = level - lowest_along(part.mesh, normal)
        if depth > GENERATED * max(abs(x) for corner in Placed(part.mesh).bounds() for x in corner):
            message = f"part {part.name!r} starts {depth:g} m behind this wall; move it, or reverse the normal"
            yield problem(("boundaries", number), ..., message)
