"""Load balance: what tets cost, when it pays to cut anew, and what came of it.

Costs are CPU seconds of this run: of a tet of each part by the passes over it, of nodes, and of contact and fracture by
the candidates that a node has. Every rank hears of the work of all, so that all decide alike. The answer of the run
knows nothing of it.
"""

import math
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from conoid.cases.schema import Case

from . import simulation
from .migration.parcel import Parcel
from .migration.route import route
from .parallel.comm import Comm
from .simulation import Simulation
from .state import Floats, Ints
from .timers import WORK

_LEAST = 1e-9
"""s: what a tet costs at least, so that every rank gets some before anything has been measured."""


@dataclass
class Window:
    """CPU seconds of all ranks over some steps."""

    steps: int
    work: dict[str, list[float]]
    """By phase, one number a rank."""

    @property
    def loads(self) -> Floats:
        """(ranks,) s a step."""
        return np.asarray(np.sum([self.work[name] for name in WORK], axis=0) / max(self.steps, 1))

    @property
    def imbalance(self) -> float:
        """Largest load over the mean."""
        mean = float(self.loads.mean())
        return float(self.loads.max()) / mean if mean > 0.0 else 1.0

    @property
    def lost(self) -> float:
        """What a step takes longer than with equal loads, s."""
        return float(self.loads.max() - self.loads.mean())


@dataclass
class Balance:
    """Watches the loads of a run and moves tets where that pays."""

    case: Case
    comm: Comm
    cost: float
    """Wall time of the last cut, s; at first that of the set-up."""
    _step: int
    """Of the last cut."""
    spent: float = 0.0
    """Wall time of all cuts, s."""
    saved: float = 0.0
    """By all cuts so far, s: what steps would have taken with the imbalance from before each, less what they took."""
    events: int = 0
    _began: dict[str, float] = field(default_factory=dict)
    """The timers at the last cut."""
    _lost: float = 0.0
    """To imbalance since then, beyond what cannot be helped, s."""
    _helpless: float = 0.0
    """Smallest loss of a step since the last cut, s: what another cut is not expected to mend."""
    _latest: Window | None = None
    _before: float | None = None
    """The imbalance before the last cut."""
    _outside: int = -1
    """Outside nodes of this rank at the last cut."""

    def look(self, window: Window) -> None:
        """Takes the work of all ranks since the last look."""
        self._latest = window
        if self._before is not None:
            self.saved += (self._before - window.imbalance) * float(window.loads.mean()) * window.steps
        self._helpless = min(self._helpless, window.lost)
        self._lost += (window.lost - self._helpless) * window.steps

    def grown(self, sim: Simulation) -> bool:
        """Whether this rank has more outside nodes than it may (the paper's trigger, its fig. 9)."""
        if self.case.balance.policy != "outside" or sim.contact is None:
            return False
        if self._outside < 0:
            self._outside = sim.contact.outside
        return sim.contact.outside > self.case.balance.alpha * self._outside

    def cause(self, sim: Simulation) -> str | None:
        """Why to cut now, if so; the same on all ranks."""
        spec, step = self.case.balance, sim.clock.step
        if self.comm.size == 1 or spec.policy == "never" or step == self._step:
            return None
        if spec.policy == "every":
            return f"every {spec.every} steps" if step % spec.every == 0 else None
        if spec.policy == "outside":
            return f"a rank has {spec.alpha:g} times its outside nodes" if sim.vote.grown else None
        return "time lost exceeds the cost" if self._lost > self.cost else None

    def move(self, sim: Simulation) -> tuple[Simulation, dict[str, Any]]:
        """Cuts by the costs and moves what has to; the new simulation and what to tell. All ranks take part."""
        began, before = time.monotonic(), self._latest
        parcel = simulation.keep(sim)
        self.weigh(sim, parcel)
        arrived = route(parcel, self.case.run.cut_scale, self.comm)
        sim.free()
        now = simulation.resume(self.case, arrived, self.comm, sim.timers)
        tets, nodes = np.sum(self.comm.share(arrived.moved), axis=0)
        predicted = self.comm.share(float(sum(table["weight"].sum() for table in arrived.parcel.tets.values())))
        cost = self.comm.broadcast(time.monotonic() - began)
        self._settle(now, before, cost)
        told = {
            "before": {name: [s / max(before.steps, 1) for s in before.work[name]] for name in WORK} if before else {},
            "predicted": predicted, "tets": int(tets), "nodes": int(nodes), "cost": cost, "saved": self.saved,
        }  # fmt: skip
        return now, told

    def _settle(self, sim: Simulation, before: Window | None, cost: float) -> None:
        """Begins to count anew after a cut."""
        self.events, self.spent, self.cost = self.events + 1, self.spent + cost, cost
        self._before = before.imbalance if before is not None else None
        self._step, self._lost, self._helpless, self._latest = sim.clock.step, 0.0, math.inf, None
        self._began = dict(sim.timers.seconds)
        self._outside = sim.contact.outside if sim.contact is not None else 0

    def weigh(self, sim: Simulation, parcel: Parcel) -> None:
        """Fills the ``weight`` of every tet of a parcel, s a step; all ranks take part."""
        if self.case.balance.weights == "tets":
            return
        effort = sim.contact.effort() if sim.contact is not None else np.zeros(sim.model.nodes.n)
        if self.case.balance.weights == "outside":
            effort = (effort > 0.0).astype(float)
            per_tet, per_effort = dict.fromkeys(parcel.tets, 0.0), 1.0
        else:
            per_tet, per_effort = self._rates(sim, float(effort.sum()))
        nodes = _with_their_first_tets(parcel, effort)
        for part, table in parcel.tets.items():
            table["weight"] = _LEAST + per_tet[part] + per_effort * nodes[part]

    def _rates(self, sim: Simulation, effort: float) -> tuple[dict[int, float], float]:
        """CPU seconds a step of a tet, by part, and of a candidate, since the last cut."""
        parts, steps = len(sim.model.parts), max(sim.clock.step - self._step, 1)
        seconds, tets = np.zeros(parts), np.zeros(parts)
        for block in sim.model.blocks:
            seconds[block.part], tets[block.part] = block.seconds, block.n
        spent = {name: sim.timers.seconds[name] - self._began.get(name, 0.0) for name in WORK}
        mine = np.concatenate([seconds, tets, [spent["nodes"], spent["contact"] + spent["fracture"], effort]])
        every = np.sum(self.comm.share(mine), axis=0)
        seconds, tets, (on_nodes, surrounded, effort) = every[:parts], every[parts : 2 * parts], every[2 * parts :]
        per_tet = seconds / np.maximum(tets, 1.0) + on_nodes / max(float(tets.sum()), 1.0)
        return dict(enumerate((per_tet / steps).tolist())), float(surrounded / max(float(effort), 1.0) / steps)


def _with_their_first_tets(parcel: Parcel, effort: Floats) -> dict[int, Floats]:
    """By part (n,): the ``effort`` (nodes,) of all nodes whose tet of smallest id here it is."""
    ids, first = parcel.nodes["id"], np.full(len(effort), np.iinfo(np.int64).max)
    corners: dict[int, Ints] = {part: np.searchsorted(ids, t["corners"]) for part, t in parcel.tets.items()}
    for part, table in parcel.tets.items():
        np.minimum.at(first, corners[part], table["id"][:, None])
    return {
        part: np.where(first[corners[part]] == table["id"][:, None], effort[corners[part]], 0.0).sum(axis=1)
        for part, table in parcel.tets.items()
    }
