"""Seconds per phase of the step: CPU time by the clock of this thread, and wall time inside and outside regions.

MPI polls while it waits: what a phase spends in calls that wait for other ranks counts as ``exchange``, whichever phase
it is in; the other phases are work. Kernels are loaded at their first call: that counts in no phase.

A region is a call of ``Team.run``, whose tasks all threads of the rank share. Wall time within regions is ``parallel``,
the rest but for the waiting is ``serial``: one thread works then, and the others of the rank have nothing to do.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from ..kernels.jit import cpu_time, wall_time
from ..parallel.comm import Comm
from ..parallel.team import Team

PHASES = ("elements", "exchange", "nodes", "contact", "fracture", "output", "balance", "rest")
"""``rest`` is what lies between the others."""


def worked(comm: Comm) -> float:
    """CPU time of this thread so far, but for its waiting and for the loading of kernels, s."""
    return cpu_time() - comm.waited


def by_phase(seconds: Sequence[dict[str, float]]) -> dict[str, list[float]]:
    """One number a rank, of the ``seconds`` by phase of each; nothing of no rank."""
    return {name: [each[name] for each in seconds] for name in PHASES} if seconds else {}


def _none() -> dict[str, float]:
    return dict.fromkeys(PHASES, 0.0)


def _less(now: dict[str, float], before: dict[str, float]) -> dict[str, float]:
    return {name: now[name] - before[name] for name in PHASES}


@dataclass
class Spent:
    """s by phase, and of all phases the waiting."""

    cpu: dict[str, float] = field(default_factory=_none)
    """Of this thread."""
    serial: dict[str, float] = field(default_factory=_none)
    """Wall time outside regions, but for the waiting. Where others use the cores, too, it has their time in it."""
    parallel: dict[str, float] = field(default_factory=_none)
    """Wall time within regions."""
    waiting: float = 0.0
    """CPU time in calls that wait for other ranks; ``exchange`` of ``cpu`` has it, too."""
    helped: float = 0.0
    """That the other threads have done tasks, all together."""
    projected: dict[int, dict[str, float]] = field(default_factory=dict)
    """By number of threads: ``cpu`` but for the waiting, as it would be with so many (parallel/projecting.py)."""

    def since(self, before: "Spent") -> "Spent":
        """What has been added."""
        return Spent(
            _less(self.cpu, before.cpu), _less(self.serial, before.serial), _less(self.parallel, before.parallel),
            self.waiting - before.waiting, self.helped - before.helped,
            {crew: _less(now, before.projected[crew]) for crew, now in self.projected.items()},
        )  # fmt: skip

    def of_all_phases(self) -> dict[str, float]:
        """What messages.Load has besides CPU time by phase."""
        return {
            "serial": sum(self.serial.values()), "parallel": sum(self.parallel.values()), "waiting": self.waiting,
            "helped": self.helped,
        }  # fmt: skip

    def copy(self) -> "Spent":
        """As it is now."""
        projected = {crew: dict(seconds) for crew, seconds in self.projected.items()}
        return Spent(dict(self.cpu), dict(self.serial), dict(self.parallel), self.waiting, self.helped, projected)


class Timers:
    """Accumulates time per phase."""

    def __init__(self, comm: Comm, team: Team) -> None:
        self._comm, self._team = comm, team
        self._blocks = {name: _Phase(self, name) for name in PHASES}
        self.spent = Spent()
        self.begin()

    @property
    def seconds(self) -> dict[str, float]:
        """CPU time by phase so far, s."""
        return self.spent.cpu

    def begin(self) -> None:
        """Counts ``rest`` from here on."""
        projecting = self._team.projecting
        self._spans = projecting.spans if projecting is not None else []
        for crew in projecting.crews if projecting is not None else ():
            self.spent.projected.setdefault(crew, _none())["rest"] = 0.0
        self._phase = "rest"
        self._cpu, self._wall = cpu_time(), wall_time()
        self._waited, self._within = self._comm.waited, self._team.within
        for each in (self.spent.cpu, self.spent.serial, self.spent.parallel):
            each["rest"] = 0.0
        self._reported, self._helped = self.spent.copy(), self._team.helped

    def phase(self, name: str) -> "_Phase":
        """Adds the time of the block to a phase; a phase within it takes its own time out."""
        return self._blocks[name]

    def switch(self, name: str) -> str:
        """Ends the present phase, which it returns, and begins another one. Each change of the phase reads the clock of
        the thread, a call of the system of up to 1 us: a step makes as few as it can.
        """
        cpu, wall, waited, within = cpu_time(), wall_time(), self._comm.waited, self._team.within
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

    def _project(self, phase: str, serial: float) -> None:
        """Adds to a phase the CPU time outside regions, and what each crew would take within them."""
        assert self._team.projecting is not None
        spans = self._team.projecting.spans
        for seconds, now, before in zip(self.spent.projected.values(), spans, self._spans, strict=True):
            seconds[phase] += serial + now - before
        self._spans = spans

    def since_last(self) -> Spent:
        """What was spent since the last call; asked between phases."""
        self.switch(self._phase)
        self.spent.helped = self._team.helped - self._helped
        added = self.spent.since(self._reported)
        self._reported = self.spent.copy()
        return added


class _Phase:
    """Blocks of the step, which may lie within each other; two dozen in every step, too many for generators."""

    __slots__ = ("_name", "_outer", "_timers")

    def __init__(self, timers: Timers, name: str) -> None:
        self._timers, self._name = timers, name
        self._outer: list[str] = []

    def __enter__(self) -> None:
        self._outer.append(self._timers.switch(self._name))

    def __exit__(self, *_: object) -> None:
        self._timers.switch(self._outer.pop())
