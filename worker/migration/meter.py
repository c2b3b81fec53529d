"""Costs of tets, candidates and ranks: CPU seconds of this run."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from conoid.cases.estimates.balancing import WORK

from ..model.state import Floats
from ..simulation import Simulation

_FARTHEST = 4.0
"""Largest ratio of the cost of a candidate on one rank to the mean, and of the mean to it. Chosen: with few
candidates the measurement is mostly noise."""


@dataclass(frozen=True)
class Costs:
    """CPU seconds a step."""

    tet: Floats
    """(parts,) cost of a tet."""
    candidate: float
    """Cost of a candidate on this rank: candidates differ, and the measured cost is the best estimate there."""
    fracture: float
    """Cost of all fracture on this rank."""
    rank: float
    """Remaining cost of each rank."""


@dataclass
class Meter:
    """Measures costs since it was made."""

    step: int
    seconds: dict[str, float]
    """Timers when it was made, s."""
    on_parts: Floats
    """(parts,) CPU time of the passes over the tets until then, s."""

    @classmethod
    def of(cls, sim: Simulation) -> Self:
        """Return a meter that starts now."""
        return cls(sim.clock.step, dict(sim.timers.seconds), on_parts(sim))

    def costs(self, sim: Simulation, effort: float) -> Costs:
        """Return the costs, if this rank has ``effort`` candidates. Collective."""
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
    """Return (ranks,) the cost of a candidate on each rank, from their numbers ``had`` and times ``took``, (ranks,)."""
    mean = took.sum() / max(had.sum(), 1.0)
    return np.asarray(np.clip(took / np.maximum(had, 1.0), mean / _FARTHEST, mean * _FARTHEST))


def on_parts(sim: Simulation) -> Floats:
    """Return (parts,) the CPU time of the passes over the tets of each part so far, s; with one block, that of the
    phase.
    """
    seconds, blocks = np.zeros(len(sim.model.parts)), sim.model.blocks
    for block in blocks:
        seconds[block.part] = block.seconds if len(blocks) > 1 else sim.timers.seconds["elements"]
    return seconds
