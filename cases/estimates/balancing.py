"""Load balance: the criteria that decide when the mesh is divided among the ranks again (a new decomposition). A run
uses them, and so does the replay of the recorded loads of a run.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from ..model.schema import Balance

WORK = ("elements", "nodes", "contact", "fracture")
"""Phases of a time step that count as work of a rank. In all other phases a rank waits or writes files."""
MOVED = ("elements", "nodes", "contact")
"""Phases whose work moves to another rank together with the tets. The phase ``fracture`` is absent: its cost is a fixed
cost on every rank on which a facet breaks, for any number of broken facets."""


def lost(loads: Sequence[float]) -> float:
    """Returns the load of the most loaded rank minus the mean load, in the unit of ``loads``."""
    return max(loads) - sum(loads) / len(loads)


def imbalance(loads: Sequence[float]) -> float:
    """Returns the largest load of a rank divided by the mean load."""
    mean = sum(loads) / len(loads)
    return max(loads) / mean if mean > 0.0 else 1.0


@dataclass
class Guard:
    """The criterion ``outside``: the number of outside nodes (nodes on the surface) of each rank, compared with the
    number after the last decomposition (fig. 9 of the paper of Moon, Kim and Lee).
    """

    alpha: float
    at_cut: int | None = None

    def grown(self, outside: int) -> bool:
        """Whether the number of ``outside`` nodes of a rank has grown beyond the limit since the last decomposition."""
        if self.at_cut is None:
            self.at_cut = outside
        return outside > self.alpha * self.at_cut


_MOMENTS = 32
"""Largest number of stored times of one interval between decompositions (chosen value)."""


@dataclass
class Stretch:
    """The work of each rank since the last decomposition."""

    _moments: list[tuple[int, list[float]]] = field(default_factory=list)
    """Stored times since the decomposition: for each, the number of steps since the decomposition, and the CPU time of
    each rank since then, s."""
    _apart: float = 0.0
    """Smallest number of steps between two stored times; only the last time may be closer."""

    def add(self, loads: Sequence[float], steps: int) -> None:
        """Adds ``steps`` steps in which each rank has worked ``loads``, s per step."""
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
        """CPU time of each rank since the last decomposition, s. In this sum a wait counts only if one rank has had
        more work than the others over all steps.
        """
        return self._moments[-1][1] if self._moments else []

    @property
    def halves(self) -> tuple[float, float]:
        """Returns the imbalance (largest work divided by mean work) in the first half of the steps since the
        decomposition, and that in the second half.
        """
        if not self._moments:
            return 1.0, 1.0
        half, moments = 0.5 * self.steps, [(0, [0.0] * len(self.work)), *self._moments]
        before, after = next(pair for pair in pairwise(moments) if pair[1][0] >= half)
        share = (half - before[0]) / (after[0] - before[0])
        first = [a + share * (b - a) for a, b in zip(before[1], after[1], strict=True)]
        return imbalance(first), imbalance([whole - part for whole, part in zip(self.work, first, strict=True)])


@dataclass
class Trigger:
    """The decision about a new decomposition by the policy of the case; all ranks make the same decision."""

    spec: Balance
    cost: float
    """Wall time of the last decomposition, s; before the first decomposition, the time of a comparable operation."""
    step: int = 0
    """Number of the time step at which the mesh was last decomposed."""
    stretch: Stretch = field(default_factory=Stretch)
    """Work of each rank since the last decomposition."""
    fruitless: int = 0
    """Number of decompositions in a row that have saved less time than they cost. Each of them doubles the lost time
    from which on the mesh is decomposed again."""

    def look(self, loads: Sequence[float], steps: int) -> None:
        """Adds ``steps`` steps in which each rank has worked ``loads``, s per step."""
        self.stretch.add(loads, steps)

    @property
    def lost(self) -> float:
        """Time that the most loaded rank has worked beyond the mean of all ranks since the last decomposition, s."""
        return lost(self.stretch.work) if self.stretch.steps else 0.0

    @property
    def bearable(self) -> float:
        """Returns the lost time from which on the mesh is decomposed again, s."""
        return self.cost * 2.0**self.fruitless

    @property
    def half_way(self) -> bool:
        """Whether the lost time has reached half of the value from which on the mesh is decomposed again."""
        return self.lost > 0.5 * self.bearable

    def cause(self, step: int, grown: bool) -> str | None:
        """Returns the reason for a decomposition before time step ``step``; None for no decomposition. ``grown``:
        whether the number of outside nodes of a rank has grown beyond the limit of the policy ``outside``.
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
        """Resets the counters after a decomposition before time step ``step`` that took ``cost``, s. ``paid``: whether
        the decomposition before that one has saved its cost.
        """
        self.fruitless = 0 if paid else self.fruitless + 1
        self.step, self.cost, self.stretch = step, cost, Stretch()
