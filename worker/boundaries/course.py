"""Factor of a prescribed motion or a load as a function of time."""

from collections.abc import Sequence

import numpy as np


class Course:
    """Factor of a load as a function of time. The factor is linear between the given ``points`` (time, s, and factor),
    and constant before the first and after the last point. Without points the factor is 1.
    """

    def __init__(self, points: Sequence[tuple[float, float]] = ()) -> None:
        self._times, self._factors = np.array(list(points) or [(0.0, 1.0)]).T
        self.constant = float(self._factors[0]) if len(self._factors) == 1 else None
        """Value of the factor if it is constant, else None."""
        self.largest = float(np.abs(self._factors).max())
        """Largest absolute value of the factor."""

    def mean(self, begin: float, end: float) -> float:
        """Returns the exact mean of the factor between two times, s. If the two times are equal, the result is the
        factor at that time.
        """
        if self.constant is not None:
            return self.constant
        within = self._times[(self._times > begin) & (self._times < end)]
        times = np.array([begin, *within, end])
        values = np.interp(times, self._times, self._factors)
        if end <= begin or (values == values[0]).all():
            return float(values[0])
        return float((0.5 * np.diff(times) * (values[1:] + values[:-1])).sum() / (end - begin))
