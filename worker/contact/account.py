"""What contact has taken from the bodies, and so what it may give back by taking back penetrations."""

import numpy as np

from ..model.state import Ints
from ..parallel.fixed_point import Tally

_AHEAD = 2.0
"""How many times what one step has given back at most, so far, must be left for the next one."""


class Account:
    """Sums over all meetings, steps and ranks, as integers: no order and no cut changes a decision."""

    def __init__(self, energy: float) -> None:
        """``energy``: the order of magnitude of what one meeting takes in a step, J."""
        self._tally = Tally(np.full(2, energy))
        self._taken, self._early, self._most = 0.0, 0.0, 0.0

    @property
    def words(self) -> Ints:
        """(2, 2) limbs of the sums of this rank; see booking.cost."""
        return self._tally.words

    @property
    def scale(self) -> float:
        """Quanta of the high limb per joule."""
        return float(self._tally.scale[0])

    def carry(self) -> None:
        """Keeps the low limbs from wrapping; see Tally."""
        self._tally.carry()

    def settle(self, words: Ints) -> bool:
        """Whether contact may take penetrations back in the step ahead; ``words`` (2, 2): the sum of those of all
        ranks.

        It may while it has taken from the bodies what two steps can give back, each as much as any step so far.
        """
        taken, early = (float(v) for v in self._tally.valued(words))
        self._most = max(self._most, self._taken - taken, early - self._early)
        self._taken, self._early = taken, early
        return taken >= _AHEAD * self._most

    def known(self) -> tuple[float, float, float, float]:
        """What it remembers besides the words, equal on all ranks."""
        return self.scale, self._taken, self._early, self._most

    def resume(self, words: Ints, known: tuple[float, float, float, float]) -> None:
        """Takes it back."""
        scale, self._taken, self._early, self._most = known
        self._tally.words, self._tally.scale = words, np.full(2, scale)
