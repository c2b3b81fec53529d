"""Points of rigid bodies to which tied bonds tie nodes, and norms of the tied rows.

If the mortar nodes of a tied row (bonds/rows.py) belong to a rigid body, the row constrains one point of that body,
which is the mean of the mortar nodes by the weights of the row. In the sweeps this point replaces the mortar nodes.
"""

from dataclasses import dataclass

import numpy as np

from ..model.state import Flags, Floats, Indices, Ints
from .bodies import Bodies


@dataclass
class Points:
    """Points of rigid bodies. A tied row has at most one point."""

    row: Ints
    """(k,) tied row of each point, ascending."""
    body: Indices
    """(k,) body of each point."""
    arm: Floats
    """(k, 3) vector from the centre of the body to each point, at the start, m."""

    @classmethod
    def none(cls) -> "Points":
        """Returns a table with no point."""
        return cls(np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros((0, 3)))

    def __len__(self) -> int:
        return len(self.row)

    def take(self, chosen: Flags) -> "Points":
        """Returns the points chosen by ``chosen``."""
        return Points(self.row[chosen], self.body[chosen], self.arm[chosen])

    def norms(self, bodies: Bodies) -> Floats:
        """(k,) bound of the contribution of the body to the l1 norm of each tied row, 1/kg.

        Row i of a point at the arm a and row k of a point at the arm b of the same body have the product delta_ik / M +
        ([a] Y [b])_ik, where Y is the inverse of the inertia. The sum of the magnitudes over all rows of the body is
        bounded by N / M + |a_l| T_m + |a_m| T_l, where T_j = sum_k |Y_jk| L_k, and L_k is the sum of |b_l| + |b_m| over
        the N points (i, l, m different). The inverse inertia Y and the arms are those at the start. The largest of the
        three bounds is valid in any orientation.
        """
        size, many = np.abs(self.arm), np.bincount(self.body, minlength=bodies.n)
        light = bodies.lightness.max(axis=1, initial=0.0)
        found = light[self.body] * many[self.body]
        moment = np.zeros((bodies.n, 3))
        for j in range(3):
            other = size[:, (j + 1) % 3] + size[:, (j + 2) % 3]
            lengths = np.bincount(self.body, other, bodies.n)
            moment += np.abs(_yielding(bodies)[:, :, j]) * lengths[:, None]
        turns = moment[self.body]
        parts = [size[:, m] * turns[:, k] + size[:, k] * turns[:, m] for m, k in ((1, 2), (2, 0), (0, 1))]
        return np.asarray(found + np.max(parts, axis=0, initial=0.0))


def _yielding(bodies: Bodies) -> Floats:
    """(b, 3, 3) inverse of the inertia at the start, 1/(kg m^2); zero for a body whose rotation is held."""
    found = np.zeros((bodies.n, 3, 3))
    for b in range(bodies.n):
        axes = np.flatnonzero(bodies.turns[b])
        if len(axes) == 3:
            found[b] = bodies.inverse[b]
        else:
            found[b, axes, axes] = 1.0 / bodies.inertia[b, axes, axes]
    return found
