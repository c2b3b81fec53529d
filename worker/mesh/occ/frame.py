"""Coordinates in which a model is drawn. The origin is the point where sectors are cut, and the third direction is
along an axis.

Lengths in the coordinates of the model are of order one, because the tolerances of gmsh and OpenCASCADE are absolute.
"""

import math
from dataclasses import dataclass

import numpy as np

from conoid.cases.model.tables import Axis
from conoid.cases.shapes.geometry import AXES, across, index

from ..model import Floats

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Frame:
    """Coordinates (a, b, c) in which a model is drawn. The coordinates have the directions of ``across(axis)`` and
    ``axis`` in cyclic order. The origin is ``origin``, m; the unit of length is ``scale``, m.
    """

    origin: Vector
    axis: Axis
    scale: float

    @property
    def directions(self) -> list[int]:
        """Indices of x, y, z for the directions a, b, c."""
        return [*across(self.axis), index(self.axis)]

    def place(self, point: Vector) -> Vector:
        """Return the coordinates (a, b, c) of a point in space, m."""
        a, b, c = ((point[d] - self.origin[d]) / self.scale for d in self.directions)
        return a, b, c

    def length(self, length: float) -> float:
        """Return a length, m, in the unit of the frame."""
        return length / self.scale

    def direction(self, axis: Axis) -> int:
        """Return the index of the direction a, b or c that is along ``axis``."""
        return self.directions.index(AXES.index(axis))

    def to_space(self, points: Floats) -> Floats:
        """Return points (n, 3) of the frame in coordinates x, y, z, m. A coordinate of zero becomes exactly the
        coordinate of the origin.
        """
        turned = np.empty_like(points)
        turned[:, self.directions] = points * self.scale
        moved: Floats = turned + np.array(self.origin)
        return moved


def scale_of(extent: float) -> float:
    """Return a power of two near a length, m. A division by a power of two is exact."""
    return 2.0 ** round(math.log2(extent))
