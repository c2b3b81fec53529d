"""Measurement of costs, in CPU seconds of this run: costs of tets, of contact candidates and of ranks."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from conoid.cases.estimates.balancing import WORK

from ..model.state import Floats
from ..simulation import Simulation

_FARTHEST = 4.0
"""Bound for two ratios: cost of a candidate pair on one rank to the mean cost, and the inverse of this ratio. Chosen
value: with few candidate pairs the measurement is mostly noise."""


@dataclass(frozen=True)
class Costs:
    """Costs in CPU seconds per step."""

    tet: Floats
    """(parts,) cost of a tet of each part."""
    candidate: float
    """Cost of a contact candidate on this rank. The cost is measured on each rank, because the candidates of different
    ranks have different costs."""
    fracture: float
    """Cost of the fracture stage on this rank."""
    rank: float
    """(ranks,) cost of contact on each rank that is not proportional to the number of candidates."""


@dataclass
class Meter:
    """Meter that measures costs since it was made."""

    step: int
    seconds: dict[str, float]
    """Timers when the meter was made, s."""
    on_parts: Floats
    """(parts,) CPU time of the passes over the tets of each part when the meter was made, s."""

    @classmethod
    def of(cls, sim: Simulation) -> Self:
        """Return a meter that starts to measure now."""
        return cls(sim.clock.step, dict(sim.timers.seconds), on_parts(sim))

    def costs(self, sim: Simulation, effort: float) -> Costs:
        """Return the costs since the meter was made; ``effort``: number of candidates of this rank. Collective."""
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
    """Return (ranks,) the cost of a candidate on each rank. ``had`` (ranks,): numbers of candidates; ``took`` (ranks,):
    CPU times.
    """
    mean = took.sum() / max(had.sum(), 1.0)
    return np.asarray(np.clip(took / np.maximum(had, 1.0), mean / _FARTHEST, mean * _FARTHEST))


def on_parts(sim: Simulation) -> Floats:
    """Return (parts,) the CPU time of the passes over the tets of each part so far, s. If the rank has only one block,
    the time of its part is the time of the phase of the elements.
    """
    seconds, blocks = np.zeros(len(sim.model.parts)), sim.model.blocks
    for block in blocks:
        seconds[block.part] = block.seconds if len(blocks) > 1 else sim.timers.seconds["elements"]
    return seconds
