"""When to cut a mesh anew for its ranks: the rules by which a run decides, and its replay under another policy."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from ..model.schema import Balance

WORK = ("elements", "nodes", "contact", "fracture")
"""Phases of a step that ranks share; the others wait or write."""
MOVED = ("elements", "nodes", "contact")
"""Those whose work goes where tets go. Fracture is many small things on every rank that has a facet to break, however
many break there.
"""


def lost(loads: Sequence[float]) -> float:
    """How much longer the most loaded rank takes than it would with equal loads."""
    return max(loads) - sum(loads) / len(loads)


def imbalance(loads: Sequence[float]) -> float:
    """Largest load over the mean."""
    mean = sum(loads) / len(loads)
    return max(loads) / mean if mean > 0.0 else 1.0


@dataclass
class Guard:
    """The outside nodes of one rank against those that it had at the last cut (the paper's trigger, its fig. 9)."""

    alpha: float
    at_cut: int | None = None

    def grown(self, outside: int) -> bool:
        """Whether a rank that has so many ``outside`` nodes has more than it may."""
        if self.at_cut is None:
            self.at_cut = outside
        return outside > self.alpha * self.at_cut


_MOMENTS = 32
"""So many moments of a stretch of steps are remembered, at most. Chosen."""


@dataclass
class Stretch:
    """The work of each rank since the last cut."""

    _moments: list[tuple[int, list[float]]] = field(default_factory=list)
    """Steps and work of each rank, s, from the cut up to the end of each of some windows."""
    _apart: float = 0.0
    """Steps between two of them, but for the last."""

    def add(self, loads: Sequence[float], steps: int) -> None:
        """Takes the ``loads`` of all ranks, s a step, over some steps."""
        before = self.work or [0.0] * len(loads)
        now = self.steps + steps, [w + steps * load for w, load in zip(before, loads, strict=True)]
        if len(self._moments) > 1 and self.steps - self._moments[-2][0] < self._apart:
            self._moments.pop()
        self._moments.append(now)
        if len(self._moments) > _MOMENTS:
            self._moments, self._apart = self._moments[::2], 2.0 * self.steps / _MOMENTS

    @property
    def steps(self) -> int:
        """How many."""
        return self._moments[-1][0] if self._moments else 0

    @property
    def work(self) -> list[float]:
        """Of each rank, s; what ranks lose to each other in turn no cut would mend."""
        return self._moments[-1][1] if self._moments else []

    @property
    def halves(self) -> tuple[float, float]:
        """The imbalance of the first half of the steps, and of what came after it."""
        if not self._moments:
            return 1.0, 1.0
        half, moments = 0.5 * self.steps, [(0, [0.0] * len(self.work)), *self._moments]
        before, after = next(pair for pair in pairwise(moments) if pair[1][0] >= half)
        share = (half - before[0]) / (after[0] - before[0])
        first = [a + share * (b - a) for a, b in zip(before[1], after[1], strict=True)]
        return imbalance(first), imbalance([whole - part for whole, part in zip(self.work, first, strict=True)])


@dataclass
class Trigger:
    """Whether a cut is due, by the policy of a case; the same on all ranks."""

    spec: Balance
    cost: float
    """Of the last cut, s; at first of what takes as long."""
    step: int = 0
    """Of the last cut."""
    stretch: Stretch = field(default_factory=Stretch)
    """Since then."""
    fruitless: int = 0
    """Cuts in a row that saved less than they cost: each doubles what has to be lost before the next."""

    def look(self, loads: Sequence[float], steps: int) -> None:
        """Takes the ``loads`` of all ranks, s a step, over some steps."""
        self.stretch.add(loads, steps)

    @property
    def lost(self) -> float:
        """To imbalance since the last cut, s."""
        return lost(self.stretch.work) if self.stretch.steps else 0.0

    @property
    def bearable(self) -> float:
        """What may be lost before the next cut, s."""
        return self.cost * 2.0**self.fruitless

    @property
    def half_way(self) -> bool:
        """Whether half of that is."""
        return self.lost > 0.5 * self.bearable

    def cause(self, step: int, grown: bool) -> str | None:
        """Why to cut before ``step``, if so; ``grown``: whether a rank has more outside nodes than it may."""
        spec = self.spec
        if spec.policy == "never" or step == self.step:
            return None
        if spec.policy == "every":
            return f"every {spec.every} steps" if step % spec.every == 0 else None
        if spec.policy == "outside":
            return f"a rank has {spec.alpha:g} times its outside nodes" if grown else None
        return "time lost exceeds the cost" if self.lost > self.bearable else None

    def settle(self, step: int, cost: float, paid: bool = True) -> None:
        """Begins to count anew after a cut before ``step`` that took ``cost``, s; ``paid``: whether the one before
        has saved what it cost.
        """
        self.fruitless = 0 if paid else self.fruitless + 1
        self.step, self.cost, self.stretch = step, cost, Stretch()
