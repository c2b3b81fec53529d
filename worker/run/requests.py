"""Requests of this rank in the reduction of a step: a stop, a report, a checkpoint, a snapshot, or a new division of
the tets among the ranks.
"""

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
from .stops import CANCELLED, MAX_STEPS, WALL_TIME

_REPORT_EVERY = 0.25
"""Wall time between two reports, s. Chosen value: a display that is updated four times a second moves smoothly."""


class Requests:
    """Object that writes the requests of this rank into the next reduction, in steps in which a request may begin or
    end.
    """

    def __init__(self, case: Case, folder: Path, signals: Signals, groups: Groups, began: float) -> None:
        """``began``: wall time at which the steps began, s."""
        self._run, self._folder, self._signals, self._groups, self._began = case.run, folder, signals, groups, began
        self.reported = self.kept = began
        """Wall times of the last report and of the last checkpoint, s."""
        self._stop_file = False
        """True if a file has requested a stop."""
        self._active = True
        """True if this rank wrote a request into the last reduction that it filled."""
        self._every_step = case.balance.policy == "outside"
        """True if the requests are written in every step, which is necessary if the number of outside nodes must be
        compared with its limit in every step."""
        self._wall = self._time = 0.0
        """Two times before which no request can begin: wall time, s, and simulated time, s."""

    @property
    def idle(self) -> bool:
        """True if no request is in progress, and no request depends on the step."""
        return not (self._active or self._every_step)

    def next(self, t: float) -> tuple[float, float, int]:
        """Return three bounds before which no request can begin: wall time, s, simulated time, s, and number of the
        step.

        A request may be scheduled for a simulated time before ``t``, s. A request with a time before ``t`` waits only
        because snapshots have a smallest interval in wall time; it has no bound in simulated time.
        """
        return self._wall, self._time if self._time > t else math.inf, self._run.max_steps - 1

    def due(self, clock: Clock, now: float) -> bool:
        """Return True if the requests may have changed before the wall time ``now``, s."""
        last = clock.step + 1 >= self._run.max_steps
        return (
            now >= self._wall or clock.t >= self._time or self._active or self._every_step
            or bool(self._signals.raised) or last
        )  # fmt: skip

    @property
    def for_checkpoint(self) -> bool:
        """True if a file requests a checkpoint."""
        return (self._folder / layout.CHECKPOINT_REQUEST).exists()

    def propose(self, sim: Simulation, balance: Balance, snapshots: Snapshots, now: float) -> None:
        """Write the requests of this rank into the next reduction, at the wall time ``now``, s."""
        own, run, leads = sim.reduction.own, self._run, sim.comm.rank == 0
        limit, every = run.max_wall_time, run.checkpoint_every
        own.report = leads and now - self.reported > _REPORT_EVERY
        own.stop = self._stop(sim.clock, now, read_files=own.report)
        own.groups = own.report and self._groups.due(sim.clock.t, now)
        own.grown = balance.grown(sim)
        own.snapshot = leads and not sim.reduction.snapshot and snapshots.due(sim.clock, now, look=own.report)
        late = every is not None and now - self.kept > every
        own.checkpoint = leads and (late or (own.report and self.for_checkpoint))
        self._active = bool(own.stop or own.report or own.groups or own.snapshot or own.checkpoint)
        self._time = 0.0 if snapshots.asked_for else snapshots.next_time
        self._wall = min(
            self.reported + _REPORT_EVERY if leads else math.inf,
            self._began + limit if limit is not None else math.inf,
            self.kept + every if every is not None else math.inf,
        )

    def _stop(self, clock: Clock, now: float, *, read_files: bool) -> int:
        """Return the reason for a stop; 0 if there is no reason.

        ``read_files``: True to search the disk for the file that requests a stop.
        """
        self._stop_file |= read_files and (self._folder / layout.STOP_REQUEST).exists()
        if clock.step + 1 >= self._run.max_steps:
            return MAX_STEPS
        limit = self._run.max_wall_time
        if limit is not None and now - self._began > limit:
            return WALL_TIME
        return CANCELLED if self._signals.raised or self._stop_file else 0
