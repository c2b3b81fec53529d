"""What tets, candidates and ranks cost: CPU seconds of this run."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from conoid.cases.estimates.balancing import WORK

from ..model.state import Floats
from ..simulation import Simulation

_FARTHEST = 4.0
"""Times the mean, or one over it: what candidates of one rank cost at most, and at least. Chosen: a rank
with few candidates measures mostly noise."""


@dataclass(frozen=True)
class Costs:
    """CPU seconds a step."""

    tet: Floats
    """(parts,) of a tet."""
    candidate: float
    """Of one of this rank: candidates differ, and what they have cost in a place is the best guess for it."""
    fracture: float
    """Of all fracture on this rank."""
    rank: float
    """What is left, of each rank."""


@dataclass
class Meter:
    """Measures costs since it was set."""

    step: int
    seconds: dict[str, float]
    """The timers when it was set."""
    on_parts: Floats
    """(parts,) CPU time of the passes over the tets by then, s."""

    @classmethod
    def of(cls, sim: Simulation) -> Self:
        """Set at the present."""
        return cls(sim.clock.step, dict(sim.timers.seconds), on_parts(sim))

    def costs(self, sim: Simulation, effort: float) -> Costs:
        """What things cost when this rank has ``effort`` candidates; all ranks take part."""
        tets, steps = np.zeros(len(self.on_parts)), max(sim.clock.step - self.step, 1)
        for block in sim.model.blocks:
            tets[block.part] = block.n
        spent = {name: (sim.timers.seconds[name] - self.seconds[name]) / steps for name in WORK}
        around = [spent["nodes"], effort, spent["contact"]]
        mine = np.concatenate([(on_parts(sim) - self.on_parts) / steps, tets, around])
        ranks = np.array(sim.comm.share(mine))
        (on_tets, tets), on_nodes = ranks[:, :-3].sum(axis=0).reshape(2, -1), float(ranks[:, -3].sum())
        had, took = ranks[:, -2:].T
        candidate = _candidates(had, took)
        rank = float(took.sum() - candidate @ had) / len(ranks)
        per_tet = on_tets / np.maximum(tets, 1.0) + on_nodes / max(tets.sum(), 1.0)
        return Costs(per_tet, float(candidate[sim.comm.rank]), spent["fracture"], rank)


def _candidates(had: Floats, took: Floats) -> Floats:
    """(ranks,) cost of a candidate of each, by what all ranks had and took (ranks,)."""
    mean = took.sum() / max(had.sum(), 1.0)
    return np.asarray(np.clip(took / np.maximum(had, 1.0), mean / _FARTHEST, mean * _FARTHEST))


def on_parts(sim: Simulation) -> Floats:
    """(parts,) CPU time of the passes over the tets of each so far, s; that over one block alone is the phase."""
    seconds, blocks = np.zeros(len(sim.model.parts)), sim.model.blocks
    for block in blocks:
        seconds[block.part] = block.seconds if len(blocks) > 1 else sim.timers.seconds["elements"]
    return seconds
