"""Reports of a run. If rank 0 requests a report in a step, the progress of the run and the loads of the ranks are
written to the journal.
"""

import logging
import math
import time
from typing import NamedTuple

from conoid.cases import messages

from ..accounts.timers import Spent, by_phase
from ..migration.balance import Balance, Window
from ..migration.groups import Groups
from ..output.counts import Counter
from ..simulation import Simulation
from .notices import Notices
from .pace import Pace
from .requests import Requests
from .samples import Samples

_LOG_EVERY = 10.0
"""Wall time between two lines of the log file, s. Chosen value."""

log = logging.getLogger("conoid.worker")


class _Load(NamedTuple):
    """Load of a rank since the last report."""

    work: dict[str, float]
    """CPU seconds of this rank in each phase."""
    others: dict[str, float]
    """Waiting times, messages and outside nodes, as a dictionary; the keys are the names in messages.Load."""
    counting: bool
    """True if the fragments must be found. The flag of rank 0 is used."""
    projected: dict[int, dict[str, float]]
    """Estimated CPU seconds in each phase, for each number of threads."""


class Reports:
    """Reports of a run. The object collects the loads of all ranks and writes the messages. Every method is
    collective.
    """

    def __init__(
        self, sim: Simulation, balance: Balance, groups: Groups, notices: Notices, counter: Counter, requests: Requests,
        updates: int,
    ) -> None:  # fmt: skip
        """``updates``: sum of the numbers of tets over all steps so far, which is the number of updates of tets."""
        self._balance, self._groups, self._notices, self._counter = balance, groups, notices, counter
        self._requests = requests
        self._step, self._updates = sim.clock.step, updates
        """Number of the step of the last report; and sum of the numbers of tets over all steps up to this report."""
        self._logged = -math.inf
        """Wall time of the last line of the log file, s."""
        self._pace = Pace(sim.clock.t, requests.reported)

    def write(self, sim: Simulation, samples: Samples, updates: int) -> None:
        """Write the progress and the loads since the last report.

        ``updates``: sum of the numbers of tets over all steps so far.
        """
        spent, clock = sim.timers.since_last(), sim.clock
        ending = clock.done or bool(sim.reduction.stop)
        with sim.timers.phase("output"):
            limiter = sim.limiter()
            loads = self._loads(sim, spent, ending=ending)
            self._count(sim, find=loads[0].counting)
        work = {name: [load.work[name] for load in loads] for name in loads[0].work}
        others = {name: [load.others[name] for load in loads] for name in loads[0].others}
        window = Window(clock.step - self._step, work)
        self._step = clock.step
        self._balance.look(window)
        if sim.reduction.groups or ending:
            self.write_groups(sim)
        if self._notices.journal is None:
            return
        now = time.monotonic()
        self._log(sim, limiter, now)
        self._write_progress(sim, samples, limiter, updates, now)
        self._notices.write(
            clock, messages.Load, phases=work, imbalance=window.imbalance, steps=window.steps,
            threads=sim.case.run.threads,
            projected={crew: by_phase([load.projected[crew] for load in loads]) for crew in spent.projected}, **others,
        )  # fmt: skip
        self._requests.reported, self._updates = now, updates

    def write_groups(self, sim: Simulation) -> None:
        """Write the loads of the groups of tets to the journal."""
        with sim.timers.phase("output"):
            self._notices.write(sim.clock, messages.Groups, **self._groups.record(sim))

    def _loads(self, sim: Simulation, spent: Spent, *, ending: bool) -> list[_Load]:
        """Return the load of each rank."""
        outside = sim.contact.outside if sim.contact is not None else 0
        sent = {"outside": outside, **spent.of_all_phases(), **sim.comm.sent.since_last()}
        counting = self._counter.due(sim, time.monotonic(), ending=ending)
        return sim.comm.share(_Load(spent.cpu, sent, counting, spent.projected))

    def _count(self, sim: Simulation, *, find: bool) -> None:
        """Write the numbers of tets, nodes and fragments, if they have changed. ``find``: True if the fragments must be
        found first.
        """
        if find:
            self._counter.find(sim)
        sim.count_nodes()
        if counted := self._counter.changed(sim, self._balance.events):
            self._notices.write(sim.clock, messages.Counts, **counted)

    def _log(self, sim: Simulation, limiter: str, now: float) -> None:
        if now - self._logged > _LOG_EVERY:
            self._logged, clock = now, sim.clock
            log.info("step %d, t %.4g s, dt %.3g s, %s", clock.step, clock.t, clock.dt, limiter)

    def _write_progress(self, sim: Simulation, samples: Samples, limiter: str, updates: int, now: float) -> None:
        clock, end = sim.clock, sim.case.run.end_time
        self._pace.add(clock.t, now)
        if samples.energy is None:
            return
        self._notices.write(
            clock, messages.Progress, end_time=end, dt=clock.dt, limiter=limiter, eta=self._pace.left(end - clock.t),
            energy=samples.energy, worst_residual=sim.ledger.worst, sampled=samples.time, probes=samples.probes(),
            updates_per_second=(updates - self._updates) / (now - self._requests.reported), parts=samples.parts,
        )  # fmt: skip
