"""Seconds in each phase of the step: CPU time of this thread, and wall time inside and outside of parallel regions.

MPI uses CPU time while it waits. The time in calls that wait for other ranks counts as ``exchange``; the time of the
other phases is work. The time in which kernels are loaded at their first call is in no phase. A parallel region is a
call of ``Team.run``; all threads of the rank share its tasks. The wall time in parallel regions is ``parallel``. The
wall time outside of them, without the waiting, is ``serial``: in this time one thread of the rank works and the other
threads are idle. A single rank reads the CPU time only for reports, and divides it among the phases in proportion to
their wall times.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from ..kernels.jit import cpu_time, wall_time
from ..parallel.comm import Comm
from ..parallel.team import Team

PHASES = ("elements", "exchange", "nodes", "contact", "fracture", "output", "balance", "rest")
"""Phases of the step. The phase ``rest`` is the time between the other phases."""


def worked(comm: Comm) -> float:
    """Return the CPU time of this thread so far, s, without the waiting and without the loading of kernels."""
    return cpu_time() - comm.waited


def by_phase(seconds: Sequence[dict[str, float]]) -> dict[str, list[float]]:
    """Return a dictionary with a list for each phase, which has one number for each rank; {} if there are no ranks.
    ``seconds``: for each rank, its seconds in each phase.
    """
    return {name: [each[name] for each in seconds] for name in PHASES} if seconds else {}


def _none() -> dict[str, float]:
    return dict.fromkeys(PHASES, 0.0)


def _less(now: dict[str, float], before: dict[str, float]) -> dict[str, float]:
    return {name: now[name] - before[name] for name in PHASES}


@dataclass
class Spent:
    """Seconds in each phase, and the waiting time of all phases together."""

    cpu: dict[str, float] = field(default_factory=_none)
    """CPU time of this thread in each phase."""
    serial: dict[str, float] = field(default_factory=_none)
    """Wall time outside of parallel regions without the waiting, in each phase. The wall time includes the time of
    other programs on the same core."""
    parallel: dict[str, float] = field(default_factory=_none)
    """Wall time in parallel regions, in each phase."""
    waiting: float = 0.0
    """CPU time in calls that wait for other ranks; this time is also part of ``exchange`` of ``cpu``."""
    helped: float = 0.0
    """Time that the other threads of the rank have spent in tasks, summed over these threads."""
    projected: dict[int, dict[str, float]] = field(default_factory=dict)
    """Estimate of ``cpu`` without the waiting; the keys are numbers of threads (parallel/projecting.py)."""

    def since(self, before: "Spent") -> "Spent":
        """Return the difference between this state and an earlier state."""
        return Spent(
            _less(self.cpu, before.cpu), _less(self.serial, before.serial), _less(self.parallel, before.parallel),
            self.waiting - before.waiting, self.helped - before.helped,
            {crew: _less(now, before.projected[crew]) for crew, now in self.projected.items()},
        )  # fmt: skip

    def of_all_phases(self) -> dict[str, float]:
        """Return the sums over all phases, for the message messages.Load."""
        return {
            "serial": sum(self.serial.values()), "parallel": sum(self.parallel.values()), "waiting": self.waiting,
            "helped": self.helped,
        }  # fmt: skip

    def copy(self) -> "Spent":
        """Return a copy of the times."""
        projected = {crew: dict(seconds) for crew, seconds in self.projected.items()}
        return Spent(dict(self.cpu), dict(self.serial), dict(self.parallel), self.waiting, self.helped, projected)


class Timers:
    """Time in each phase, summed over the run so far."""

    def __init__(self, comm: Comm, team: Team) -> None:
        self._comm, self._team = comm, team
        self._alone = comm.size == 1
        self._blocks = {name: _Phase(self, name) for name in PHASES}
        self.spent = Spent()
        self.begin()

    @property
    def seconds(self) -> dict[str, float]:
        """CPU time so far in each phase, s."""
        return self.spent.cpu

    def begin(self) -> None:
        """Start to measure time, in the phase ``rest``."""
        projecting = self._team.projecting
        self._spans = projecting.spans if projecting is not None else []
        for crew in projecting.crews if projecting is not None else ():
            self.spent.projected.setdefault(crew, _none())["rest"] = 0.0
        self._phase = "rest"
        self._cpu, self._wall = cpu_time(), wall_time()
        self._settled = self._cpu
        self._waited, self._within = self._comm.waited, self._team.within
        for each in (self.spent.cpu, self.spent.serial, self.spent.parallel):
            each["rest"] = 0.0
        self._reported, self._helped = self.spent.copy(), self._team.helped

    def phase(self, name: str) -> "_Phase":
        """Return a context that adds the time of its block to a phase. If another phase is used inside of the block,
        its time is subtracted.
        """
        return self._blocks[name]

    def switch(self, name: str) -> str:
        """End the present phase, begin another phase, and return the phase that ended.

        With several ranks each change of phase reads the clock of the thread, a system call of 1 to 2 us. Therefore a
        step changes the phase as rarely as possible.
        """
        wall, waited, within = wall_time(), self._comm.waited, self._team.within
        cpu = self._cpu_at(wall)
        ended, spent = self._phase, self.spent
        idle, inside = waited - self._waited, within - self._within
        spent.cpu[ended] += cpu - self._cpu - idle
        spent.serial[ended] += wall - self._wall - inside - idle
        if inside:
            spent.parallel[ended] += inside
        if idle:
            spent.cpu["exchange"] += idle
            spent.waiting += idle
        if spent.projected:
            self._project(ended, cpu - self._cpu - idle - inside)
        self._phase, self._cpu, self._wall, self._waited, self._within = name, cpu, wall, waited, within
        return ended

    def divide(self, inside: dict[str, float], outside: dict[str, float]) -> None:
        """End the present phase, in which a program of several phases ran, and divide its time among these phases.
        ``inside``, ``outside``: wall time of each phase of the program in parallel regions and outside of them, s. The
        rest of the time is added to the present phase.
        """
        wall, spent = wall_time(), self.spent
        cpu = self._cpu_at(wall)
        of_program = sum(inside.values()) + sum(outside.values())
        passed = max(wall - self._wall, of_program)
        outside = {**outside, self._phase: outside.get(self._phase, 0.0) + passed - of_program}
        share = (cpu - self._cpu) / passed if passed > 0.0 else 0.0
        for seconds, of in ((inside, spent.parallel), (outside, spent.serial)):
            for name, added in seconds.items():
                of[name] += added
                spent.cpu[name] += share * added
        self._cpu, self._wall, self._within = cpu, wall, self._team.within

    def _cpu_at(self, wall: float) -> float:
        """Return the CPU time of this thread at the wall time ``wall``, s. With one rank, which never waits, the CPU
        time is assumed to advance like the wall time until ``_settle`` corrects it.
        """
        return self._cpu + wall - self._wall if self._alone else cpu_time()

    def _settle(self) -> None:
        """Scale the CPU times since the last report, so that their sum is the measured CPU time."""
        measured = cpu_time()
        assumed = self._cpu - self._settled
        share = (measured - self._settled) / assumed if assumed > 0.0 else 0.0
        for name, before in self._reported.cpu.items():
            self.spent.cpu[name] = before + share * (self.spent.cpu[name] - before)
        self._cpu = self._settled = measured

    def _project(self, phase: str, serial: float) -> None:
        """Add to a phase the CPU time outside of parallel regions, and the time in parallel regions that is estimated
        for each number of threads.
        """
        assert self._team.projecting is not None
        spans = self._team.projecting.spans
        for seconds, now, before in zip(self.spent.projected.values(), spans, self._spans, strict=True):
            seconds[phase] += serial + now - before
        self._spans = spans

    def since_last(self) -> Spent:
        """Return the time since the last call of this method, s. The method must be called between phases."""
        self.switch(self._phase)
        if self._alone:
            self._settle()
        self.spent.helped = self._team.helped - self._helped
        added = self.spent.since(self._reported)
        self._reported = self.spent.copy()
        return added


class _Phase:
    """Context of a phase. The context is a class, because a step enters two dozen contexts, and a context made from a
    generator takes longer.
    """

    __slots__ = ("_name", "_outer", "_timers")

    def __init__(self, timers: Timers, name: str) -> None:
        self._timers, self._name = timers, name
        self._outer: list[str] = []

    def __enter__(self) -> None:
        self._outer.append(self._timers.switch(self._name))

    def __exit__(self, *_: object) -> None:
        self._timers.switch(self._outer.pop())
