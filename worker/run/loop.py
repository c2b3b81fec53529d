"""The run: steps, and whoever is due to look at them. Signals, wall time and the ledger end it in good order."""

import gc
import logging
import math
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases import messages
from conoid.cases.messages import Energy, PartEnergy
from conoid.cases.output import layout
from conoid.cases.run import Cause, State

from .. import simulation, step
from ..accounts.timers import by_phase
from ..clock import SLOWED
from ..migration import checkpoint
from ..migration.balance import Balance, Window
from ..migration.groups import Groups
from ..model.state import Floats
from ..output import frames
from ..output.counts import Counter
from ..output.damage import damage
from ..output.history import History
from ..output.journal import Journal
from ..output.losses import Losses
from ..output.wanted import wanted
from ..parallel.choice import Choice
from ..simulation import Simulation
from ..snapshots.stage import Snapshots
from .asking import CANCELLED, MAX_STEPS, WALL_TIME, Asking
from .pace import Pace
from .signals import Signals

STOPS = {
    CANCELLED: (State.CANCELLED, Cause.CANCELLED, "stopped on request"),
    WALL_TIME: (State.TIMED_OUT, Cause.WALLTIME, "run.max_wall_time is used up"),
    MAX_STEPS: (State.TIMED_OUT, Cause.STEPS, "run.max_steps is used up before run.end_time"),
}
"""State, cause and words for each reason to stop early."""
_LOG_EVERY = 10.0
"""s of wall time between two lines of the log. Chosen."""

log = logging.getLogger("conoid.worker")


@dataclass(frozen=True)
class Start:
    """What is known when the first step begins, and what a resumed run has besides."""

    elements: int
    nodes: int
    thick: list[list[list[float]]]
    """See reference.thicknesses."""
    sample: int = 0
    """Lines of the history that have been due."""
    updates: int = 0
    """Tets times steps so far."""
    resumed: bool = False
    warnings: tuple[str, ...] = ()
    """See Simulation."""


