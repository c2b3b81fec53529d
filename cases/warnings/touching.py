"""Warnings about bodies whose surfaces touch at the start: without a bond the two parts are not joined."""

import itertools
import math
from collections.abc import Iterable, Iterator
from itertools import combinations, islice

import msgspec

from ..model.bodies import Loose
from ..model.schema import Case
from ..model.solids import Measured
from ..reading.problems import Problem, problem
from ..shapes.geometry import Vector
from ..shapes.placed import Placed
from ..shapes.sheets import sheets

NEAR = 1e-6
"""Largest distance of faces that count as touching, divided by the size of a body: far above rounding errors and below
any gap of a model (chosen value)."""
_FINEST = 40
"""Largest number of patches along a side of a surface; a body then takes a tenth of a second (chosen value)."""
_PAIRS = 32
"""Largest number of pairs of bodies that are checked; they take one or two seconds at most (chosen value)."""
_LEAST = 1e-3
"""Smallest touching area, divided by the surface of the smaller body, that gives a warning (chosen value). A smaller
area is an edge or a corner that rounding makes an area."""


class Touch(msgspec.Struct, kw_only=True, frozen=True):
    """Two touching parts, given by their indices in the case, and the approximate ``area``, m^2, over which they
    touch.
    """

    one: int
    other: int
    area: float


def touching(case: Case) -> list[Touch]:
    """Returns the pairs of generated bodies that touch and have no bond. Single tets and mesh files are not checked."""
    bodies = [
        (i, Placed(part.mesh, part.turn))
        for i, part in enumerate(case.parts)
        if not isinstance(part.mesh, Measured | Loose)
    ]
    near = (((i, j), (a, b)) for (i, a), (j, b) in combinations(bodies, 2) if _reach(a, b) and not bonded(case, i, j))
    found = [Touch(one=i, other=j, area=_common(*sorted(both, key=size))) for (i, j), both in islice(near, _PAIRS)]
    return [each for each in found if each.area > 0.0]


def bonded(case: Case, one: int, other: int) -> bool:
    """Whether the two parts with the given indices have a bond."""
    names = {case.parts[one].name, case.parts[other].name}
    return any(set(bond.parts) == names for bond in case.bond)


def apart(case: Case, touches: Iterable[Touch]) -> Iterator[Problem]:
    """Yields a warning for each pair of parts that touch but have neither contact nor bond, so that no force acts
    between them.
    """
    for touch in touches:
        names = [case.parts[i].name for i in (touch.one, touch.other)]
        if case.contact is not None and (not case.contact.parts or set(names) <= set(case.contact.parts)):
            continue
        message = (
            f"{names[0]!r} and {names[1]!r} touch over about {1e6 * touch.area:.3g} mm^2 without contact or bond: "
            "they can pass through each other; a [[bond]] joins parts"
        )
        yield problem(("parts", touch.other, "mesh"), ..., message)


def size(body: Placed) -> float:
    """Returns the largest extent of a body, m."""
    low, high = body.bounds()
    return max(b - a for a, b in zip(low, high, strict=True))


def _reach(one: Placed, other: Placed) -> bool:
    """Whether the bounding boxes of two bodies touch."""
    margin = NEAR * max(size(one), size(other))
    return all(
        a - margin <= d and c - margin <= b
        for a, b, c, d in zip(*one.bounds(), *other.bounds(), strict=True)
    )  # fmt: skip


def _common(one: Placed, other: Placed) -> float:
    """Returns the area, m^2, of the surface of the first body that lies on the surface of the second body, summed over
    patches as large as elements.
    """
    margin = NEAR * min(size(one), size(other))
    low, high = other.bounds()
    area = whole = 0.0
    for at, first, second in sheets(one.mesh):
        n, m = (max(4, min(_FINEST, round(length / one.mesh.element_size))) for length in (first, second))
        for i, j in itertools.product(range(n), range(m)):
            centre = one.turned(at((i + 0.5) / n, (j + 0.5) / m))
            along = [one.turned(at((i + k) / n, (j + 0.5) / m)) for k in (0.25, 0.75)]
            across = [one.turned(at((i + 0.5) / n, (j + k) / m)) for k in (0.25, 0.75)]
            normal = _cross(_minus(along[1], along[0]), _minus(across[1], across[0]))
            length = math.hypot(*normal)
            whole += 4.0 * length
            inside = all(a - margin <= x <= b + margin for a, x, b in zip(low, centre, high, strict=True))
            if inside and length and _ends(one, other, centre, normal, 2.0 * margin / length):
                area += 4.0 * length
    return area if area > _LEAST * whole else 0.0


def _ends(one: Placed, other: Placed, point: Vector, normal: Vector, step: float) -> bool:
    """Whether the surface of the second body passes through ``point`` of the surface of the first body. ``step``: small
    distance along the normal at which points on both sides are tested.
    """
    for sign in (-1.0, 1.0):
        own = _moved(point, normal, -sign * step)
        far = _moved(point, normal, sign * step)
        if one.holds(own) and other.holds(far) and not (one.holds(far) or other.holds(own)):
            return True
    return False


def _moved(point: Vector, normal: Vector, step: float) -> Vector:
    (x, y, z), (a, b, c) = point, normal
    return x + step * a, y + step * b, z + step * c


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
