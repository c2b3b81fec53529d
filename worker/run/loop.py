"""The time loop, which advances the simulation, runs the scheduled outputs, and ends the run."""

import gc
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from conoid.cases import messages
from conoid.cases.output import layout
from conoid.cases.run import State

from .. import simulation, step
from ..migration import checkpoint
from ..migration.balance import Balance
from ..migration.groups import Groups
from ..model.state import Floats
from ..output.counts import Counter
from ..output.history import History
from ..output.journal import Journal
from ..parallel.choice import Choice
from ..simulation import Simulation
from ..snapshots.stage import Snapshots
from ..stretch import Stretch, Until
from . import stops
from .frames import Frames
from .notices import Notices
from .reports import Reports
from .requests import Requests
from .samples import Samples
from .signals import Signals


@dataclass(frozen=True)
class Start:
    """Sizes, counters and warnings at the first step of this process. Checkpoints contain them, so that a resumed run
    has the same values.
    """

    elements: int
    nodes: int
    thick: list[list[list[float]]]
    """Result of reference.thicknesses at the start."""
    sample: int = 0
    """Number of samples scheduled up to the first step of this process."""
    lines: int = 0
    """Number of lines that the history file had at the first step of this process."""
    updates: int = 0
    """Sum of the numbers of tets over all steps before the first step of this process."""
    resumed: bool = False
    warnings: tuple[str, ...] = ()
    """Warnings of the start of the run (Simulation)."""


