"""Number of sweeps in a step, which is adapted to the residual of the previous step."""

import numpy as np

from conoid.cases.estimates.impact import Sweeps

from ...model.state import Ints

_SETTLED = 0.0015
"""Target of the residual. The residual is the change of the impulses by the last sweep, divided by the impulses of the
step. Chosen value: rubble between a ram and walls is as stiff as with many more sweeps (docs/theory/contact.md, "Sweeps
by need"). Metals are below the target with the smallest number of sweeps."""
_ENOUGH = 0.5
"""Fraction of the target. If the residual is below this fraction of the target, the number of sweeps is reduced by
one."""
_MORE = 4
"""Inverse of the fraction by which the number of sweeps is increased in a step."""
_WARNED = 2.0
"""Multiple of _SETTLED. If the mean residual of the run is above this multiple, the run gives a warning. Chosen
value."""


class SweepCount:
    """Number of sweeps in a step, determined by integer sums over all nodes, and therefore equal for any number of
    ranks.
    """

    def __init__(self, bounds: Sweeps) -> None:
        self._bounds = bounds
        self.sweeps = bounds.least
        """Number of sweeps in the next step."""
        self.unsettled: Ints = np.zeros(2, np.int64)
        """(2,) l1 norms over the nodes that this rank owns, in units of 2^16 quanta: of the changes of impulses by the
        last sweep of the step, and of the impulses of the step."""
        self._changed, self._impulse = 0, 0

    def known(self) -> tuple[int, int, int]:
        """Returns the state for a checkpoint. All ranks return equal values."""
        return self.sweeps, self._changed, self._impulse

    def resume(self, known: tuple[int, int, int]) -> None:
        """Restores the state from a checkpoint."""
        self.sweeps, self._changed, self._impulse = known

    @property
    def warnings(self) -> list[str]:
        """Returns a warning if the residual of the run is above the limit."""
        if not self._changed > _WARNED * _SETTLED * self._impulse:
            return []
        left, limit = 100.0 * self._changed / self._impulse, 100.0 * _WARNED * _SETTLED
        advice = "leave contact.sweeps out, or raise it" if self._given else "compare with contact.sweeps = 100"
        return [
            f"the last sweep of contact in a step has still changed its impulses by {left:.2g} % in the mean, above "
            f"{limit:.2g} %: bodies that press on each other may be too soft; {advice}"
        ]

    @property
    def _given(self) -> bool:
        return self._bounds.least == self._bounds.most

    def agree(self, unsettled: Ints) -> None:
        """Adapts the number of sweeps to the residual. ``unsettled`` (2,): sums over all ranks."""
        changed, impulse = (int(word) for word in unsettled)
        self._changed, self._impulse = self._changed + changed, self._impulse + impulse
        if changed > _SETTLED * impulse:
            self.sweeps = min(self.sweeps + max(1, self.sweeps // _MORE), self._bounds.most)
        elif changed < _ENOUGH * _SETTLED * impulse:
            self.sweeps = max(self.sweeps - 1, self._bounds.least)
