"""Load balance: what tets cost, when it pays to cut anew, and what came of it.

Costs are CPU seconds of this run: of a tet of each part by the passes over it, of nodes, and of contact by the
candidates that a node has. Every rank receives the work of all, so that all decide alike. The answer of the run
does not depend on it.
"""

import time
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from conoid.cases.estimates import balancing
from conoid.cases.estimates.balancing import MOVED, WORK, Guard, Trigger
from conoid.cases.model.schema import Case

from .. import simulation
from ..accounts.timers import worked
from ..model.ids import located
from ..model.state import Floats
from ..parallel.comm import Comm
from ..simulation import Simulation
from .meter import Meter
from .parcel import Parcel
from .route import route

_LEAST = 1e-9
"""s: what a tet costs at least, so that every rank gets some before anything has been
measured. Chosen far below what any tet takes."""


@dataclass
class Window:
    """CPU seconds of all ranks over some steps."""

    steps: int
    work: dict[str, list[float]]
    """By phase, one number a rank."""

    def loads(self, phases: tuple[str, ...]) -> list[float]:
        """(ranks,) s a step, in some phases."""
        return [float(load) / max(self.steps, 1) for load in np.sum([self.work[name] for name in phases], axis=0)]

    @property
    def imbalance(self) -> float:
        """Largest load over the mean."""
        return balancing.imbalance(self.loads(WORK))


@dataclass
class Balance:
    """Watches the loads of a run and moves tets where that pays."""

    case: Case
    comm: Comm
    trigger: Trigger
    _meter: Meter
    """Set at the last cut, and again in a look that finds half of what calls for the next one lost, but not all of it:
    fronts move, and costs over the things of the present are those of the present.
    """
    spent: float = 0.0
    """Wall time of all cuts, s."""
    events: int = 0
    _half: bool = False
    """Whether the meter has been set again since the last cut."""
    _guard: Guard | None = None
    _latest: Window | None = None
    _before: float | None = None
    """The imbalance of the steps just before the last cut."""
    _saved: float = 0.0
    """By the cuts before the last one, s."""

    @classmethod
    def of(cls, sim: Simulation) -> Self:
        """For a run that begins or goes on."""
        trigger = Trigger(sim.case.balance, sim.assembled, sim.clock.step)
        return cls(sim.case, sim.comm, trigger, Meter.of(sim))

    def look(self, window: Window) -> None:
        """Takes the work of all ranks since the last look. What no cut moves is no reason for one."""
        self._latest = window
        self.trigger.look(window.loads(MOVED), window.steps)

    @property
    def saved(self) -> float:
        """By all cuts so far, s: what the work would have taken with the imbalance just before each cut instead of just
        after it. What has grown since then is no fault of the cut.
        """
        stretch = self.trigger.stretch
        if self._before is None or not stretch.steps:
            return self._saved
        return self._saved + (self._before - stretch.halves[0]) * float(np.mean(stretch.work))

    def grown(self, sim: Simulation) -> bool:
        """Whether this rank has more outside nodes than it may."""
        if self.case.balance.policy != "outside" or sim.contact is None:
            return False
        self._guard = self._guard or Guard(self.case.balance.alpha)
        return self._guard.grown(sim.contact.outside)

    def cause(self, sim: Simulation) -> str | None:
        """Why to cut now, if so; the same on all ranks."""
        if self.comm.size == 1:
            return None
        cause = self.trigger.cause(sim.clock.step, sim.reduction.grown)
        if cause is None and not self._half and self.trigger.half_way:
            self._meter, self._half = Meter.of(sim), True
        return cause

    def move(self, sim: Simulation) -> tuple[Simulation, dict[str, Any]]:
        """Cuts by the costs and moves what has to; the new simulation and what to tell. All ranks take part."""
        began, before, cpu = time.monotonic(), self._latest, worked(self.comm)
        parcel = simulation.keep(sim)
        self.weigh(sim, parcel)
        arrived = route(parcel, self.case.run.cut_scale, self.comm)
        sim.free()
        now = simulation.resume(self.case, arrived, self.comm, sim.timers)
        tets, nodes = np.sum(self.comm.share(arrived.moved), axis=0)
        predicted = self.comm.share(float(sum(table["weight"].sum() for table in arrived.parcel.tets.values())))
        cost = self.comm.broadcast(time.monotonic() - began)
        work = float(self.comm.maximum(np.array([worked(self.comm) - cpu]))[0])
        self._settle(now, cost, work)
        told = {
            "before": {name: [s / max(before.steps, 1) for s in before.work[name]] for name in WORK} if before else {},
            "predicted": predicted, "tets": int(tets), "nodes": int(nodes), "cost": cost, "saved": self.saved,
        }  # fmt: skip
        return now, told

    def _settle(self, sim: Simulation, cost: float, work: float) -> None:
        """Begins to count anew after a cut that took ``cost`` on the clock, and ``work`` of the slowest rank, s."""
        paid = self._before is None or self.saved - self._saved >= self.trigger.cost
        self.events, self.spent, self._saved = self.events + 1, self.spent + cost, self.saved
        self._before, self._latest = self.trigger.stretch.halves[1] if self.trigger.stretch.steps else None, None
        self.trigger.settle(sim.clock.step, work, paid)
        self._meter, self._half = Meter.of(sim), False
        self._guard = Guard(self.case.balance.alpha, sim.contact.outside if sim.contact is not None else 0)

    def weigh(self, sim: Simulation, parcel: Parcel) -> None:
        """Fills the ``weight`` of every tet of a parcel, s a step, by what ranks do at the same time: its own, and of
        what is done round it the search and the rest. All ranks take part.
        """
        if self.case.balance.weights == "tets":
            return
        effort = sim.contact.effort() if sim.contact is not None else np.zeros((sim.model.nodes.n, 2))
        if self.case.balance.weights == "outside":
            nodes = _with_their_first_tets(parcel, np.any(effort, axis=1)[:, None])
            for part, table in parcel.tets.items():
                table["weight"][:, 0] = _LEAST + nodes[part][:, 0]
            return
        costs = self._meter.costs(sim, float(effort.sum()))
        around = _with_their_first_tets(parcel, costs.candidate * effort)
        for part, table in parcel.tets.items():
            own = np.full(len(around[part]), _LEAST + costs.tet[part])
            table["weight"] = np.column_stack([own, around[part]])


def _with_their_first_tets(parcel: Parcel, effort: "np.ndarray") -> dict[int, Floats]:
    """By part (n, k): the ``effort`` (nodes, k) of all nodes whose tet of smallest id here it is."""
    ids, first = parcel.nodes["id"], np.full(len(effort), np.iinfo(np.int64).max)
    corners = {part: located(ids, t["corners"]) for part, t in parcel.tets.items()}
    for part, table in parcel.tets.items():
        np.minimum.at(first, corners[part], table["id"][:, None])
    found = {}
    for part, table in parcel.tets.items():
        mine = first[corners[part]] == table["id"][:, None]
        found[part] = np.column_stack([np.where(mine, each[corners[part]], 0.0).sum(axis=1) for each in effort.T])
    return found
