"""Velocity arrows in a snapshot. The arrows start at a few triangles that are distributed evenly over the outline."""

import numpy as np

from ..model.state import Floats, Ints
from .outline import Outline

_MOST = 1000
"""Largest number of arrows in a snapshot. Chosen value: more arrows would hide the body."""
MOST_BYTES = _MOST * (4 + 3 * 4)
_LEVELS = 6
"""Level of the finest grid that is tried. The finest grid has 2^6 cells along the longest side; the coarsest grid has
one cell."""


def chosen(drawn: Outline, velocity: Floats) -> dict[str, "np.ndarray"]:
    """Return two arrays of a snapshot: the triangles with an arrow, and the velocities of these triangles. ``velocity``
    (m, 3): velocity of each triangle, m/s.

    The first triangle in each cell of a grid gets an arrow. The function uses the finest grid with at most ``_MOST``
    occupied cells.
    """
    rows = np.zeros(0, np.int64)
    if len(drawn.tet):
        corners = drawn.points[drawn.triangles]
        middle = (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3.0
        rows = _spread(middle - middle.min(axis=0))
    return {"arrow_triangle": rows.astype(np.uint32), "arrow_velocity": velocity[rows].astype(np.float32)}


def _spread(places: Floats) -> Ints:
    longest = float(places.max()) or 1.0
    for level in range(_LEVELS, -1, -1):
        side = 2**level
        cell = np.minimum((places * (side / longest)).astype(np.int64), side - 1)
        found = np.unique((cell[:, 0] * side + cell[:, 1]) * side + cell[:, 2], return_index=True)[1]
        if len(found) <= _MOST:
            break
    return np.sort(found)
