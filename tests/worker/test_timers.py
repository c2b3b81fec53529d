"""Each second of the step loop is in one phase, as CPU time and as wall time inside or outside parallel regions."""

from dataclasses import dataclass

import numpy as np
import pytest

from conoid.worker.accounts import timers
from conoid.worker.accounts.timers import Timers
from conoid.worker.kernels.jit import njit
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.parallel.team import TASK, team


@dataclass
class Team:
    """A team with the attributes that timers read."""

    within: float = 0.0
    helped: float = 0.0
    projecting: None = None


class Clocks:
    """CPU time and wall time that the test advances."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.cpu, self.wall, self.comm, self.team = 0.0, 0.0, SerialComm(), Team()
        monkeypatch.setattr(timers, "cpu_time", lambda: self.cpu)
        monkeypatch.setattr(timers, "wall_time", lambda: self.wall)
        self.timers = Timers(self.comm, self.team)  # type: ignore[arg-type]

    def work(self, cpu: float, wall: float | None = None, region: float = 0.0, wait: float = 0.0) -> None:
        self.cpu += cpu
        self.wall += cpu if wall is None else wall
        self.team.within += region
        self.comm.waited += wait


@pytest.fixture
def clocks(monkeypatch: pytest.MonkeyPatch) -> Clocks:
    return Clocks(monkeypatch)


def reported(seconds: dict[str, float]) -> dict[str, float]:
    return {name: value for name, value in seconds.items() if value}


def test_an_inner_phase_takes_its_own_time_out(clocks: Clocks) -> None:
    clocks.work(4.0)
    clocks.timers.begin()
    clocks.work(0.25)
    with clocks.timers.phase("nodes"):
        clocks.work(1.0)
        with clocks.timers.phase("contact"):
            clocks.work(8.0)
        clocks.work(2.0)
    spent = clocks.timers.since_last()
    assert reported(spent.cpu) == reported(spent.serial) == {"nodes": 3.0, "contact": 8.0, "rest": 0.25}


def test_wall_time_lies_inside_regions_or_outside(clocks: Clocks) -> None:
    with clocks.timers.phase("elements"):
        clocks.work(2.0, wall=3.0, region=2.5)
    clocks.team.helped += 1.5
    spent = clocks.timers.since_last()
    assert reported(spent.cpu) == {"elements": 2.0}
    assert reported(spent.parallel) == {"elements": 2.5}
    assert reported(spent.serial) == {"elements": 0.5}
    assert spent.helped == 1.5
    assert clocks.timers.since_last() == timers.Spent()


def test_waiting_for_other_ranks_is_exchange_and_is_not_serial(clocks: Clocks) -> None:
    with clocks.timers.phase("contact"):
        clocks.work(5.0, region=1.0, wait=3.0)
    spent = clocks.timers.since_last()
    assert reported(spent.cpu) == {"contact": 2.0, "exchange": 3.0}
    assert reported(spent.serial) == reported(spent.parallel) == {"contact": 1.0}
    assert spent.waiting == 3.0


@njit(TASK, cache=False)
def count(table, first, end, thread):  # type: ignore[no-untyped-def]
    """Does some work."""
    total = 0
    for k in range(first, end):
        total += k % 7
    if total < 0:
        raise ValueError


@pytest.mark.parametrize("threads", [1, 2])
def test_regions_are_timed_with_any_number_of_threads(threads: int) -> None:
    some, tasks = Timers(SerialComm(), team(threads)), np.array([[0, 10**6], [10**6, 10**7]])
    team(threads).run(count, 0, tasks, np.array([0, 2]))
    some.begin()
    with some.phase("elements"):
        team(threads).run(count, 0, tasks, np.array([0, 2]))
    spent = some.since_last()
    assert spent.parallel["elements"] > 0.0
    assert spent.serial["elements"] >= 0.0
    assert spent.helped <= (threads - 1) * spent.parallel["elements"]
