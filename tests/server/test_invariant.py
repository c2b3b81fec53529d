"""At any fault, every open run is watched, waits in the queue or has a timer, and ends in a true state.

Tests call the turns of a supervisor without a thread. A fault occurs at each place at which the supervisor writes, at
one place after the other. At each place at which the supervisor writes, the supervisor is also killed, and another
supervisor continues.
"""

import errno
import os
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import pytest

from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.server.runs import folder, retries
from conoid.server.runs.events import CancelAsked, Run

from .faulty import CrashError, House, Plan, faults, fsync, write

TURNS = 400


@dataclass(frozen=True)
class Scenario:
    """Course of a run: the end of the run, the turn in which the owner cancels the run (-1: never), and the expected
    state.
    """

    ends: str
    cancel: int
    state: State
    cause: str | None = None
    refuses: bool = False


SCENARIOS = {
    "succeeds": Scenario("succeeded", -1, State.SUCCEEDED),
    "cancelled in the queue": Scenario("never", 0, State.CANCELLED, "cancelled"),
    "cancelled while it runs": Scenario("never", 6, State.CANCELLED, "cancelled"),
    "killed from outside": Scenario("killed", -1, State.LOST, "node"),
    "cannot be launched": Scenario("never", -1, State.FAILED, "launch", refuses=True),
}
ERRORS = {
    "no space": (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), False),
    "disk error": (OSError(errno.EIO, os.strerror(errno.EIO)), False),
    "no descriptor": (OSError(errno.EMFILE, os.strerror(errno.EMFILE)), True),
    "killed": (CrashError(), False),
}

QUICK = {
    ("succeeds", "no space", 1),
    ("succeeds", "killed", 1),
    ("cancelled while it runs", "no descriptor", 1),
    ("cannot be launched", "no space", 3),
}


class Home(House):
    """Server on which the tests of the faults run."""

    def live(self, run: Run, scenario: Scenario, plan: Plan) -> None:
        """Calls turns until the run has ended, and checks after each turn the conditions that must always hold."""
        for turn in range(TURNS):
            self.supervisor._inbox.put(None)
            try:
                with faults(plan):
                    if turn >= scenario.cancel >= 0:
                        self.supervisor._apply(run.id, CancelAsked())
                    self.supervisor._turn()
            except CrashError:
                self.supervisor = self.begin()
            assert self.supervisor.stranded() == []
            assert sum(puppet.alive for puppet in self.puppets.made) <= 1
            if self.supervisor.current(run.id) is None:
                return
        raise AssertionError(f"the run is still {self.supervisor.current(run.id)}")


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Home]:
    made = Home(tmp_path_factory.mktemp("house") / "runs")
    yield made
    made.store.close()


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retries, "_AGAIN", 0.0)
    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(os, "write", write)


@pytest.mark.parametrize(
    ("name", "error", "times"),
    [
        pytest.param(*lives, marks=[] if lives in QUICK else pytest.mark.slow)
        for lives in product(SCENARIOS, ERRORS, (1, 3))
    ],
)
def test_no_fault_at_any_place_leaves_a_run_unfinished(house: Home, name: str, error: str, times: int) -> None:
    scenario, (raised, reads) = SCENARIOS[name], ERRORS[error]
    place, fired = 0, 1
    while fired:
        house.puppets.ends, house.puppets.refuses, house.puppets.made = scenario.ends, scenario.refuses, []
        run = house.accept()
        plan = Plan(house.settings.runs, place, raised, times, reads)
        house.live(run, scenario, plan)
        row, fired = house.store.get(run.id), plan.fired
        assert row is not None
        assert (row.state, row.cause) == (scenario.state, scenario.cause), f"place {place}: {row.message}"
        assert folder.run(house.settings.runs / run.id).state is scenario.state, f"place {place}: the journal"
        ended = folder.outcome(house.settings.runs / run.id)
        assert ended is not None
        assert ended.state == scenario.state, f"place {place}: {layout.OUTCOME}"
        assert len(house.puppets.made) <= 2 + times, f"place {place}: too many launches"
        place += 1
    assert place > 5, "a life has more places than that"
