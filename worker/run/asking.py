"""What a rank gives to the reduction of the step, and when: a stop, a report, a checkpoint, a snapshot."""

import math
from pathlib import Path

from conoid.cases.model.schema import Case
from conoid.cases.output import layout

from ..clock import Clock
from ..migration.balance import Balance
from ..migration.groups import Groups
from ..simulation import Simulation
from ..snapshots.stage import Snapshots
from .signals import Signals

CANCELLED, WALL_TIME, MAX_STEPS = 1, 2, 3
"""Reasons to stop early, in the reduction of the step: the largest wins."""
_REPORT_EVERY = 0.25
"""s of wall time between two reports: four a second look alive. Chosen."""


class Asking:
    """What this rank gives stays as it is until something is due."""

    def __init__(self, case: Case, folder: Path, signals: Signals, groups: Groups, began: float) -> None:
        """``began``: wall time when the steps began, s."""
        self._run, self._folder, self._signals, self._groups, self._began = case.run, folder, signals, groups, began
        self.reported = self.kept = began
        """Wall times of the last report and of the last checkpoint, s."""
        self._told = False
        """Whether a file has asked for a stop."""
        self._asks, self._watches = True, case.balance.policy == "outside"
        """Whether this rank has asked for something in the last step; whether it counts its outside nodes in each."""
        self._at = self._time = 0.0
        """Wall time and simulated time, s, before which there is nothing to ask for."""

    def due(self, clock: Clock, now: float) -> bool:
        """Whether something has changed at the wall time ``now``, s."""
        last = clock.step + 1 >= self._run.max_steps
        return now >= self._at or clock.t >= self._time or self._asks or bool(self._signals.raised) or last

    @property
    def for_checkpoint(self) -> bool:
        """Whether a file asks for a checkpoint."""
        return (self._folder / layout.CHECKPOINT_REQUEST).exists()

    def propose(self, sim: Simulation, balance: Balance, snapshots: Snapshots, now: float) -> None:
        """Gives to the next reduction what is due at the wall time ``now``, s."""
        own, run, leads = sim.reduction.own, self._run, sim.comm.rank == 0
        limit, every = run.max_wall_time, run.checkpoint_every
        own.report = leads and now - self.reported > _REPORT_EVERY
        own.stop = self._stop(sim.clock, now, look=own.report)
        own.groups = own.report and self._groups.due(sim.clock.t, now)
        own.grown = balance.grown(sim)
        own.snapshot = leads and not sim.reduction.snapshot and snapshots.due(sim.clock, now, look=own.report)
        late = every is not None and now - self.kept > every
        own.checkpoint = leads and (late or (own.report and self.for_checkpoint))
        self._asks = bool(own.stop or own.report or own.groups or own.snapshot or own.checkpoint) or self._watches
        self._time = 0.0 if snapshots.asked_for else snapshots.next_time
        self._at = min(
            self.reported + _REPORT_EVERY if leads else math.inf,
            self._began + limit if limit is not None else math.inf,
            self.kept + every if every is not None else math.inf,
        )

    def _stop(self, clock: Clock, now: float, *, look: bool) -> int:
        """Reason to stop, 0 for none; ``look``: whether a file may ask for it."""
        self._told |= look and (self._folder / layout.STOP_REQUEST).exists()
        if clock.step + 1 >= self._run.max_steps:
            return MAX_STEPS
        limit = self._run.max_wall_time
        if limit is not None and now - self._began > limit:
            return WALL_TIME
        return CANCELLED if self._signals.raised or self._told else 0
