"""Criteria for a new decomposition: tests with computed loads."""

import pytest

from conoid.cases.estimates.balancing import Guard, Stretch, Trigger, imbalance, lost
from conoid.cases.model.schema import Balance

EVEN, ODD = [2.0, 2.0], [3.0, 1.0]
"""Loads of two ranks, s per step."""


def test_what_is_lost_and_the_imbalance() -> None:
    assert (lost([4.0, 1.0, 1.0]), imbalance([4.0, 1.0, 1.0])) == (2.0, 2.0)
    assert (lost(EVEN), imbalance(EVEN)) == (0.0, 1.0)
    assert imbalance([0.0, 0.0]) == 1.0


def test_measured_cuts_when_more_is_lost_than_a_cut_costs() -> None:
    """Each step loses 1 s, and a decomposition costs 10 s."""
    trigger = Trigger(Balance(policy="measured"), 10.0)
    trigger.look(ODD, 10)
    assert trigger.cause(10, False) is None, "10 s do not exceed 10 s"
    trigger.look(EVEN, 5)
    assert trigger.cause(15, False) is None
    trigger.look(ODD, 1)
    assert trigger.cause(16, False) == "time lost exceeds the cost"


def test_the_measured_policy_counts_again_after_a_cut() -> None:
    """Time lost before a decomposition does not count again; time lost after a decomposition counts, because the next
    decomposition may avoid such a loss.
    """
    trigger = Trigger(Balance(policy="measured"), 10.0)
    trigger.look(ODD, 50)
    trigger.settle(50, 4.0)
    assert (trigger.lost, trigger.cause(51, False)) == (0.0, None)
    trigger.look(ODD, 4)
    assert (trigger.lost, trigger.cause(54, False)) == (4.0, None), "4 s do not exceed 4 s"
    trigger.look(ODD, 1)
    assert trigger.cause(55, False) is not None


def test_measured_does_not_count_what_ranks_lose_in_turn() -> None:
    """First one rank has more work, then the other rank: no decomposition would reduce the lost time."""
    trigger = Trigger(Balance(policy="measured"), 10.0)
    for step in range(0, 1000, 10):
        trigger.look(ODD if step % 20 else ODD[::-1], 10)
        assert trigger.cause(step + 10, False) is None
    trigger.look(ODD, 11)
    assert trigger.lost == 11.0
    assert trigger.cause(1011, False) is not None


def test_every_cuts_at_multiples_and_not_where_it_has_just_cut() -> None:
    trigger = Trigger(Balance(policy="every", every=50), 1.0, step=0)
    causes = {step: trigger.cause(step, True) for step in (0, 1, 49, 50, 51, 100)}
    assert {step for step, cause in causes.items() if cause} == {50, 100}
    assert causes[50] == "every 50 steps"
    trigger.settle(100, 1.0)
    assert trigger.cause(100, True) is None


def test_outside_cuts_when_a_rank_has_grown_and_never_does_not() -> None:
    assert Trigger(Balance(policy="outside", alpha=1.5), 0.0).cause(7, True) == "a rank has 1.5 times its outside nodes"
    assert Trigger(Balance(policy="outside"), 0.0).cause(7, False) is None
    never = Trigger(Balance(policy="never"), 0.0)
    never.look(ODD, 1000)
    assert never.cause(1000, True) is None


@pytest.mark.parametrize(("outside", "grown"), [(100, False), (120, False), (121, True), (80, False)])
def test_a_rank_has_grown_beyond_alpha_times_what_it_had(outside: int, grown: bool) -> None:
    assert Guard(1.2, 100).grown(outside) is grown


def test_a_rank_without_a_cut_keeps_its_first_count() -> None:
    guard = Guard(1.5)
    assert [guard.grown(n) for n in (10, 15, 16)] == [False, False, True]


def test_cuts_that_do_not_pay_become_rare() -> None:
    """Each unprofitable decomposition doubles the lost time that triggers the next one; a profitable decomposition
    resets this time to the cost.
    """
    trigger = Trigger(Balance(), 1.0)
    waited = []
    for paid in (False, False, False, True):
        trigger.settle(trigger.step + trigger.stretch.steps, 1.0, paid)
        trigger.look([1.0, 1.0], 1)
        while trigger.cause(trigger.step + trigger.stretch.steps, False) is None:
            trigger.look([1.5, 0.5], 1)
        waited.append(trigger.stretch.steps)
    assert waited[3] < waited[0] < waited[1] < waited[2]
    assert [w - 1 for w in waited[:2]] == pytest.approx([4, 8], abs=1.5)


def test_the_start_and_the_end_of_a_stretch_are_distinguished() -> None:
    """The loads are equal for 100 steps, then one rank has 1 s more in each step: the halves have the imbalances 1 and
    1.5, for any windows.
    """
    for window in (1, 3, 10, 50):
        stretch = Stretch()
        for step in range(0, 200, window):
            n = min(window, 200 - step)
            even = min(max(100 - step, 0), n)
            stretch.add([2.0 + (n - even) / n, 2.0 - (n - even) / n], n)
        first, late = stretch.halves
        assert stretch.steps == 200
        assert stretch.work == pytest.approx([500.0, 300.0])
        assert first == pytest.approx(1.0, abs=0.05)
        assert late == pytest.approx(1.5, abs=0.05)


def test_a_stretch_of_one_window_is_the_same_before_and_after() -> None:
    stretch = Stretch()
    assert (stretch.halves, stretch.work, stretch.steps) == ((1.0, 1.0), [], 0)
    stretch.add(ODD, 10)
    assert (stretch.halves, stretch.work, stretch.steps) == ((1.5, 1.5), [30.0, 10.0], 10)
