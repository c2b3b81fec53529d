"""Time between two snapshots, which depends on the cost of snapshots (docs/reference/snapshots.md)."""

import pytest

from conoid.worker.snapshots.stage import pause


def test_one_a_second_where_a_core_is_free() -> None:
    assert pause(0.001, 0.3, crowded=False) == 1.0


def test_making_them_takes_a_twentieth_of_a_core_where_ranks_have_all() -> None:
    assert pause(0.001, 0.3, crowded=True) == pytest.approx(6.0)
    assert pause(0.001, 0.01, crowded=True) == 1.0


def test_copying_takes_a_two_hundredth_of_the_solver() -> None:
    assert pause(0.02, 0.0, crowded=False) == pytest.approx(4.0)
