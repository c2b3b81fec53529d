"""CPU seconds of things that take turns: A B A B, so that a noisy neighbour disturbs them alike."""

import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass

Work = Callable[[], float]
"""Does a fixed amount of work and returns the CPU seconds that it took, by the clock of whoever did it."""


@dataclass(frozen=True)
class Times:
    """CPU seconds of the same work, repeated."""

    seconds: tuple[float, ...]

    @property
    def best(self) -> float:
        """The fastest: what the machine can do when nobody disturbs."""
        return min(self.seconds)

    @property
    def median(self) -> float:
        """The middle one."""
        return statistics.median(self.seconds)

    @property
    def spread(self) -> float:
        """(slowest - fastest) / median."""
        return (max(self.seconds) - min(self.seconds)) / self.median


def take_turns(work: Mapping[str, Work], rounds: int) -> dict[str, Times]:
    """Every work ``rounds`` times, in turns; the first round warms caches and is not counted."""
    seconds: dict[str, list[float]] = {name: [] for name in work}
    for turn in range(rounds + 1):
        for name, do in work.items():
            spent = do()
            if turn:
                seconds[name].append(spent)
    return {name: Times(tuple(values)) for name, values in seconds.items()}
