"""Account of the energy that contact has taken from the bodies. When contact corrects penetrations, it may return at
most this energy to the bodies.
"""

import numpy as np

from ..model.state import Ints
from ..parallel.fixed_point import Tally

_AHEAD = 2.0
"""Safety factor of the account. Penetrations are corrected only while the energy in the account exceeds the safety
factor times the largest energy that contact has returned in one step so far."""


class Account:
    """Sums over all contacts, steps and ranks. The sums are integers, so they do not depend on the order of summation
    and on the partition.
    """

    def __init__(self, energy: float) -> None:
        """``energy``: order of magnitude of the energy that one contact takes in a step, J."""
        self._tally = Tally(np.full(2, energy))
        self._taken, self._early, self._most = 0.0, 0.0, 0.0
        self._settled = b""
        """Words of the account at the last call of ``settle``."""

    @property
    def words(self) -> Ints:
        """(2, 2) low and high limbs of the sums of this rank; see impulse_work.cost."""
        return self._tally.words

    @property
    def scale(self) -> float:
        """Number of quanta of the high limb per joule."""
        return float(self._tally.scale[0])

    def carry(self) -> None:
        """Moves the overflow of the low limbs to the high limbs; see the class Tally."""
        self._tally.carry()

    def settle(self, words: Ints) -> bool:
        """Returns True if contact may correct penetrations in the next step. ``words`` (2, 2): sum of the words of all
        ranks.

        Correction is allowed while the energy taken from the bodies is at least ``_AHEAD`` times the largest energy
        returned in one step.
        """
        if (settled := words.tobytes()) != self._settled:
            taken, early = (float(v) for v in self._tally.valued(words))
            self._most = max(self._most, self._taken - taken, early - self._early)
            self._taken, self._early, self._settled = taken, early, settled
        return self._taken >= _AHEAD * self._most

    def known(self) -> tuple[float, float, float, float]:
        """Returns the values of the account except the words, for a parcel (a checkpoint or migration message). All
        ranks return equal values.
        """
        return self.scale, self._taken, self._early, self._most

    def resume(self, words: Ints, known: tuple[float, float, float, float]) -> None:
        """Restores the account from a parcel (a checkpoint or migration message)."""
        scale, self._taken, self._early, self._most = known
        self._tally.words, self._tally.scale = words, np.full(2, scale)
