"""Rate of a run: simulated time divided by wall time."""


class Pace:
    """Simulated seconds per second of wall time, as an exponential mean over about ten reports."""

    def __init__(self, t: float, began: float) -> None:
        self._last = (t, began)
        self._rate: float | None = None

    def add(self, t: float, now: float) -> None:
        """Adds a report to the mean: at the wall time ``now``, s, the simulated time was ``t``, s."""
        rate = (t - self._last[0]) / (now - self._last[1])
        self._rate = rate if self._rate is None else 0.9 * self._rate + 0.1 * rate
        self._last = (t, now)

    def left(self, t: float) -> float:
        """Returns the wall time, s, that the simulation of a further time ``t``, s, will take."""
        return t / self._rate if self._rate else 0.0
