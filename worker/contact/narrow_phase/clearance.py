"""Clearance of a scene: a bound of the motion of its slots. While the motion is smaller, no candidate pair has to be
tested.

Every candidate pair has a bound (broad_phase/pairs.py). The pair is not tested while the sum of the distances of its
members from their short lines and of the relative motion of these lines is below the bound. After a step without active
contacts the clearance is computed: the smallest value over all pairs of the bound minus the relative motion up to a
time ``until``. Up to the time ``until`` no pair is tested while twice the largest distance of a slot from its short
line is below the clearance. The narrow phase is then only a comparison of two numbers. The answer does not depend on
the clearance.
"""

import math

import numpy as np

from ...kernels.jit import njit
from ...model.state import Ints
from ..broad_phase.pairs import PairTable
from ..broad_phase.reference_motion import ReferenceMotion
from ..scene.scene import Scene
from ..surface import normals

_STEPS = float(normals.EVERY)
"""Number of steps for which a clearance is computed. New short lines begin after normals.EVERY steps."""
_ROUNDING = 1e-9
"""Fraction of the size of a face that is subtracted for round-off."""
_NONE: Ints = np.zeros(0, np.int64)


class Clearance:
    """Clearance of the scene of a rank. A clearance is valid until pairs, faces or short lines change."""

    def __init__(self) -> None:
        self._scene: Scene | None = None
        self._until, self._width = -math.inf, 0.0

    def clear(self) -> None:
        """Marks the clearance as not valid."""
        self._scene = None

    def measure(self, now: Scene, dt: float, size: float) -> None:
        """Computes the clearance after a step in which the pairs of the scene ``now`` were tested. ``dt``: largest
        length of the next step, s; ``size``: size of a face, m.
        """
        self._scene, self._until = now, now.reference.end + _STEPS * dt
        width = min(_least(table.until, table.speed, self._until) for table in (now.node_face, now.edge_edge))
        self._width = width - _ROUNDING * size
        if self._width > 0.0:
            for table in (now.node_face, now.edge_edge):
                _none_tested(table)

    def holds(self, now: Scene) -> bool:
        """True if the clearance is valid for the scene ``now`` and for the present step."""
        reference = now.reference
        return now is self._scene and self._width > 0.0 and reference.end + reference.beyond <= self._until

    def exceeds(self, reference: ReferenceMotion) -> bool:
        """True if the clearance is so large that no pair must be tested in the step."""
        return bool(2.0 * reference.short.left.max(initial=0.0) < self._width)


def _none_tested(table: PairTable) -> None:
    table.take_tested(table.arrays().active, _NONE, _NONE)


@njit("float64(float64[::1], float64[::1], float64)", cache=True)
def _least(until, speed, end):  # type: ignore[no-untyped-def]
    """Smallest value over all pairs of bound minus relative motion, m; -1 if a pair must be tested before the time
    ``end``. ``until`` (p,): bounds of the pairs. The relative motion is that of the lines of a pair up to ``end``.
    """
    least = np.inf
    for p in range(len(until)):
        slack = until[p] - speed[p] * end
        if not slack > 0.0:
            return -1.0
        least = min(least, slack)
    return least
