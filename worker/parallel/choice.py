"""Choice of the number of threads that a rank uses. The chosen number is that with the shortest time in parallel
regions, measured over some steps.

A scene can be too small for several threads: it has few tasks, or a task takes as little time as its assignment to a
thread. If the chosen number is not the full number, it is measured again at intervals, because contact and cracks add
work. If the full number is chosen, no further measurement is made. The answer of the run does not depend on the number
of threads.
"""

import time

from conoid.cases.figures import fixed, si

from .projecting import Projecting
from .team import Team

_STEPS, _SECONDS = 10, 0.1
"""Length of a measurement, in steps and in s. The measurement ends at the limit that is reached first, but includes at
least one step. Chosen values."""
_AGAIN = 20.0
"""Interval between two measurements, s. Chosen value: a measurement takes less than a hundredth of the interval, unless
the steps are very long."""
_WORTH = 0.98
"""Largest ratio at which more threads are chosen: time in parallel regions with more threads, divided by the time with
fewer threads. Chosen value."""


class Choice:
    """Measures and sets the number of threads of a rank; it must be called once in each step."""

    def __init__(self, team: Team) -> None:
        self._team, self._reported = team, False
        self._steps, self._began, self._due = 0, 0.0, 0.0
        self._costs: Projecting | None = None

    @property
    def due(self) -> float:
        """Wall time before which no measurement begins, s; 0 while a measurement is made."""
        return self._due if self._team.projecting is None else 0.0

    def step(self) -> str:
        """Begin or end a measurement if its time has come. If fewer threads than given are used, return a message about
        this, once in a run.
        """
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
        if self._reported or not made.tasks:
            return ""
        self._reported = True
        task = made.spans[0] / made.tasks
        return (
            f"the scene is too small for {self._team.threads} threads; the run uses {best}. A colour has "
            f"{fixed(made.tasks / made.colours, 1)} tasks of {si(task, 's')}; the sharing of a colour "
            f"takes {si(1e-9 * made.costs.turn, 's')}, the waking of a thread {si(1e-9 * made.costs.wake, 's')}"
        )


def best_crew(crews: list[int], spans: list[float]) -> int:
    """Return the number of threads to use. ``spans``: time in parallel regions, s, for each number of threads in
    ``crews``; a crew is a possible number of threads.
    """
    best = 0
    for k in range(1, len(crews)):
        if spans[k] < _WORTH * spans[best]:
            best = k
    return crews[best]
