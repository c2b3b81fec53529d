"""Regions of a case: the box of a boundary or a probe, a cylinder around a line, or the points that are in both.

The same tolerance (``slack``) decides in ``conoid validate`` and in the run whether a point on a border is inside. All
functions of this module accept numbers or arrays of one shape.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

from ..model.bodies import Mesh
from ..model.boundaries import Around, Prescribed, Symmetry, Traction
from ..model.measures import Probe
from ..model.solids import Measured
from ..model.tables import Point

NEAR, MOST = 0.01, 0.1
"""Tolerances at a border, divided by the shortest edge of a part (chosen values). A point counts as inside if its
distance from the border is at most the first value; the tolerance for rounding is at most the second value. The
tolerances are far above rounding errors: those of rotations, sums and units, and those of files with six digits up to
2,000 edges from the origin. The tolerances are far below the distance between two layers of nodes."""
GENERATED, FILE = 1e-9, 5e-6
"""Rounding error of a coordinate, divided by the largest coordinate of the part: in generated meshes, and in mesh
files. The first value is far above the errors of rotations and sums (1e-15). The second value is that of six
significant digits (half of 1e-5); single precision has a smaller error (6e-8)."""


def rounding(mesh: Mesh, edge: float, reach: float) -> float:
    """Returns the largest distance, m, by which rounding may move a node of a part off its plane.

    ``edge``: shortest edge of the part, m; ``reach``: largest coordinate of the part, m.
    """
    share = FILE if isinstance(mesh, Measured) else GENERATED
    return min(share * reach, MOST * edge)


def slack(mesh: Mesh, edge: float, reach: float) -> float:
    """Returns the distance, m, from a border up to which a node or the centre of a tet outside of it counts as inside;
    see ``rounding``.
    """
    return max(NEAR * edge, rounding(mesh, edge, reach))


class Region(NamedTuple):
    """A box, a cylinder, or the points that are in both; the whole space if neither is given."""

    low: Point | None = None
    high: Point | None = None
    cylinder: Around | None = None

    @classmethod
    def of(cls, spec: Prescribed | Traction | Probe) -> "Region":
        """Returns the region of a boundary or a probe."""
        return cls(spec.low, spec.high, spec.cylinder if isinstance(spec, Traction) else None)

    @property
    def everything(self) -> bool:
        """Whether the region is the whole space."""
        return self == Region()

    def on_plane(self, plane: Symmetry, bounds: tuple[Point, Point], slack: float) -> "Region | None":
        """Returns the part of the region that lies on a plane inside the box ``bounds``; None if the plane is more than
        ``slack``, m, away from the region.
        """
        low = [max(pair) for pair in zip(bounds[0], self.low or bounds[0], strict=True)]
        high = [min(pair) for pair in zip(bounds[1], self.high or bounds[1], strict=True)]
        d = "xyz".index(plane.axis)
        if not low[d] - slack <= plane.at <= high[d] + slack:
            return None
        low[d] = high[d] = plane.at
        return self._replace(low=(low[0], low[1], low[2]), high=(high[0], high[1], high[2]))

    def holds(self, point: Iterable[Any], slack: Any) -> Any:
        """Whether a point, m, lies in the region or at most ``slack``, m, outside of it. For points (3, n) the result
        is an array (n,); for the whole space it is True.
        """
        inside: Any = True
        x, y, z = point
        for at, low, high in zip((x, y, z), self.low or (), self.high or (), strict=False):
            inside = inside & (at >= low - slack) & (at <= high + slack)
        return inside if self.cylinder is None else inside & _round(self.cylinder, (x, y, z), slack)


def _round(shell: Around, point: tuple[Any, Any, Any], slack: Any) -> Any:
    """Whether points lie between two radii around a line. The function compares squares of distances, so that it
    accepts arrays.
    """
    d = "xyz".index(shell.axis)
    p, q = (point[e] - shell.base[e] for e in ((d + 1) % 3, (d + 2) % 3))
    squared, inner, outer = p * p + q * q, shell.inner_radius - slack, shell.radius + slack
    return (squared <= outer * outer) & ((inner <= 0.0) | (squared >= inner * inner))
