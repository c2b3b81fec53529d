"""Who has taken how much: core-seconds by owner, of which half is forgotten after each half-life."""

from collections.abc import Iterable
from typing import NamedTuple


class Took(NamedTuple):
    """What one run has taken; times are Unix s."""

    owner: str
    cores: int
    started: float
    finished: float


class Usage:
    """Belongs to the supervisor's thread; ``of`` may be asked from any."""

    def __init__(self, half_life: float) -> None:
        """Nobody has taken anything. ``half_life`` in s."""
        self._half_life = half_life
        self._taken: dict[str, tuple[float, float]] = {}

    def begin(self, known: Iterable[Took]) -> None:
        """What is known of earlier runs, in whatever order."""
        for took in sorted(known, key=lambda took: took.finished):
            self.add(took)

    def add(self, took: Took) -> None:
        """A run has given its cores back."""
        seconds = took.cores * max(0.0, took.finished - took.started)
        self._taken[took.owner] = (self.of(took.owner, took.finished) + seconds, took.finished)

    def of(self, owner: str, now: float) -> float:
        """Core-seconds that count at the Unix time ``now``."""
        taken, at = self._taken.get(owner, (0.0, now))
        return float(taken * 0.5 ** (max(0.0, now - at) / self._half_life))

    def all(self, now: float) -> dict[str, float]:
        """Of every owner."""
        return {owner: self.of(owner, now) for owner in tuple(self._taken)}
