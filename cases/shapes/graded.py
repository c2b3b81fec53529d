"""Element sizes of a graded mesh, as a function of the distance from a point, line or plane, or of the depth below the
surface.
"""

import math
from collections.abc import Callable

from ..model.grading import Grading
from .geometry import Vector, index

_DEPTHS = 64
"""Number of depths below the surface that are used for a mean of element sizes (chosen value). Means of 64 depths and
of 1,000 depths differ by less than 1 %."""


def size_at(size: float, grading: Grading) -> Callable[[Vector], float]:
    """Returns a function that returns the element size, m, at a point, for a grading by the distance from a point, line
    or plane. Make it once for many points. ``size``: the element size at small distances, m.
    """
    origin, radius = grading.origin, grading.radius
    if grading.normal is not None:
        d = index(grading.normal)
        return lambda point: _size(size, grading, abs(point[d] - origin[d]))
    if grading.axis is None:
        return lambda point: _size(size, grading, abs(math.dist(point, origin) - radius))
    i, j = (d for d in range(3) if d != index(grading.axis))
    x, y = origin[i], origin[j]
    return lambda point: _size(size, grading, abs(math.hypot(point[i] - x, point[j] - y) - radius))


def sizes_by_depth(size: float, grading: Grading, volume: float, surface: float) -> list[float]:
    """Returns the element sizes, m, at equal fractions of the volume of a body, from the surface inwards.

    The fraction of the volume that is deeper than d is (1 - d / r)^3 with r = 3 volume / surface. The formula is exact
    for a sphere and for a cube.
    """
    r = 3.0 * volume / surface
    shares = [(k + 0.5) / _DEPTHS for k in range(_DEPTHS)]
    return [_size(size, grading, r * (1.0 - (1.0 - share) ** (1.0 / 3.0))) for share in shares]


def _size(size: float, grading: Grading, distance: float) -> float:
    share = (distance - grading.near) / (grading.far - grading.near)
    return size + (grading.far_size - size) * min(max(share, 0.0), 1.0)