class Loop:
    """Advances a simulation to its end and runs the outputs that are due. ``journal`` and ``history``: on rank 0."""

    def __init__(
        self, sim: Simulation, folder: Path, journal: Journal | None, history: History | None, signals: Signals,
        balance: Balance, start: Start,
    ) -> None:  # fmt: skip
        """``start``: what is known when the first step begins."""
        self.sim, self.balance = sim, balance
        self.energy: Energy | None = None
        self._parts: dict[str, PartEnergy] = {}
        self.measured: list[float] = []
        """Of the probes, at the last line of the history."""
        self._sampled: float | None = None
        """Time of that line, s."""
        self.stopped = 0
        self.warnings: list[str] = []
        """What the steps have given reason for; equal on all ranks."""
        self.lost: list[str] = []
        """What somebody has removed of the run's files; on rank 0."""
        self._folder, self._journal, self._history = folder, journal, history
        self._start, self._sample = start, start.sample
        self._sample_time = start.sample * sim.case.run.end_time / sim.case.run.samples
        """When the next line of the history is due, s."""
        began = time.monotonic()
        self.updates = self._reported_updates = start.updates
        """Tets times steps so far."""
        self._reported_step, self._logged = sim.clock.step, -math.inf
        self._pace, self._counter = Pace(sim.clock.t, began), Counter()
        self._groups = Groups(sim, balance.trigger.cost)
        self._asking = Asking(sim.case, folder, signals, self._groups, began)
        self.snapshots = Snapshots(sim, folder, journal)
        self._losses = Losses(folder) if journal is not None else None
        self.choice: Choice | None = None
        """Of the threads of this rank; None: all are used."""

    def run(self) -> None:
        """Steps until the end time, or until a reason to stop. Raises PhysicsError."""
        gc.collect()
        gc.freeze()  # else Python looks through all that numba keeps, 0.1 s, in a step of each rank while others wait
        self.sim.timers.begin()
        self.sim.comm.sent.since_last()
        if not self._start.resumed:
            step.prepare(self.sim)
            self._number()
        self._record()
        while True:
            self._attend()
            sim = self.sim
            self._first_half()
            if sim.clock.done or sim.reduction.stop:
                self.stopped = 0 if sim.clock.done else sim.reduction.stop
                if self.stopped:
                    self._tell(messages.Status, state=State.STOPPING, message=STOPS[self.stopped][2])
                self._report()
                self._tell_losses()
                return
            self.updates += sim.model.elements_global
            step.second_half(sim)
            if self.choice is not None and (said := self.choice.step()):
                self._tell(messages.Log, level="info", text=said)

    def _number(self) -> None:
        """Numbers the fragments of the start, where no frame does."""
        record, run = self.sim.record, self.sim.case.run
        if record is not None and not run.frames:
            record.look()
            record.number()

    def _attend(self) -> None:
        """What the ranks have agreed on for this step, and what is to be agreed on for the next one."""
        if self.sim.reduction.report:
            self._report()
        if self.sim.comm.size > 1:
            self._move()
        if self.sim.reduction.checkpoint or self.sim.reduction.stop:
            self._checkpoint()
        if self._asking.due(self.sim.clock, now := time.monotonic()):
            self._asking.propose(self.sim, self.balance, self.snapshots, now)

    def _first_half(self) -> None:
        sim, clock = self.sim, self.sim.clock
        ending = clock.done or bool(sim.reduction.stop)
        before = sim.model.nodes.v.copy() if ending or clock.t >= self._sample_time else None
        step.first_half(sim)
        if clock.starved and not self.warnings:
            self._warn_of_steps()
        if before is not None or clock.frame_due or sim.reduction.snapshot or clock.step == 0:
            self._put_out(before, ending=ending)
        self.snapshots.tell()

    def _put_out(self, before: Floats | None, *, ending: bool) -> None:
        """What is due at time n."""
        sim, clock = self.sim, self.sim.clock
        with sim.timers.phase("output"):
            if before is not None:
                self._look(before, ending=ending)
            if clock.frame_due:
                self._write_frame()
            self.snapshots.look(sim, due=sim.reduction.snapshot, ending=ending)

    def _fallen(self, so_far: str) -> str:
        """That the stable step has fallen ``so_far``, which tet holds it down, and what helps; all ranks take part."""
        clock = self.sim.clock
        return (
            f"the stable step has fallen to {clock.stable:.2g} s, {so_far} ({self.sim.limiter()}): about "
            f"{clock.steps_left:.2g} steps are left; erosion.time_step lets go of such tets"
        )

    def _warn_of_steps(self) -> None:
        """All ranks take part."""
        clock = self.sim.clock
        text = self._fallen(f"below 1/1000 of the first, at {clock.t:.3g} s") + ", run.max_steps ends the run"
        self.warnings.append(text)
        self._tell(messages.Log, level="warning", text=text)

    def reason(self) -> str:
        """Why it has stopped early; of what was used up, when, and how far the stable step had fallen, if that was why.
        All ranks take part.
        """
        clock, text = self.sim.clock, STOPS[self.stopped][2]
        if self.stopped == CANCELLED:
            return text
        text += f", at {clock.t:.3g} s of {self.sim.case.run.end_time:.3g} s"
        slow = clock.share < SLOWED
        return f"{text}; {self._fallen(f'1/{1.0 / clock.share:.0f} of the first')}" if slow else text

    def _move(self) -> None:
        """Tets to other ranks, when that is due and a step is left."""
        cause = None if self.sim.clock.done else self.balance.cause(self.sim)
        if cause is not None:
            with self.sim.timers.phase("balance"):
                self.sim, told = self.balance.move(self.sim)
            self._groups.moved(self.sim)
            self._tell(messages.Balance, cause=cause, **told)

    def _checkpoint(self) -> None:
        """The complete state to disk, when that is due."""
        sim, stop = self.sim, self.sim.reduction.stop
        began, clock = time.monotonic(), sim.clock
        with sim.timers.phase("output"):
            parcel = simulation.keep(sim)
            self.balance.weigh(sim, parcel)
            parcel.known["start"] = asdict(replace(self._start, sample=self._sample, updates=self.updates))
            place, size = checkpoint.write(parcel, sim.case, self._folder, clock.step, clock.t, sim.comm)
        cause = "the run stops" if stop else ("asked for" if self._asking.for_checkpoint else "run.checkpoint_every")
        if sim.comm.rank == 0:
            (self._folder / layout.CHECKPOINT_REQUEST).unlink(missing_ok=True)
        self._asking.kept = time.monotonic()
        self._tell(
            messages.Checkpoint, path=str(place.relative_to(self._folder)), bytes=size, cause=cause,
            seconds=self._asking.kept - began,
        )  # fmt: skip

    def _look(self, before: Floats, *, ending: bool) -> None:
        """A line of the history: ledger, momenta and probes at time n; ``ending``: after the last step."""
        sim, clock = self.sim, self.sim.clock
        self.energy, self._parts, self._sampled = sim.ledger.close(before), sim.ledger.parts, clock.t
        if ending:
            step.end(sim, before)
        if sim.crushing is not None:
            sim.crushing.count()
        probes = sim.probes.measure(step.between(sim, before) if sim.probes.sums and not ending else None)
        self.measured = probes.tolist()
        self._sample = int(clock.t * sim.case.run.samples / sim.case.run.end_time) + 1
        self._sample_time = self._sample * sim.case.run.end_time / sim.case.run.samples
        limiter = sim.limiter()
        if self._history is not None:
            parts = [value for part in self._parts.values() for value in msgspec.structs.astuple(part)]
            extra = [*sim.ledger.momentum, *sim.ledger.angular_momentum, *parts, *probes]
            self._history.write(clock.step, clock.t, clock.dt, limiter, self.energy, extra)
        sim.ledger.require(sim.case.run, sim.case.numerics.dt_safety, f"at step {clock.step}, t = {clock.t:.6g} s")

    def _tell_losses(self) -> None:
        for text in self._losses.found() if self._losses is not None else ():
            self.lost.append(text)
            self._tell(messages.Log, level="warning", text=text)

    def _write_frame(self) -> None:
        sim, clock, index = self.sim, self.sim.clock, self.sim.clock.frame
        sim.count_nodes()
        self._tell_losses()
        cohesion = sim.fracture.cohesion if sim.fracture is not None else None
        damaged = damage(sim.case, sim.model, cohesion, sim.comm)
        more = wanted(sim, index)
        if sim.record is None:
            path = frames.write(self._folder, index, clock.t, sim.model, sim.comm, None, damaged, more)
        else:
            self._counter.find(sim)
            sim.record.number()
            path = frames.write(self._folder, index, clock.t, sim.model, sim.comm, sim.record.numbers, damaged, more)
            sim.record.write(self._folder, index, clock.t)
        self._tell_losses()  # what was written is known from now on
        clock.frame += 1
        if path is not None and self._journal is not None and index not in self._journal.frames:
            self._journal.frames.add(index)
            self._tell(messages.Frame, index=index, path=path)

    def _report(self) -> None:
        """Progress and loads to the journal; all ranks take part."""
        sim, clock = self.sim, self.sim.clock
        spent = sim.timers.since_last()
        with sim.timers.phase("output"):
            limiter = sim.limiter()
            outside = sim.contact.outside if sim.contact is not None else 0
            sent = {"outside": outside, **spent.of_all_phases(), **sim.comm.sent.since_last()}
            ending = clock.done or bool(sim.reduction.stop)
            counting = self._counter.due(sim, time.monotonic(), ending=ending)
            loads = sim.comm.share((spent.cpu, sent, counting, spent.projected))
            if loads[0][2]:
                self._counter.find(sim)
            sim.count_nodes()
            if counted := self._counter.changed(sim, self.balance.events):
                self._tell(messages.Counts, **counted)
        work, told = ({name: [load[i][name] for load in loads] for name in loads[0][i]} for i in (0, 1))
        projected = {crew: by_phase([load[3][crew] for load in loads]) for crew in spent.projected}
        window = Window(clock.step - self._reported_step, work)
        self._reported_step = clock.step
        self.balance.look(window)
        if sim.reduction.groups or ending:
            self._record()
        if self._journal is None:
            return
        now = time.monotonic()
        if now - self._logged > _LOG_EVERY:
            self._logged = now
            log.info("step %d, t %.4g s, dt %.3g s, %s", clock.step, clock.t, clock.dt, limiter)
        elapsed = now - self._asking.reported
        self._pace.add(clock.t, now)
        if self.energy is not None:
            self._tell(
                messages.Progress, end_time=sim.case.run.end_time, dt=clock.dt, limiter=limiter,
                eta=self._pace.left(sim.case.run.end_time - clock.t), energy=self.energy,
                worst_residual=sim.ledger.worst, sampled=self._sampled, probes=self._probes(),
                updates_per_second=(self.updates - self._reported_updates) / elapsed, parts=self._parts,
            )  # fmt: skip
        self._tell(
            messages.Load, phases=work, imbalance=window.imbalance, steps=window.steps, threads=sim.case.run.threads,
            projected=projected, **told,
        )  # fmt: skip
        self._asking.reported, self._reported_updates = now, self.updates

    def _probes(self) -> dict[str, float | None]:
        names = (probe.name for probe in self.sim.case.probes)
        return {name: None if math.isnan(value) else value for name, value in zip(names, self.measured, strict=True)}

    def _record(self) -> None:
        """Loads of groups to the journal; all ranks take part."""
        with self.sim.timers.phase("output"):
            self._tell(messages.Groups, **self._groups.record(self.sim))

    def _tell(self, kind: type[messages.Message], **fields: Any) -> None:
        if self._journal is not None:
            self._journal.write(kind, self.sim.clock.step, self.sim.clock.t, **fields)
