"""Adaptive number of sweeps, computed from the change by the last sweep of the previous step."""

import numpy as np
import pytest

from conoid.cases.estimates.impact import Sweeps
from conoid.worker.contact.solver.sweep_count import SweepCount

from ..worker.meshes import Floats
from .kernels import Solver, column


@pytest.mark.parametrize("seed", range(4))
def test_the_residual_is_the_change_by_the_last_sweep(seed: int) -> None:
    """The sum over two sweeps without momentum is in units of 2^16 quanta; the value of each node is rounded down."""
    v = np.random.default_rng(seed).normal(size=(20, 3))
    solver = Solver(column(20), v, np.ones((20, 3)))
    solver.sweep()
    before, first = solver.total.copy(), solver.unsettled.copy()
    solver.sweep()
    last = solver.unsettled - first
    changes = [(np.abs(words).sum(axis=1) >> 16).sum() for words in (solver.total - before, solver.total)]
    assert last.tolist() == changes
    assert 0 < last[0] < last[1]


def share(links: int, sweeps: int) -> float:
    """Returns the change by the last of a number of sweeps, when one end of a row of touching nodes moves into the
    other nodes.
    """
    v = np.zeros((links, 3))
    v[0, 0] = 1.0
    solver = Solver(column(links), v, np.ones((links, 3)))
    solver.step(sweeps)
    changed, impulse = solver.unsettled
    return float(changed / impulse)


def test_a_long_row_needs_more_sweeps() -> None:
    assert share(2, 5) == 0.0
    assert share(30, 5) > share(30, 20) > 0.0015 > share(3, 20)


def steps(need: SweepCount, shares: Floats) -> list[int]:
    """Returns the numbers of sweeps after steps with the given residuals."""
    found = []
    for one in shares:
        need.agree(np.array([round(1e6 * one), 1_000_000]))
        found.append(need.sweeps)
    return found


def test_the_sweep_count_follows_the_residual() -> None:
    """The number of sweeps grows by a quarter, at least by one, or falls by one, within its bounds; without an impulse
    it does not change.
    """
    need = SweepCount(Sweeps(5, 12))
    assert need.sweeps == 5
    assert steps(need, np.full(6, 0.002)) == [6, 7, 8, 10, 12, 12]
    assert steps(need, np.array([0.0009, 0.0015, 0.0008])) == [12, 12, 12]
    need.agree(np.zeros(2, np.int64))
    assert need.sweeps == 12
    assert steps(need, np.full(9, 0.0007)) == [11, 10, 9, 8, 7, 6, 5, 5, 5]


def test_a_number_that_is_given_stays() -> None:
    assert steps(SweepCount(Sweeps(3, 3)), np.array([0.5, 0.5, 0.0001])) == [3, 3, 3]


def test_a_run_warns_if_the_residual_is_too_large() -> None:
    """The residual is relative to all impulses of the run, so that a first or weak step has no effect; a restart
    continues the sums.
    """
    few, own = SweepCount(Sweeps(5, 5)), SweepCount(Sweeps(5, 40))
    for need in (few, own):
        need.agree(np.array([9, 10]))
        need.agree(np.array([2_900, 1_000_000]))
        assert not need.warnings
        need.agree(np.array([500, 1_000]))
    assert "by 0.34 % in the mean, above 0.3 %" in few.warnings[0]
    assert few.warnings[0].endswith("leave contact.sweeps out, or raise it")
    assert own.warnings[0].endswith("compare with contact.sweeps = 100")
    again = SweepCount(Sweeps(5, 40))
    again.resume(own.known())
    assert (again.warnings, again.sweeps) == (own.warnings, 8)
