"""How fast simulated time passes."""


class Pace:
    """Simulated seconds per second of wall time, as a mean that forgets over some ten reports."""

    def __init__(self, t: float, began: float) -> None:
        self._last = (t, began)
        self._rate: float | None = None

    def add(self, t: float, now: float) -> None:
        """Notes that time ``t`` was reached at wall time ``now``."""
        rate = (t - self._last[0]) / (now - self._last[1])
        self._rate = rate if self._rate is None else 0.9 * self._rate + 0.1 * rate
        self._last = (t, now)

    def left(self, t: float) -> float:
        """Wall time for another ``t``, s."""
        return t / self._rate if self._rate else 0.0
