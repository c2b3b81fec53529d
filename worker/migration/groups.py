"""Loads of groups of tets, recorded at intervals. From the records the effect of other balance policies can be
computed.

``conoid replay-balance`` reads the records (docs/performance/balance.md). A group is a fixed set of tets, chosen at the
start, with their nodes and the copies of these nodes. When tets and nodes move between ranks, the tets and nodes remain
in their group. Counts are integers and equal for any number of ranks; an exception are candidate pairs of edges and
cracks whose nodes are on several ranks.
"""

import time
from typing import Any

import numpy as np

from ..accounts.timers import worked
from ..simulation import Simulation
from .meter import Meter

_TIMES = 200
"""Largest number of records of a normal run. A slow run has more records: one in each interval ``_PATIENCE``."""
_PATIENCE = 10.0
"""Largest wall time between two records, s. Chosen value."""
_SHARE = 1.0 / 400.0
"""Fraction of the time of a run that the recording may take."""


class Groups:
    """Records the loads of the groups of a run."""

    def __init__(self, sim: Simulation, cost: float) -> None:
        """``cost``: expected cost of a cut, s."""
        self._cost = cost
        self._meter = Meter.of(sim)
        self._t = sim.clock.t
        self._recorded = time.monotonic()
        self._took = 0.0
        """CPU time that the last record took, s."""
        self._first = True

    def moved(self, sim: Simulation) -> None:
        """Restart the meter after tets have moved, because the time of each block then starts from zero."""
        self._meter = Meter.of(sim)

    def due(self, t: float, now: float) -> bool:
        """Return True if a record is scheduled. ``t``: simulated time, s; ``now``: wall time, s. Only rank 0 calls this
        method.
        """
        since = now - self._recorded
        return since * _SHARE > self._took and (t >= self._t or since > _PATIENCE)

    def record(self, sim: Simulation) -> dict[str, Any]:
        """Return the fields of the message for one record. Collective."""
        began, model = worked(sim.comm), sim.model
        n, end = len(model.groups), sim.case.run.end_time
        counts = np.zeros((n, len(model.parts) + 2), np.int64)
        for block in model.blocks:
            counts[:, block.part] = np.bincount(block.group, minlength=n)
        if sim.contact is not None:
            counts[:, -2] = np.bincount(model.nodes.group, sim.contact.effort().sum(axis=1), n)
            counts[:, -1] = np.bincount(model.nodes.group, sim.contact.on_surface, n)
        costs = self._meter.costs(sim, float(counts[:, -2].sum()))
        tets = counts[:, :-2].sum(axis=1)
        places = counts[:, -2] if counts[:, -2].any() else tets
        load = counts[:, :-2] @ costs.tet + costs.candidate * counts[:, -2]
        load += costs.fracture / max(places.sum(), 1) * places
        load, outside = sim.comm.sum(np.stack([np.rint(1e9 * load).astype(np.int64), counts[:, -1]]))
        message: dict[str, Any] = {
            "load": load.tolist(), "outside": outside.tolist(), "rank": round(1e9 * costs.rank),
        }  # fmt: skip
        if self._first:
            message |= {"load": [0] * n, "rank": 0, "cost": self._cost}
            message |= {"centres": model.groups[:, :3].tolist(), "tets": model.groups[:, 3].astype(np.int64).tolist()}
        self.moved(sim)
        self._first = False
        self._t = end / _TIMES * (int(sim.clock.t * _TIMES / end) + 1)
        self._recorded = time.monotonic()
        self._took = worked(sim.comm) - began
        return message
