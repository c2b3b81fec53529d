"""Impact speeds of the parts, and the numerical parameters of contact that depend on them."""

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from ..model.boundaries import Course, Prescribed, Rotation, Traction, Wall
from ..model.materials import Material
from ..model.schema import Case, Part
from ..model.solids import Measured
from ..reading.library import material
from ..shapes.geometry import Vector
from ..shapes.placed import Placed, driven, velocity

FEW, MANY, FULL, MOST = 5, 10, 40, 80
"""Numbers of contact sweeps per step: minimum, minimum at high impact speed, minimum for driven rubble and with
restitution, and maximum. The reasons are in docs/theory/contact.md, "Contact", "Driven rubble", "Sweeps by need" and
"Restitution"."""
FAST = 0.2
"""Impact speed divided by the wave speed of the target, above which the minimum number of sweeps is MANY. The value is
below half of the speed at which few sweeps failed for columns of metal (docs/theory/contact.md, "Plates under 100
GPa")."""
PRESSING = 0.1
"""Impact speed divided by the wave speed, above which flat surfaces buckle. The value is half of the speed at which
irregular copper plates lost their pressure (docs/theory/contact.md, "Ridges under pressure")."""


def wave_speed(made: Material) -> float:
    """Returns the speed of plane waves at rest, m/s: sqrt((K + 4 G / 3) / density), K from the equation of state if the
    material has one.
    """
    return math.sqrt((made.bulk + 4.0 / 3.0 * made.elastic.shear) / made.density)


def impact_speeds(case: Case, walls: bool = True) -> list[float]:
    """Returns the largest speed, m/s, at which each part can hit another part, or also a wall if ``walls`` is true. The
    speed is computed from the bounds of the velocities, and may be up to sqrt(3) times too large if a body rotates.
    """
    bounds = [velocities(case, part) for part in case.parts]
    there = Counter(bounds)
    for _, wall in case.boundaries_of(Wall) if walls else ():
        there[wall.velocity, wall.velocity] += 1
    return [
        max((apart(*own, *other) for other, many in there.items() if other != own or many > 1), default=0.0)
        for own in bounds
    ]


def apart(low: Vector, high: Vector, low2: Vector, high2: Vector) -> float:
    """Returns the largest distance between a point of one box and a point of another box, m."""
    return math.hypot(*(max(b - c, d - a) for a, b, c, d in zip(low, high, low2, high2, strict=True)))


def velocities(case: Case, part: Part) -> tuple[Vector, Vector]:
    """Returns bounds of the velocities, m/s, of the nodes of a part at the start or as prescribed; spin and stretch of
    a mesh file are not included.
    """
    if isinstance(part.mesh, Measured):
        found = [part.velocity]
    else:
        moving, (low, high) = driven(case, part), Placed(part.mesh, part.turn).bounds()
        sides = (low[0], high[0]), (low[1], high[1]), (low[2], high[2])
        found = [velocity(moving, (x, y, z)) for x, y, z in itertools.product(*sides)]
    for _, drive in case.boundaries_of(Prescribed):
        if not drive.parts or part.name in drive.parts:
            given = [_given(drive, factor, speeds) for factor in _extremes(drive.course) for speeds in found]
            found = given if drive.low is None and drive.high is None and drive.on is None else [*found, *given]
    least, most = ([pick(each) for each in zip(*found, strict=True)] for pick in (min, max))
    return _shifted(least, -part.jitter), _shifted(most, part.jitter)


def _extremes(course: Course) -> tuple[float, float]:
    factors = [factor for _, factor in course] or [1.0]
    return min(factors), max(factors)


def _given(drive: Prescribed, factor: float, speeds: Vector) -> Vector:
    x, y, z = (
        old if new is None else factor * new for new, old in zip((drive.x, drive.y, drive.z), speeds, strict=True)
    )
    return x, y, z


def _shifted(vector: Sequence[float], by: float) -> Vector:
    x, y, z = vector
    return x + by, y + by, z + by


def _fast(case: Case, share: float) -> bool:
    """Whether two parts collide at more than ``share`` times the wave speed of one of them."""
    speeds = impact_speeds(case, walls=False)
    return any(
        speed > share * wave_speed(material(case, part.material))
        for part, speed in zip(case.parts, speeds, strict=True)
    )


def pressed(case: Case) -> list[bool]:
    """Returns the parts that are pressed together beyond their strength, so that flat surfaces buckle.

    All parts are returned if two of them collide at more than PRESSING times the wave speed of one of them. Otherwise
    the function returns the parts that yield without fracture, if an impact on the same material exceeds their flow
    stress: density c v / 2.
    """
    if _fast(case, PRESSING):
        return [True] * len(case.parts)
    return [
        part.fracture is None and flows(material(case, part.material), speed)
        for part, speed in zip(case.parts, impact_speeds(case, walls=False), strict=True)
    ]


def flows(made: Material, speed: float) -> bool:
    """Whether an impact of a material on the same material at ``speed``, m/s, exceeds its flow stress."""
    return made.strength is not None and 0.5 * made.density * wave_speed(made) * speed > made.strength.flow_stress()


def driven_together(case: Case) -> bool:
    """Whether contact is possible while a prescribed motion or a traction acts on a part. A prescribed motion presses
    for its whole duration; an impact presses only until the bodies have stopped.
    """
    if case.boundaries_of(Traction):
        return len(case.parts) > 1 or bool(case.boundaries_of(Wall))
    moved = any(value for _, drive in case.boundaries_of(Prescribed) for value in (drive.x, drive.y, drive.z))
    return (moved or bool(case.boundaries_of(Rotation))) and any(impact_speeds(case))


class Sweeps(NamedTuple):
    """Bounds of the number of sweeps over the active contacts of a step; the first step has the minimum."""

    least: int
    most: int


def sweeps(case: Case) -> Sweeps:
    """Returns ``contact.sweeps``; if the key is absent, the bounds of the adaptive number of sweeps, from the
    properties of the scene.
    """
    assert case.contact is not None
    if case.contact.sweeps is not None:
        return Sweeps(case.contact.sweeps, case.contact.sweeps)
    if case.contact.restitution > 0.0 or (case.fractures and driven_together(case)):
        return Sweeps(FULL, MOST)
    return Sweeps(MANY if _fast(case, FAST) else FEW, MOST)
