"""Estimate of the time of a team: the greedy list schedule in plain Python, and the timed tasks of parallel regions."""

import numpy as np
import pytest

from conoid.worker.parallel import projecting
from conoid.worker.parallel.arguments import Arguments
from conoid.worker.parallel.projecting import Costs, Projecting, crews_of
from conoid.worker.parallel.team import Team

from .counted import KINDS, count


def schedule(took: list[int], threads: int, begins: list[int]) -> int:
    """Returns the end of the last task; each task goes to the thread that is free first."""
    free, last = begins[:threads], 0
    for each in took:
        first = free.index(min(free))
        free[first] += each
        last = max(last, free[first])
    return last


@pytest.mark.parametrize("asleep", [False, True])
def test_tasks_go_to_the_thread_that_is_free_first(asleep: bool) -> None:
    took = np.random.default_rng(7).integers(1, 90, 40).tolist()
    crews, free = np.array([1, 2, 5, 16]), np.zeros((4, 17), np.int64)
    projecting._ready(asleep, np.array([3, 11, 20]), crews, free)
    for each in took:
        projecting._give(each, crews, free)
    woken = [11, *[20] * 2, *[40] * 4, *[60] * 8, 80]  # each thread wakes two more threads
    begins = woken if asleep else [0] * 16
    assert [int(free[c, n]) for c, n in enumerate(crews)] == [schedule(took, int(n), begins) for n in crews]


def test_teams_of_powers_of_two_and_the_whole_one() -> None:
    assert [crews_of(n) for n in (1, 2, 6, 16)] == [[1], [1, 2], [1, 2, 4, 6], [1, 2, 4, 8, 16]]


def test_timed_tasks_are_done_once_and_more_threads_never_take_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(projecting, "measured", lambda: Costs(turn=0, call=0, wake=0))
    done, team, table = np.zeros(600_000, np.int64), Team(6), Arguments(*KINDS)
    team.projecting = made = Projecting(6)
    tasks = np.column_stack([np.arange(0, 600_000, 10_000), np.arange(10_000, 610_000, 10_000)])
    team.run(count, table.set(done), tasks, np.array([0, 1, 30, 30, 60]))
    assert (done == 1).all()
    assert (made.regions, made.colours, made.tasks) == (1, 4, 60)
    one, two, four, six = made.spans
    assert team.within >= one > two > four > six > one / 6
    assert team.helped == 0.0


def test_a_colour_costs_its_turn_and_sleeping_threads_their_call(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(projecting, "measured", lambda: Costs(turn=10**9, call=10**10, wake=0))
    made, table = Projecting(2), Arguments(*KINDS)
    two = np.array([[0, 1], [1, 2]])
    made.run(count, table.set(np.zeros(2, np.int64)), two, np.array([0, 1, 2]))
    assert made.spans[1] < 0.5, "colours of one task are not shared"
    made.run(count, table.set(np.zeros(2, np.int64)), two, np.array([0, 2]))
    assert 0.5 < made.spans[1] <= 1.5, "the second thread has both tasks done while the first one calls it"


def test_what_it_costs_to_share_is_measured() -> None:
    costs = projecting.measured()
    assert min(costs.turn, costs.call, costs.wake) >= 0
