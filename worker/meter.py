"""What tets, candidates and ranks cost: CPU seconds of this run."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from conoid.cases.balancing import WORK

from .simulation import Simulation
from .state import Floats

_KEPT = 0.99
"""Of what earlier looks have said of the slope, with each further one."""
_LEAST = 0.02
"""Of the mean cost of a candidate: what one costs at least."""
_FARTHEST = 4.0
"""Times the mean, or one over it: what candidates of one rank cost at most, and at least."""


@dataclass
class Slope:
    """Which share of the work goes with the candidates: by comparing ranks that have more of them and fewer.

    The rest of what contact and fracture take is the same on every rank, however much it has to do: no cut moves that.
    Both are taken by their means, so that what has been seen holds on when all of it grows.
    """

    both: float = 0.0
    squares: float = 0.0

    def add(self, effort: Floats, seconds: Floats) -> None:
        """Takes what ranks had and took (ranks,) over the same steps."""
        if not (effort.any() and seconds.any()):
            return
        effort, seconds = effort / effort.mean() - 1.0, seconds / seconds.mean() - 1.0
        self.both = _KEPT * self.both + float(effort @ seconds)
        self.squares = _KEPT * self.squares + float(effort @ effort)

    def of(self, mean: float) -> float:
        """Cost of a candidate, where all work over all candidates is ``mean``; that itself when ranks do not differ."""
        return mean * min(max(self.both / self.squares, _LEAST), 1.0) if self.squares > 0.0 else mean


@dataclass(frozen=True)
class Costs:
    """CPU seconds a step."""

    tet: Floats
    """(parts,) of a tet."""
    candidate: float
    """Of one of this rank: candidates differ, and what they have cost in a place is the best guess for it."""
    rank: float
    """Of a rank, whatever it has to do."""
    around: Floats
    """(ranks, 2) candidates of each, and what contact and fracture took there."""


@dataclass
class Meter:
    """Measures costs since it was set."""

    slope: Slope
    step: int
    seconds: dict[str, float]
    """The timers when it was set."""
    on_parts: Floats
    """(parts,) CPU time of the passes over the tets by then, s."""

    @classmethod
    def of(cls, sim: Simulation, slope: Slope) -> Self:
        """Set at the present."""
        return cls(slope, sim.clock.step, dict(sim.timers.seconds), _on_parts(sim))

    def costs(self, sim: Simulation, effort: float) -> Costs:
        """What things cost when this rank has ``effort`` candidates; all ranks take part."""
        tets, steps = np.zeros(len(self.on_parts)), max(sim.clock.step - self.step, 1)
        for block in sim.model.blocks:
            tets[block.part] = block.n
        spent = {name: (sim.timers.seconds[name] - self.seconds[name]) / steps for name in WORK}
        around = [spent["nodes"], effort, spent["contact"] + spent["fracture"]]
        mine = np.concatenate([(_on_parts(sim) - self.on_parts) / steps, tets, around])
        ranks = np.array(sim.comm.share(mine))
        (on_tets, tets), on_nodes = ranks[:, :-3].sum(axis=0).reshape(2, -1), float(ranks[:, -3].sum())
        had, took = ranks[:, -2:].T
        candidate = self._candidates(had, took)
        rank = float(took.sum() - candidate @ had) / len(ranks)
        per_tet = on_tets / np.maximum(tets, 1.0) + on_nodes / max(float(tets.sum()), 1.0)
        return Costs(per_tet, float(candidate[sim.comm.rank]), rank, ranks[:, -2:])

    def _candidates(self, effort: Floats, seconds: Floats) -> Floats:
        """(ranks,) cost of a candidate of each, by what ranks had and took (ranks,)."""
        mean = self.slope.of(float(seconds.sum() / max(effort.sum(), 1.0)))
        rank = float(seconds.sum() - mean * effort.sum()) / len(effort)
        return np.asarray(np.clip((seconds - rank) / np.maximum(effort, 1.0), mean / _FARTHEST, mean * _FARTHEST))


def _on_parts(sim: Simulation) -> Floats:
    seconds = np.zeros(len(sim.model.parts))
    for block in sim.model.blocks:
        seconds[block.part] = block.seconds
    return seconds
