"""Warnings about loads and motions that contradict a plane of symmetry: on the other side of the plane they would have
the opposite direction.
"""

from collections.abc import Iterator

from ..model.bodies import Loose
from ..model.schema import Case, Gravity, Part, Symmetry
from ..model.solids import Measured
from ..reading.problems import Location, Problem, dotted
from ..shapes.geometry import index
from ..shapes.placed import Placed
from ..shapes.region import GENERATED


def mirrored(case: Case) -> Iterator[Problem]:
    """Yields a warning for gravity with a component normal to a plane of symmetry, and for an initial velocity or spin
    that moves nodes off the plane.

    The motion of a part is checked only if its mesh is generated, it is not turned, and one side of its bounds lies on
    the plane.
    """
    for number, plane in case.boundaries_of(Symmetry):
        d = index(plane.axis)
        for j, gravity in case.boundaries_of(Gravity):
            if gravity.acceleration[d] and _share(plane, gravity):
                where, value = ("boundaries", j, "acceleration", d), f"{gravity.acceleration[d]:g} m/s^2"
                yield _across(where, value, plane, number, "is accelerated the other way")
        for i, part in enumerate(case.parts):
            if not (plane.parts and part.name not in plane.parts) and _ends_on(part, plane, d):
                yield from _moving(part, i, plane, number, d)


def _share(plane: Symmetry, gravity: Gravity) -> bool:
    return not plane.parts or not gravity.parts or bool({*plane.parts} & {*gravity.parts})


def _ends_on(part: Part, plane: Symmetry, d: int) -> bool:
    """Whether the plane of symmetry is a side of the bounds of the part."""
    if isinstance(part.mesh, Measured | Loose) or part.turn is not None:
        return False
    low, high = (corner[d] for corner in Placed(part.mesh).bounds())
    return min(abs(low - plane.at), abs(high - plane.at)) <= GENERATED * max(abs(low), abs(high))


def _moving(part: Part, i: int, plane: Symmetry, number: int, d: int) -> Iterator[Problem]:
    words = "moves the other way, and the nodes on the plane stop in the first step"
    if part.velocity[d]:
        yield _across(("parts", i, "velocity", d), f"{part.velocity[d]:g} m/s", plane, number, words)
    if part.spin is not None and any(rate for k, rate in enumerate(part.spin.rate) if k != d):
        yield _across(("parts", i, "spin", "rate"), "", plane, number, words)


def _across(where: Location, value: str, plane: Symmetry, number: int, words: str) -> Problem:
    message = f"points across the plane of symmetry {plane.axis} = {plane.at:g} m, boundaries[{number}]"
    return Problem(dotted(where), value, f"{message}: the mirror image {words}")
