"""How many sweeps a step makes of its active contacts: as many as the one before has left undone."""

TOLERANCE = 1e-3
"""Of the typical size of a face: a step that leaves a contact deeper than it may be by more than this calls for twice
as many sweeps in the next one."""
_SPARE = 0.25
"""Of that: a step that leaves less than this lets the next one do with half as many."""
_MOST = 4
"""Times the sweeps of the case: the most that a step makes."""


class Effort:
    """The sweeps of the next step; they follow from what all ranks have agreed on alone, and are the same on each."""

    def __init__(self, least: int) -> None:
        """``least``: of any step."""
        self._least = self.sweeps = least
        self.left = 0.0
        """What the last step left on this rank, of the typical size of a face."""

    def settle(self, short: float) -> None:
        """After a step that left a contact of any rank ``short`` of where it must be, of the typical size of a face."""
        if short > TOLERANCE:
            self.sweeps = min(2 * self.sweeps, _MOST * self._least)
        elif short < _SPARE * TOLERANCE:
            self.sweeps = max(self.sweeps // 2, self._least)
