"""How many of its threads a rank uses: as many as make its regions shorter, by tasks that are timed for some steps.

A scene can be too small to be shared: tasks are few, or as short as it takes to hand one out. Few threads are tried
again now and then, since contact and cracks make work; all of them are kept. The answer is the same on any number.
"""

import time

from conoid.cases.figures import fixed, si

from .projecting import Projecting
from .team import Team

_STEPS, _SECONDS = 10, 0.1
"""Of a trial, whichever ends first: one step at least. Chosen."""
_AGAIN = 20.0
"""s between two trials. Chosen: a trial takes less than a hundredth of it, but of steps that take longer than that."""
_WORTH = 0.98
"""Of the time in regions: what more threads must come to."""


class Choice:
    """Asked once a step."""

    def __init__(self, team: Team) -> None:
        self._team, self._told = team, False
        self._steps, self._began, self._due = 0, 0.0, 0.0
        self._costs: Projecting | None = None

    def step(self) -> str:
        """Begins or ends a trial where that is due; once, what it says of threads that are not used."""
        trial, now = self._team.projecting, time.monotonic()
        if trial is None:
            if now >= self._due:
                self._begin(now)
            return ""
        self._steps += 1
        if self._steps < _STEPS and now < self._began + _SECONDS:
            return ""
        return self._end(now)

    def _begin(self, now: float) -> None:
        self._costs = Projecting(self._team.threads, self._costs.costs if self._costs is not None else None)
        self._team.projecting, self._steps, self._began = self._costs, 0, now

    def _end(self, now: float) -> str:
        made = self._costs
        assert made is not None
        self._team.projecting, self._due = None, now + _AGAIN
        best = best_crew(made.crews, made.spans)
        self._team.most = best
        if best == self._team.threads:
            self._due = float("inf")
            return ""
        if self._told or not made.tasks:
            return ""
        self._told = True
        task = made.spans[0] / made.tasks
        return (
            f"the scene is too small for {self._team.threads} threads and uses {best}. A colour has "
            f"{fixed(made.tasks / made.colours, 1)} tasks of {si(task, 's')}, and to share one costs "
            f"{si(1e-9 * made.costs.turn, 's')}, to wake a thread {si(1e-9 * made.costs.wake, 's')}"
        )


def best_crew(crews: list[int], spans: list[float]) -> int:
    """Threads of the crew that is taken; a larger one has to be faster by what it is worth."""
    best = 0
    for k in range(1, len(crews)):
        if spans[k] < _WORTH * spans[best]:
            best = k
    return crews[best]
