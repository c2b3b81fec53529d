"""How many sweeps the contacts of a step get: as many as those of the step before needed."""

import numpy as np

from conoid.cases.estimates.impact import Sweeps

from ...model.state import Ints

_SETTLED = 0.0015
"""Of the impulses of a step, the most that its last sweep may have changed them by. Chosen by rubble between a ram and
walls, which is as stiff then as with many more sweeps (docs/theory/contact.md, "Sweeps by need"); metals have less
with the fewest."""
_ENOUGH = 0.5
"""Of that: with less, a sweep fewer does."""
_MORE = 4
"""One over the share by which sweeps grow in a step."""
_TOLD = 2.0
"""Times _SETTLED, what was left of all impulses of the run, from which on there is a warning. Chosen."""


class SweepCount:
    """Decided by sums over all nodes as integers, so alike on any number of ranks."""

    def __init__(self, bounds: Sweeps) -> None:
        self._bounds = bounds
        self.sweeps = bounds.least
        """Of the step ahead."""
        self.unsettled: Ints = np.zeros(2, np.int64)
        """(2,) l1 norms over the nodes that this rank owns of what the last sweep of the step has changed, and of the
        impulses of the step; in units of 2^16 quanta.
        """
        self._changed, self._impulse = 0, 0

    def known(self) -> tuple[int, int, int]:
        """All of it, equal on all ranks."""
        return self.sweeps, self._changed, self._impulse

    def resume(self, known: tuple[int, int, int]) -> None:
        """Takes it back."""
        self.sweeps, self._changed, self._impulse = known

    @property
    def warnings(self) -> list[str]:
        """One line, if sweeps have left too much."""
        if not self._changed > _TOLD * _SETTLED * self._impulse:
            return []
        left, limit = 100.0 * self._changed / self._impulse, 100.0 * _TOLD * _SETTLED
        advice = "leave contact.sweeps out, or raise it" if self._given else "compare with contact.sweeps = 100"
        return [
            f"the last sweep of contact in a step has still changed its impulses by {left:.2g} % in the mean, above "
            f"{limit:.2g} %: what presses on each other may be too soft; {advice}"
        ]

    @property
    def _given(self) -> bool:
        return self._bounds.least == self._bounds.most

    def agree(self, unsettled: Ints) -> None:
        """Takes what is ``unsettled`` on all ranks, the sum."""
        changed, impulse = (int(word) for word in unsettled)
        self._changed, self._impulse = self._changed + changed, self._impulse + impulse
        if changed > _SETTLED * impulse:
            self.sweeps = min(self.sweeps + max(1, self.sweeps // _MORE), self._bounds.most)
        elif changed < _ENOUGH * _SETTLED * impulse:
            self.sweeps = max(self.sweeps - 1, self._bounds.least)
