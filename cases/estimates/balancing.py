"""Load balance: the criteria for a new decomposition of the mesh, used by a run and by the replay of the loads of a
run.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from ..model.schema import Balance

WORK = ("elements", "nodes", "contact", "fracture")
"""Phases of a step whose work is distributed over the ranks; all other phases wait or write."""
MOVED = ("elements", "nodes", "contact")
"""Phases whose work moves with the tets. Fracture is not among these phases: it consists of many small tasks on every
rank that has a facet to break, for any number of such facets."""


def lost(loads: Sequence[float]) -> float:
    """Returns the time of the most loaded rank in excess of the mean time of all ranks."""
    return max(loads) - sum(loads) / len(loads)


def imbalance(loads: Sequence[float]) -> float:
    """Returns the largest load of a rank divided by the mean load."""
    mean = sum(loads) / len(loads)
    return max(loads) / mean if mean > 0.0 else 1.0


@dataclass
class Guard:
    """Number of outside nodes of each rank, compared with the number at the last decomposition (the paper's criterion,
    its fig. 9).
    """

    alpha: float
    at_cut: int | None = None

    def grown(self, outside: int) -> bool:
        """Whether the number of ``outside`` nodes of a rank has grown beyond the limit since the last decomposition."""
        if self.at_cut is None:
            self.at_cut = outside
        return outside > self.alpha * self.at_cut


_MOMENTS = 32
"""Largest number of stored times for which the work since a decomposition is recorded (chosen value)."""


@dataclass
class Stretch:
    """The work of each rank since the last decomposition."""

    _moments: list[tuple[int, list[float]]] = field(default_factory=list)
    """Time windows that begin at the decomposition; for each window the steps, and the work of each rank, s."""
    _apart: float = 0.0
    """Number of steps between two stored times, except the last time."""

    def add(self, loads: Sequence[float], steps: int) -> None:
        """Adds the ``loads`` of all ranks, s per step, over some steps."""
        before = self.work or [0.0] * len(loads)
        now = self.steps + steps, [w + steps * load for w, load in zip(before, loads, strict=True)]
        if len(self._moments) > 1 and self.steps - self._moments[-2][0] < self._apart:
            self._moments.pop()
        self._moments.append(now)
        if len(self._moments) > _MOMENTS:
            self._moments, self._apart = self._moments[::2], 2.0 * self.steps / _MOMENTS

    @property
    def steps(self) -> int:
        """Number of steps since the last decomposition."""
        return self._moments[-1][0] if self._moments else 0

    @property
    def work(self) -> list[float]:
        """CPU time of each rank since the last decomposition, s. Waiting that alternates between ranks is not counted
        as imbalance.
        """
        return self._moments[-1][1] if self._moments else []

    @property
    def halves(self) -> tuple[float, float]:
        """Returns the imbalance in the first half of the steps, and the imbalance in the second half."""
        if not self._moments:
            return 1.0, 1.0
        half, moments = 0.5 * self.steps, [(0, [0.0] * len(self.work)), *self._moments]
        before, after = next(pair for pair in pairwise(moments) if pair[1][0] >= half)
        share = (half - before[0]) / (after[0] - before[0])
        first = [a + share * (b - a) for a, b in zip(before[1], after[1], strict=True)]
        return imbalance(first), imbalance([whole - part for whole, part in zip(self.work, first, strict=True)])


@dataclass
class Trigger:
    """The decision for a new decomposition, by the policy of a case; all ranks reach the same decision."""

    spec: Balance
    cost: float
    """Cost of the last decomposition, s; before the first decomposition, the cost of a comparable operation."""
    step: int = 0
    """Number of the time step at which the mesh was last decomposed."""
    stretch: Stretch = field(default_factory=Stretch)
    """Work of each rank since the last decomposition."""
    fruitless: int = 0
    """Number of consecutive decompositions that saved less time than they cost. Each decomposition that saves less than
    it costs doubles the lost time that triggers the next decomposition."""

    def look(self, loads: Sequence[float], steps: int) -> None:
        """Adds the ``loads`` of all ranks, s per step, over some steps."""
        self.stretch.add(loads, steps)

    @property
    def lost(self) -> float:
        """Time lost by imbalance since the last decomposition, s."""
        return lost(self.stretch.work) if self.stretch.steps else 0.0

    @property
    def bearable(self) -> float:
        """Returns the lost time that triggers the next decomposition, s."""
        return self.cost * 2.0**self.fruitless

    @property
    def half_way(self) -> bool:
        """Whether half of the lost time that triggers a decomposition is reached."""
        return self.lost > 0.5 * self.bearable

    def cause(self, step: int, grown: bool) -> str | None:
        """Returns the reason for a decomposition before ``step``; empty for no decomposition. ``grown``: whether the
        outside nodes of a rank have grown beyond the limit.
        """
        spec = self.spec
        if spec.policy == "never" or step == self.step:
            return None
        if spec.policy == "every":
            return f"every {spec.every} steps" if step % spec.every == 0 else None
        if spec.policy == "outside":
            return f"a rank has {spec.alpha:g} times its outside nodes" if grown else None
        return "time lost exceeds the cost" if self.lost > self.bearable else None

    def settle(self, step: int, cost: float, paid: bool = True) -> None:
        """Resets the counters after a decomposition before ``step`` that took ``cost``, s. ``paid``: whether the
        previous decomposition has saved its cost.
        """
        self.fruitless = 0 if paid else self.fruitless + 1
        self.step, self.cost, self.stretch = step, cost, Stretch()
