"""Candidate pairs: nodes and faces, edges and edges, that may be in contact before the next search.

All nodes are extrapolated for a time, the horizon. Two primitives (points, edges or faces) are candidates if their
paths come closer than their reach. A candidate list is valid until the horizon has passed or a node has departed from
its path by half of the skin. Therefore motion at a constant velocity uses no part of the skin. The candidate list may
contain pairs that never come into contact, but no pair that comes into contact is missing.
"""

import numpy as np

from ...kernels.jit import njit
from ...model.state import Flags, Floats, Indices, Ints
from ...parallel.team import Team, team
from .boxes import Boxing, Lines, Primitives, Sought, everywhere
from .buckets import Buckets
from .overlaps import Overlaps

_FEW, _SAMPLE = 8, 256
"""Ratio of the number of large primitives to the number of small primitives, above which larger cells are faster; and
number of sampled boxes from which the size of the cells is computed."""
_WORTHWHILE = 1024
"""Number of primitives in the smaller of the two sets, above which primitives that are far from the other set are
removed before the search. Chosen value: one task of boxes.py."""
_ANY = np.zeros(0, np.int64)
"""Value of the argument ``rank`` if the order of a pair has no meaning."""


class Finder:
    """Passes of a search, run by the threads of a team."""

    def __init__(self, team: Team) -> None:
        self._one, self._two = Boxing(team), Boxing(team)
        self._buckets, self._overlaps = Buckets(team), Overlaps(team)

    def find(
        self, small: Primitives, large: Primitives, lines: Lines, allowed: Flags, rank: Ints | None = None
    ) -> Indices:  # fmt: skip
        """Returns the candidate pairs of a search; see the function ``find``."""
        if not len(small.searched) or not len(large.searched):
            return np.zeros((0, 2), np.int32)
        first, second = (small, allowed), (large, allowed.T.copy())
        if len(small.searched) > len(large.searched):
            first, second = second, first
        one, hull = self._one.of(first[0], lines, first[1], everywhere(len(allowed)))
        two, near = self._two.of(second[0], lines, second[1], hull)
        if len(two.some) < len(second[0].searched) and len(one.some) > _WORTHWHILE:
            some = Primitives(first[0].corners, first[0].reach, one.some.copy(), first[0].columns)
            one, hull = self._one.of(some, lines, first[1], near)
        few, many, around = (one, two, hull) if first[0] is small else (two, one, near)
        if not len(few.some) or not len(many.some):
            return np.zeros((0, 2), np.int32)
        around = np.stack([around[:, 0].min(axis=0), around[:, 1].max(axis=0)])
        table = self._buckets.sort(few.low, few.high, around, _edge(few, many))
        return self._overlaps.of(table, few, many, _ANY if rank is None else rank, lines.part, allowed)


def find(
    small: Primitives, large: Primitives, x: Floats, v: Floats, part: Indices, allowed: Flags, horizon: float,
    rank: Ints | None, finder: Finder | None = None,
) -> Indices:  # fmt: skip
    """(pairs, 2) candidates: row of the small primitive, and row of the large primitive.

    ``x``, ``v``, ``part``: position (nodes, 3), velocity less the mean velocity (nodes, 3), and part (nodes,) of each
    node. ``allowed`` (parts, parts): pairs of parts that may be in contact. Two primitives with a common corner are not
    candidates. ``rank`` (large,): if given, the small primitives are the first rows of the large primitives, and a pair
    is found only from its primitive of lower rank. ``finder``: passes of the search; None for one thread.
    """
    return (finder or Finder(team(1))).find(small, large, Lines(x, v, horizon, part), allowed, rank)


def _edge(small: Sought, large: Sought) -> float:
    """Edge length of the cells, m."""
    edge = max(_extent(small.low, small.high), _extent(large.low, large.high))
    return 2.0 * edge if _FEW * len(small.some) < len(large.some) else float(edge)


@njit("float64(float64[:, ::1], float64[:, ::1])", cache=True)
def _extent(low, high):  # type: ignore[no-untyped-def]
    """Median of the longest sides of the boxes, computed from a sample, m."""
    step = max(len(low) // _SAMPLE, 1)
    sides = np.empty(-(-len(low) // step))
    for k in range(len(sides)):
        sides[k] = 0.0
        for i in range(3):
            sides[k] = max(sides[k], high[k * step, i] - low[k * step, i])
    return np.sort(sides)[len(sides) // 2]
