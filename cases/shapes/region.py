"""Regions of a case: the box of a boundary or a probe, what lies round a line, or what is in both.

One tolerance decides for all of them, in ``validate`` and in the run, what lies on a border: ``slack``. All functions
take numbers, or arrays of one shape.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

from ..model.bodies import Mesh
from ..model.boundaries import Around, Prescribed, Traction
from ..model.measures import Probe
from ..model.solids import Measured
from ..model.tables import Point

NEAR, MOST = 0.01, 0.1
"""Of the shortest edge of a part: what lies no further outside of a border is in, and what no rounding exceeds. Chosen:
far above the rounding of turns, of sums and of units, and that of files with six digits up to 2,000 edges from the
origin; far below the distance between two layers of nodes."""
GENERATED, FILE = 1e-9, 5e-6
"""Of the largest coordinate of a part: rounding of the coordinates of a generated mesh, with what turns and sums add
(1e-15) and far more; and of a file with six significant digits (half of 1e-5), which includes single precision (6e-8).
"""


def rounding(mesh: Mesh, edge: float, reach: float) -> float:
    """By how much, m, rounding may move a node of a part off the plane on which it is meant to be.

    ``edge``: shortest edge of the part, m; ``reach``: its largest coordinate, m.
    """
    share = FILE if isinstance(mesh, Measured) else GENERATED
    return min(share * reach, MOST * edge)


def slack(mesh: Mesh, edge: float, reach: float) -> float:
    """How far outside of a border, m, a node or a centre of a tet may be and is still in; see ``rounding``."""
    return max(NEAR * edge, rounding(mesh, edge, reach))


class Region(NamedTuple):
    """A box, a cylinder, or both; everything where neither is given."""

    low: Point | None = None
    high: Point | None = None
    cylinder: Around | None = None

    @classmethod
    def of(cls, spec: Prescribed | Traction | Probe) -> "Region":
        """That of a boundary or a probe."""
        return cls(spec.low, spec.high, spec.cylinder if isinstance(spec, Traction) else None)

    @property
    def everything(self) -> bool:
        """Whether nothing is outside."""
        return self == Region()

    def holds(self, point: Iterable[Any], slack: Any) -> Any:
        """Whether a point, m, lies in it, or no further outside than ``slack``, m; of arrays (3, n) an array (n,), but
        True of everything.
        """
        inside: Any = True
        x, y, z = point
        for at, low, high in zip((x, y, z), self.low or (), self.high or (), strict=False):
            inside = inside & (at >= low - slack) & (at <= high + slack)
        return inside if self.cylinder is None else inside & _round(self.cylinder, (x, y, z), slack)


def _round(shell: Around, point: tuple[Any, Any, Any], slack: Any) -> Any:
    """Whether points lie between two radii round a line; squares are compared, which arrays can do as well."""
    d = "xyz".index(shell.axis)
    p, q = (point[e] - shell.base[e] for e in ((d + 1) % 3, (d + 2) % 3))
    squared, inner, outer = p * p + q * q, shell.inner_radius - slack, shell.radius + slack
    return (squared <= outer * outer) & ((inner <= 0.0) | (squared >= inner * inner))
