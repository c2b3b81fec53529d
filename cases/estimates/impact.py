"""Impact speeds of the parts of a case, and the parameters of the contact solver that depend on them."""

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from ..model.boundaries import Prescribed, Rotation, Traction, Wall
from ..model.courses import extremes
from ..model.materials import Material
from ..model.schema import Case, Part
from ..model.solids import Measured
from ..reading.library import material
from ..shapes.geometry import Vector
from ..shapes.placed import Placed, driven, rotated, velocity

FEW, MANY, FULL, MOST = 5, 10, 40, 80
"""Numbers of contact sweeps per time step: the smallest number; the smallest number at high impact speed; the smallest
number for driven rubble and with restitution; the largest number. The sections "Contact", "Driven rubble", "Sweeps by
need" and "Restitution" of docs/theory/contact.md give the reasons."""
FAST = 0.2
"""Impact speed divided by the wave speed of the target, above which a step has at least MANY sweeps. This limit of the
impact speed is below half of the speed at which columns of metal became wrong with few sweeps (docs/theory/contact.md,
"Plates under 100 GPa")."""
PRESSING = 0.1
"""Impact speed divided by the wave speed, above which flat contact surfaces buckle. This limit of the impact speed is
half of the speed at which the contact pressure between irregular copper plates was lost (docs/theory/contact.md,
"Ridges under pressure").
"""


def wave_speed(made: Material) -> float:
    """Returns the speed of plane waves in the undeformed material, m/s: sqrt((K + 4 G / 3) / density), with the bulk
    modulus K of the equation of state if there is one.
    """
    return math.sqrt((made.bulk + 4.0 / 3.0 * made.elastic.shear) / made.density)


def impact_speeds(case: Case, walls: bool = True) -> list[float]:
    """Returns, for each part, the largest speed, m/s, at which it can hit another part; if ``walls`` is true, also a
    wall. The speed follows from bounds of the velocities. If a body rotates, it may be up to sqrt(3) times too large.
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
    """Returns bounds of the velocities, m/s, of the nodes of the part, initial or prescribed. The spin and stretch of a
    part with a mesh file are not included.
    """
    if isinstance(part.mesh, Measured):
        found = [part.velocity]
    else:
        low, high = Placed(part.mesh, part.turn).bounds()
        corners = list(itertools.product(*((low[k], high[k]) for k in range(3))))
        found = [velocity(moving, (x, y, z)) for moving in _motions(case, part) for x, y, z in corners]
    for _, drive in case.boundaries_of(Prescribed):
        if not drive.parts or part.name in drive.parts:
            given = [_given(drive, factor, speeds) for factor in extremes(drive.course) for speeds in found]
            found = given if drive.low is None and drive.high is None and drive.on is None else [*found, *given]
    least, most = ([pick(each) for each in zip(*found, strict=True)] for pick in (min, max))
    return _shifted(least, -part.jitter), _shifted(most, part.jitter)


def _motions(case: Case, part: Part) -> list[Part]:
    """Returns a part with its motion at the start, or with the extreme motions of a boundary that rotates it."""
    turning = rotated(case, part)
    if turning is None:
        return [part]
    factors = itertools.product(extremes(turning.course), extremes(turning.velocity_course))
    return [driven(case, part, each) for each in factors]


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
    """Returns, for each part, whether an impact presses it beyond its strength, so that flat contact surfaces buckle.

    If two parts collide at more than PRESSING times the wave speed of one of them, all parts count as pressed beyond
    their strength. Otherwise a part counts as pressed beyond its strength if it yields, cannot fracture, and is hit so
    fast that the stress density c v / 2 of an impact on the same material exceeds its flow stress.
    """
    if _fast(case, PRESSING):
        return [True] * len(case.parts)
    return [
        part.fracture is None and flows(material(case, part.material), speed)
        for part, speed in zip(case.parts, impact_speeds(case, walls=False), strict=True)
    ]


def flows(made: Material, speed: float) -> bool:
    """Whether the stress of an impact on the same material at ``speed``, m/s, exceeds the flow stress of the
    material.
    """
    return made.strength is not None and 0.5 * made.density * wave_speed(made) * speed > made.strength.flow_stress()


def driven_together(case: Case) -> bool:
    """Whether the case has contact and a prescribed motion or a traction on a part. A prescribed motion presses parts
    together during the whole run; an impact does so only until the bodies have stopped.
    """
    if case.boundaries_of(Traction):
        return len(case.parts) > 1 or bool(case.boundaries_of(Wall))
    moved = any(value for _, drive in case.boundaries_of(Prescribed) for value in (drive.x, drive.y, drive.z))
    return (moved or bool(case.boundaries_of(Rotation))) and any(impact_speeds(case))


class Sweeps(NamedTuple):
    """Smallest and largest number of sweeps over the active contacts of a time step; the first step has the smallest
    number.
    """

    least: int
    most: int


def sweeps(case: Case) -> Sweeps:
    """Returns ``contact.sweeps``. If the case has no such key, returns the bounds between which the number of sweeps
    adapts, from the properties of the scene.
    """
    assert case.contact is not None
    if case.contact.sweeps is not None:
        return Sweeps(case.contact.sweeps, case.contact.sweeps)
    if case.contact.restitution > 0.0 or (case.fractures and driven_together(case)):
        return Sweeps(FULL, MOST)
    return Sweeps(MANY if _fast(case, FAST) else FEW, MOST)
