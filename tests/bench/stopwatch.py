"""CPU times of programs that run in alternation, A B A B, so that other load affects both programs in the same way."""

import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass

Work = Callable[[], float]
"""Function with a fixed amount of work that returns its CPU time, s."""


@dataclass(frozen=True)
class Times:
    """CPU times of repetitions of the same work, s."""

    seconds: tuple[float, ...]

    @property
    def best(self) -> float:
        """Shortest time, which other load affects least."""
        return min(self.seconds)

    @property
    def median(self) -> float:
        """Median time."""
        return statistics.median(self.seconds)

    @property
    def spread(self) -> float:
        """Scatter of the times: (slowest - fastest) / median."""
        return (max(self.seconds) - min(self.seconds)) / self.median


def take_turns(work: Mapping[str, Work], rounds: int) -> dict[str, Times]:
    """Runs each function ``rounds`` times in alternation. An additional first round fills the caches and is not
    counted.
    """
    seconds: dict[str, list[float]] = {name: [] for name in work}
    for turn in range(rounds + 1):
        for name, do in work.items():
            spent = do()
            if turn:
                seconds[name].append(spent)
    return {name: Times(tuple(values)) for name, values in seconds.items()}
