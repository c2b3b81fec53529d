"""Local frame of a body. The origin is the point where the sector is cut; the third direction is the axis of the body.

The generators work in the frame (a, b, c), which has the directions of ``across(axis)`` and ``axis`` in cyclic order.
The generators rotate the points at the end, so each body is implemented for one axis only. The rotation only permutes
coordinates and is exact.
"""

import numpy as np

from conoid.cases.shapes.geometry import Generated, across, bounds, centre, index, volume

from ..errors import MeshError
from .model import MAX_TETS, Floats

TETS_PER_CUBE = 6.0
"""Number of tets that a generator makes in a cube with the edge element_size."""


def directions(body: Generated) -> list[int]:
    """Return the indices of x, y, z for the directions a, b, c."""
    return [*across(body.axis), index(body.axis)]


def to_space(body: Generated, points: Floats) -> Floats:
    """Return points (n, 3) in x, y, z, m, from coordinates (a, b, c). A coordinate of zero becomes exactly the
    coordinate of the cut plane.
    """
    turned = np.empty_like(points)
    turned[:, directions(body)] = points
    moved: Floats = turned + np.array(centre(body))
    return moved


def to_frame(body: Generated, point: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return a point of space in (a, b, c), m."""
    a, b, c = (point[d] - centre(body)[d] for d in directions(body))
    return a, b, c


def block(body: Generated) -> tuple[list[float], list[float]]:
    """Return the lowest and the highest (a, b, c) of the modelled sector, m."""
    low, high = bounds(body) or ((0.0,) * 3, (0.0,) * 3)
    return list(to_frame(body, low)), list(to_frame(body, high))


def refuse_impossible(body: Generated, key: str) -> None:
    """Raise MeshError if a body has no volume or would have too many tets; ``key``: key of the mesh in its case."""
    whole = volume(body)
    if not whole > 0:
        raise MeshError(f"{key}: the {body.shape} has no volume; check its sizes")
    tets = TETS_PER_CUBE * whole / body.element_size**3
    if body.grading is None and tets > MAX_TETS:
        smallest = (TETS_PER_CUBE * whole / MAX_TETS) ** (1 / 3)
        raise MeshError(
            f"{key}.element_size = {body.element_size:g} m: about {tets:.2g} tets; at most {MAX_TETS:,} "
            f"(element_size {smallest:.2g} m) are allowed"
        )
