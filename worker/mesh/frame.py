"""The frame in which bodies are made: origin where the sector is cut, third direction along the body's axis.

Both generators work in (a, b, c), the cyclic order of ``across(axis)`` and ``axis``, and turn the points at the end, so
that each body is made once, not once an axis; the turn only permutes coordinates and is exact.
"""

import numpy as np

from conoid.cases.shapes.geometry import Generated, across, bounds, centre, index, volume

from ..errors import MeshError
from .model import MAX_TETS, Floats

TETS_PER_CUBE = 6.0
"""Tets in a volume of element_size^3, for both generators."""


def directions(body: Generated) -> list[int]:
    """Which of x, y, z the directions a, b, c are."""
    return [*across(body.axis), index(body.axis)]


def to_space(body: Generated, points: Floats) -> Floats:
    """Points (n, 3) given in (a, b, c), in x, y, z; m. A zero becomes exactly the coordinate of the cut plane."""
    turned = np.empty_like(points)
    turned[:, directions(body)] = points
    moved: Floats = turned + np.array(centre(body))
    return moved


def to_frame(body: Generated, point: tuple[float, float, float]) -> tuple[float, float, float]:
    """A point of space in (a, b, c), m."""
    a, b, c = (point[d] - centre(body)[d] for d in directions(body))
    return a, b, c


def block(body: Generated) -> tuple[list[float], list[float]]:
    """Lowest and highest (a, b, c) of what is modelled, m."""
    low, high = bounds(body) or ((0.0,) * 3, (0.0,) * 3)
    return list(to_frame(body, low)), list(to_frame(body, high))


def refuse_impossible(body: Generated, key: str) -> None:
    """MeshError for a body without volume or with more tets than anybody wants; ``key``: of the mesh in its case."""
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