class Loop:
    """Loop that advances a simulation to its end time or to an early stop."""

    def __init__(
        self, sim: Simulation, folder: Path, journal: Journal | None, history: History | None, signals: Signals,
        balance: Balance, start: Start,
    ) -> None:  # fmt: skip
        """``journal`` and ``history``: None on all ranks except 0."""
        self.sim, self.balance = sim, balance
        self.stopped = 0
        """Reason for an early stop (stops.py); 0 if the run does not stop early."""
        self.warnings: list[str] = []
        """Warnings that arose in steps, equal on all ranks."""
        self.updates = start.updates
        """Sum of the numbers of tets over all steps so far."""
        self.choice: Choice | None = None
        """Object that chooses the number of threads of this rank; None if all threads are used."""
        self._folder, self._start = folder, start
        self._notices, counter = Notices(journal), Counter()
        self._groups = Groups(sim, balance.trigger.cost)
        self._requests = Requests(sim.case, folder, signals, self._groups, time.monotonic())
        self.samples = Samples(sim, history, start.sample, start.lines)
        self.snapshots = Snapshots(sim, folder, journal)
        self._stretch = Stretch(sim)
        self.frames = Frames(folder, self._notices, counter)
        self._reports = Reports(sim, balance, self._groups, self._notices, counter, self._requests, start.updates)

    def run(self) -> None:
        """Take steps until the end time or a reason to stop. Raises PhysicsError."""
        gc.collect()
        gc.freeze()  # otherwise a garbage collection scans all objects of numba, which takes 0.1 s on each rank
        self.sim.timers.begin()
        self.sim.comm.sent.since_last()
        if not self._start.resumed:
            step.prepare(self.sim)
            self._number_fragments()
        self._reports.write_groups(self.sim)
        while True:
            self._attend()
            self._first_half()
            if self.sim.clock.done or self.sim.reduction.stop:
                self._end()
                return
            self._second_half()
            if self.choice is not None and (text := self.choice.step()):
                self._notices.write(self.sim.clock, messages.Log, level="info", text=text)

    def _number_fragments(self) -> None:
        """Give numbers to the fragments of the initial state, unless the first frame gives the numbers."""
        record, run = self.sim.record, self.sim.case.run
        if record is not None and not run.frames:
            record.update()
            record.number()

    def _attend(self) -> None:
        """Execute the requests of the last reduction. Write the requests of this rank into the next reduction."""
        sim = self.sim
        if sim.reduction.report:
            self._reports.write(sim, self.samples, self.updates)
        if sim.comm.size > 1:
            self._rebalance()
        if self.sim.reduction.checkpoint or self.sim.reduction.stop:
            self._checkpoint()
        if self._requests.due(self.sim.clock, now := time.monotonic()):
            self._requests.propose(self.sim, self.balance, self.snapshots, now)

    def _first_half(self) -> None:
        """Execute rows 1 to 9 of the table of the step (step.py). Then run the outputs of time n."""
        sim, clock = self.sim, self.sim.clock
        ending = clock.done or bool(sim.reduction.stop)
        before = sim.model.nodes.v.copy() if ending or self.samples.due(clock) else None
        step.first_half(sim)
        if clock.starved and not self.warnings:
            self.warnings.append(stops.starved(sim))
            self._notices.write(clock, messages.Log, level="warning", text=self.warnings[-1])
        if before is not None or clock.frame_due or sim.reduction.snapshot or clock.step == 0:
            self._put_out(before, ending=ending)
        self.snapshots.tell()

    def _second_half(self) -> None:
        """Execute rows 11 to 15 of the table of the step (step.py). Before row 14, further quiet steps may be
        executed.
        """
        sim, steps = self.sim, 0
        if self._requests.idle:
            wall, t, last = self._requests.next(sim.clock.t)
            wall = min(wall, self.choice.due) if self.choice is not None else wall
            steps = self._stretch.run(Until(wall, min(t, self.samples.next), last))
        self.updates += max(steps, 1) * sim.model.elements_global
        if steps:
            step.complete(sim)
        else:
            step.second_half(sim)

    def _put_out(self, before: Floats | None, *, ending: bool) -> None:
        """Run the scheduled outputs of time n.

        ``before``: (nodes, 3) v(n-1/2), if a sample is scheduled.
        """
        sim, clock = self.sim, self.sim.clock
        with sim.timers.phase("output"):
            if before is not None:
                self.samples.take(sim, before, ending=ending)
            if clock.frame_due:
                self.frames.write(sim)
            self.snapshots.look(sim, due=sim.reduction.snapshot, ending=ending)

    def _end(self) -> None:
        """Write the last report, and the reason for an early stop."""
        sim = self.sim
        self.stopped = 0 if sim.clock.done else sim.reduction.stop
        if self.stopped:
            text = stops.STOPS[self.stopped][2]
            self._notices.write(sim.clock, messages.Status, state=State.STOPPING, message=text)
        self._reports.write(sim, self.samples, self.updates)
        self.frames.report_losses(sim)

    def _rebalance(self) -> None:
        """Move tets to other ranks if the load balance requires this and the run has a further step."""
        cause = None if self.sim.clock.done else self.balance.cause(self.sim)
        if cause is not None:
            with self.sim.timers.phase("balance"):
                self.sim, moved = self.balance.move(self.sim)
            self._groups.moved(self.sim)
            self._notices.write(self.sim.clock, messages.Balance, cause=cause, **moved)

    def _checkpoint(self) -> None:
        """Write the complete state to disk as a checkpoint."""
        sim, stop, requests = self.sim, self.sim.reduction.stop, self._requests
        began, clock = time.monotonic(), sim.clock
        with sim.timers.phase("output"):
            parcel = simulation.keep(sim)
            self.balance.weigh(sim, parcel)
            samples = self.samples
            start = replace(self._start, sample=samples.number, lines=samples.lines, updates=self.updates)
            parcel.known["start"] = asdict(start)
            place, size = checkpoint.write(parcel, sim.case, self._folder, clock.step, clock.t, sim.comm)
        cause = "the run stops" if stop else ("asked for" if requests.for_checkpoint else "run.checkpoint_every")
        if sim.comm.rank == 0:
            (self._folder / layout.CHECKPOINT_REQUEST).unlink(missing_ok=True)
        requests.kept = time.monotonic()
        self._notices.write(
            clock, messages.Checkpoint, path=str(place.relative_to(self._folder)), bytes=size, cause=cause,
            seconds=requests.kept - began,
        )  # fmt: skip
