"""Choice of the number of threads: only as many threads as shorten the parallel regions, with one message if this
number is below the given number.
"""

import numpy as np
import pytest

from conoid.worker.parallel import choice, projecting
from conoid.worker.parallel.arguments import Arguments
from conoid.worker.parallel.choice import Choice, best_crew
from conoid.worker.parallel.projecting import Costs
from conoid.worker.parallel.team import Team

from .counted import KINDS, count


@pytest.mark.parametrize(
    ("spans", "threads"), [([8.0, 4.0, 2.0, 1.0], 16), ([8.0, 8.5, 9.0, 9.5], 1), ([8.0, 4.1, 4.05, 4.04], 2),
                           ([8.0, 8.1, 7.0, 6.9], 8)],
)  # fmt: skip
def test_more_threads_are_taken_where_they_are_worth_it(spans: list[float], threads: int) -> None:
    assert best_crew([1, 2, 8, 16], spans) == threads


def steps(team: Team, chosen: Choice, number: int) -> tuple[list[str], "np.ndarray"]:
    """Returns the messages after the given number of steps of a parallel region of twelve tasks, and how often each
    task was done.
    """
    done, table = np.zeros(120_000, np.int64), Arguments(*KINDS)
    tasks = np.column_stack([np.arange(0, 120_000, 10_000), np.arange(10_000, 130_000, 10_000)])
    reports = []
    for _ in range(number):
        team.run(count, table.set(done), tasks, np.array([0, 12]))
        reports.append(chosen.step())
    return [text for text in reports if text], done


def test_a_scene_that_is_too_small_for_threads_is_reported_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(projecting, "measured", lambda: Costs(turn=10**8, call=0, wake=10**7))
    monkeypatch.setattr(choice, "_AGAIN", 0.0)
    team = Team(4)
    reports, done = steps(team, Choice(team), 40)
    assert len(reports) == 1
    assert reports[0].startswith("the scene is too small for 4 threads; the run uses 1. A colour has 12.0 tasks of ")
    assert "the sharing of a colour takes 100 ms, the waking of a thread 10.0 ms" in reports[0]
    assert team.most == 1
    assert (done == 40).all()


def test_a_scene_that_is_large_enough_keeps_its_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(projecting, "measured", lambda: Costs(turn=0, call=0, wake=0))
    team = Team(4)
    chosen = Choice(team)
    reports, done = steps(team, chosen, 40)
    assert reports == []
    assert (team.most, team.projecting) == (4, None)
    assert (done == 40).all()


def test_few_threads_are_tried_again_and_all_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    costs = [Costs(turn=10**8, call=0, wake=0)]
    monkeypatch.setattr(projecting, "measured", lambda: costs[0])
    monkeypatch.setattr(choice, "_AGAIN", 0.0)
    team = Team(4)
    chosen = Choice(team)
    steps(team, chosen, 20)
    assert team.most == 1
    while team.projecting is not None:
        steps(team, chosen, 1)
    chosen._costs = None  # as in a parallel region with more work
    costs[0] = Costs(turn=0, call=0, wake=0)
    steps(team, chosen, 30)
    assert team.most == 4
