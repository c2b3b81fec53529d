"""Mirror images of walls behind planes of symmetry."""

import math

from ..model.schema import Case, Symmetry, Wall
from .geometry import Vector, index

_ROUNDING = 1e-9
"""Largest component of a unit vector, or distance divided by the size of the coordinates, that counts as zero; far
above the rounding errors of units (chosen value)."""


def mirrors(case: Case, wall: Wall) -> list[tuple[int, Symmetry]]:
    """Returns the planes of symmetry, with their numbers, that map a wall to itself and act on all parts that the wall
    stops. The wall is cut by such a plane, and only a part of the wall is modelled.
    """
    names = wall.parts or [part.name for part in case.parts]
    return [
        (number, plane)
        for number, plane in case.boundaries_of(Symmetry)
        if (not plane.parts or all(name in plane.parts for name in names)) and _own_image(wall, plane)
    ]


def _own_image(wall: Wall, plane: Symmetry) -> bool:
    d = index(plane.axis)
    size = max(abs(c) for c in (*wall.point, plane.at, wall.radius or 0.0))
    centred = abs(wall.point[d] - plane.at) <= _ROUNDING * size
    if wall.shape == "sphere":
        return centred
    along = _along(wall.normal or wall.axis or (0.0, 0.0, 0.0), d)
    if wall.shape == "plane":
        return along <= _ROUNDING
    return along >= 1.0 - _ROUNDING or (along <= _ROUNDING and centred)


def _along(direction: Vector, d: int) -> float:
    """Returns the absolute component of the unit vector of a direction along an axis; 0 for the zero vector."""
    length = math.hypot(*direction)
    return abs(direction[d]) / length if length > 0.0 else 0.0
