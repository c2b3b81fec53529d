"""Load balance. The module measures the costs of tets, decides when to divide the tets again among the ranks (a cut),
and computes the time that cuts have saved.

Costs are CPU seconds of this run. The cost of the tets of each part is measured in the passes over these tets. The cost
of nodes, and the cost of contact for the candidate pairs of a node, are also measured. Every rank receives the times of
all ranks, so that all ranks make the same decision. The answer of the run does not depend on the division of the tets
among the ranks.
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
"""Smallest cost of a tet, s; with this cost, every rank gets tets even before any cost is measured. Chosen value: far
below the measured cost of any tet."""


@dataclass
class Window:
    """CPU seconds of all ranks, in some successive steps."""

    steps: int
    work: dict[str, list[float]]
    """CPU seconds in each phase, with one number for each rank."""

    def loads(self, phases: tuple[str, ...]) -> list[float]:
        """Return (ranks,) the load of each rank in the given phases, in s per step."""
        return [float(load) / max(self.steps, 1) for load in np.sum([self.work[name] for name in phases], axis=0)]

    @property
    def imbalance(self) -> float:
        """Ratio of the largest load of a rank to the mean load."""
        return balancing.imbalance(self.loads(WORK))


@dataclass
class Balance:
    """Load balance of a run. Measures the loads and moves tets if a new cut saves time."""

    case: Case
    comm: Comm
    trigger: Trigger
    _meter: Meter
    """Meter of the costs since the last cut. The meter is restarted when half of the loss that triggers the next cut
    has accumulated, because costs change as fronts move."""
    spent: float = 0.0
    """Wall time of all cuts, s."""
    events: int = 0
    _half: bool = False
    """True if the meter was restarted since the last cut."""
    _guard: Guard | None = None
    _latest: Window | None = None
    _before: float | None = None
    """Imbalance in the steps just before the last cut."""
    _saved: float = 0.0
    """Time saved by all cuts except the last one, s."""

    @classmethod
    def of(cls, sim: Simulation) -> Self:
        """Return the balance of a run that starts or is resumed."""
        trigger = Trigger(sim.case.balance, sim.assembled, sim.clock.step)
        return cls(sim.case, sim.comm, trigger, Meter.of(sim))

    def look(self, window: Window) -> None:
        """Add the times of all ranks since the last call. The time of work that no cut can move to another rank is
        omitted.
        """
        self._latest = window
        self.trigger.look(window.loads(MOVED), window.steps)

    @property
    def saved(self) -> float:
        """Time saved by all cuts so far, s.

        For each cut the times of two imbalances are compared: the imbalance just before the cut, and the imbalance just
        after it. Imbalance that arises later is not counted.
        """
        stretch = self.trigger.stretch
        if self._before is None or not stretch.steps:
            return self._saved
        return self._saved + (self._before - stretch.halves[0]) * float(np.mean(stretch.work))

    def grown(self, sim: Simulation) -> bool:
        """Return True if this rank has more outside nodes than its limit."""
        if self.case.balance.policy != "outside" or sim.contact is None:
            return False
        self._guard = self._guard or Guard(self.case.balance.alpha)
        return self._guard.grown(sim.contact.outside)

    def cause(self, sim: Simulation) -> str | None:
        """Return the reason to make a cut now, or None. All ranks return the same reason."""
        if self.comm.size == 1:
            return None
        cause = self.trigger.cause(sim.clock.step, sim.reduction.grown)
        if cause is None and not self._half and self.trigger.half_way:
            self._meter, self._half = Meter.of(sim), True
        return cause

    def move(self, sim: Simulation) -> tuple[Simulation, dict[str, Any]]:
        """Make a cut by the costs, and move the tets. Return the new simulation and the fields of the message about the
        cut.

        Collective.
        """
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
        message = {
            "before": {name: [s / max(before.steps, 1) for s in before.work[name]] for name in WORK} if before else {},
            "predicted": predicted, "tets": int(tets), "nodes": int(nodes), "cost": cost, "saved": self.saved,
        }  # fmt: skip
        return now, message

    def _settle(self, sim: Simulation, cost: float, work: float) -> None:
        """Restart the measurement after a cut. ``cost``: wall time of the cut, s; ``work``: CPU time that the slowest
        rank used for the cut, s.
        """
        paid = self._before is None or self.saved - self._saved >= self.trigger.cost
        self.events, self.spent, self._saved = self.events + 1, self.spent + cost, self.saved
        self._before, self._latest = self.trigger.stretch.halves[1] if self.trigger.stretch.steps else None, None
        self.trigger.settle(sim.clock.step, work, paid)
        self._meter, self._half = Meter.of(sim), False
        self._guard = Guard(self.case.balance.alpha, sim.contact.outside if sim.contact is not None else 0)

    def weigh(self, sim: Simulation, parcel: Parcel) -> None:
        """Set the ``weight`` of every tet of a parcel, s per step.

        The weight has one column for each phase after which ranks wait. The columns are the cost of the tet itself, the
        cost of the contact search for its nodes, and the cost of the rest of contact for its nodes. Collective.
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
    """Return, for each part, (n, k) the ``effort`` (nodes, k) of nodes, assigned to tets. A node is assigned to one
    tet: the tet of smallest id on this rank.
    """
    ids, first = parcel.nodes["id"], np.full(len(effort), np.iinfo(np.int64).max)
    corners = {part: located(ids, t["corners"]) for part, t in parcel.tets.items()}
    for part, table in parcel.tets.items():
        np.minimum.at(first, corners[part], table["id"][:, None])
    found = {}
    for part, table in parcel.tets.items():
        mine = first[corners[part]] == table["id"][:, None]
        found[part] = np.column_stack([np.where(mine, each[corners[part]], 0.0).sum(axis=1) for each in effort.T])
    return found
