"""Core-seconds that each owner has used. Past usage counts half after each half-life."""

from collections.abc import Iterable
from typing import NamedTuple


class Took(NamedTuple):
    """Use of cores by one run: number of cores, start and end (Unix times in s)."""

    owner: str
    cores: int
    started: float
    finished: float


class Usage:
    """Core-seconds by owner. The class is used in the supervisor's thread; the method ``of`` may be called from any
    thread.
    """

    def __init__(self, half_life: float) -> None:
        """Creates the object without any usage. ``half_life``: s."""
        self._half_life = half_life
        self._taken: dict[str, tuple[float, float]] = {}

    def begin(self, known: Iterable[Took]) -> None:
        """Adds the usage of earlier runs, in any order."""
        for took in sorted(known, key=lambda took: took.finished):
            self.add(took)

    def add(self, took: Took) -> None:
        """Adds the usage of a run that has released its cores."""
        seconds = took.cores * max(0.0, took.finished - took.started)
        self._taken[took.owner] = (self.of(took.owner, took.finished) + seconds, took.finished)

    def of(self, owner: str, now: float) -> float:
        """Returns the core-seconds of an owner, reduced by their age, at the Unix time ``now``, s."""
        taken, at = self._taken.get(owner, (0.0, now))
        return float(taken * 0.5 ** (max(0.0, now - at) / self._half_life))

    def all(self, now: float) -> dict[str, float]:
        """Returns the core-seconds of every owner, reduced by their age."""
        return {owner: self.of(owner, now) for owner in tuple(self._taken)}
