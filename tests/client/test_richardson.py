"""Orders, extrapolations and convergence indices of data with a known order, and of the worked examples of the
sources.
"""

import math

import pytest
from scipy import stats

from conoid.client.studies.richardson import Trend, extrapolated, fitted, grid_convergence_index, limit, observed_order
from conoid.client.studies.scatter import Sample, differ, perturbations, runs_needed, student


def made(sizes: list[float], order: float, exact: float = 3.0, slope: float = 0.7) -> list[float]:
    return [exact + slope * h**order for h in sizes]


@pytest.mark.parametrize("order", [0.6, 1.0, 1.37, 2.0])
@pytest.mark.parametrize("sizes", [[1.0, 2.0, 4.0], [0.3, 0.4, 0.7], [1.0, 1.1, 1.3, 1.7, 2.6]])
def test_the_order_and_the_limit_of_made_data_come_back(order: float, sizes: list[float]) -> None:
    values = made(sizes, order)
    assert observed_order(sizes[:3], values[:3]) == pytest.approx(order, rel=1e-8)
    found = limit(sizes, values)
    assert found.trend is Trend.CONVERGES
    assert found.order == pytest.approx(order, rel=1e-5)
    assert found.value == pytest.approx(3.0, rel=1e-6)
    assert found.uncertainty == pytest.approx(1.25 * abs(3.0 - values[0]), rel=1e-4)
    assert limit(sizes[::-1], values[::-1]) == found, "the order of the meshes does not count"


def test_the_worked_example_of_an_inlet() -> None:
    """Pressure recovery of an inlet on three meshes with the ratio 2 (NASA's tutorial on grid convergence)."""
    fine, medium, coarse = 0.97050, 0.96854, 0.96178
    order = observed_order([1.0, 2.0, 4.0], [fine, medium, coarse])
    assert order == pytest.approx(1.786170, abs=1e-6)
    assert extrapolated(fine, medium, 2.0, order) == pytest.approx(0.97130, abs=1e-5)
    assert grid_convergence_index(fine, medium, 2.0, order) == pytest.approx(0.00103083, rel=1e-4)
    assert grid_convergence_index(medium, coarse, 2.0, order) == pytest.approx(0.00356249, rel=1e-4)


def test_the_examples_of_celik_and_others_with_unequal_ratios() -> None:
    """Table 1 of the cited paper: reattachment length, velocity, and a value that oscillates."""
    sizes = [1.0, 1.5, 2.0]
    assert observed_order(sizes, [6.063, 5.972, 5.863]) == pytest.approx(1.53, abs=0.01)
    assert extrapolated(6.063, 5.972, 1.5, 1.53) == pytest.approx(6.1685, abs=1e-3)
    assert grid_convergence_index(6.063, 5.972, 1.5, 1.53) == pytest.approx(0.022, abs=5e-4)
    wide = [1.0, 2.0, 2.0 * 2.143]
    assert observed_order(wide, [10.7880, 10.7250, 10.6050]) == pytest.approx(0.75, abs=0.01)
    assert observed_order(wide, [6.0042, 5.9624, 6.0909]) == pytest.approx(1.51, abs=0.01)
    assert limit(wide, [6.0042, 5.9624, 6.0909]).trend is Trend.OSCILLATES


def test_an_order_above_the_formal_one_is_not_extrapolated_with() -> None:
    sizes = [1.0, 2.0, 4.0]
    values = made(sizes, 3.5)
    found, steep = limit(sizes, values), fitted(sizes, values)
    assert found.order == steep.order == pytest.approx(3.5, rel=1e-4)
    assert abs(found.value - values[0]) > abs(steep.value - values[0])
    assert found.uncertainty > abs(values[0] - 3.0)


def test_far_beyond_the_formal_order_less_is_believed() -> None:
    sizes = [1.0, 2.0, 4.0]
    near, far = (limit(sizes, made(sizes, order)) for order in (3.9, 4.1))
    assert far.uncertainty > 2.0 * near.uncertainty


@pytest.mark.parametrize(
    ("values", "trend"),
    [
        ([5.0, 3.0, 2.0], Trend.DIVERGES),
        ([8.0, 7.0, 6.0], Trend.DIVERGES),
        ([3.00, 3.10, 2.70], Trend.OSCILLATES),
        ([3.0, 3.4, 3.3], Trend.DIVERGES),
        ([2.0, 2.0 + 1e-9, 2.0], Trend.SETTLED),
        ([2.0, math.nan, 1.0], Trend.UNKNOWN),
    ],
)
def test_a_quantity_that_does_not_converge_is_named(values: list[float], trend: Trend) -> None:
    found = limit([1.0, 2.0, 4.0], values, floor=1e-6)
    assert found.trend is trend
    assert found.value == values[0]
    if trend in (Trend.DIVERGES, Trend.OSCILLATES):
        assert found.uncertainty == pytest.approx(3.0 * (max(values) - min(values)))


def test_noise_on_five_meshes_widens_the_uncertainty_and_leaves_the_truth_within() -> None:
    sizes = [1.0, 1.3, 1.7, 2.2, 3.0]
    noise = [0.004, -0.004, 0.003, -0.003, 0.004]
    found = limit(sizes, [a + b for a, b in zip(made(sizes, 1.5), noise, strict=True)])
    assert found.trend is Trend.CONVERGES
    assert abs(found.value - 3.0) < found.uncertainty


# Ensembles ------------------------------------------------------------------------------------------------------------


def test_steps_are_perturbed_from_a_thousandth_to_a_hundredth() -> None:
    assert perturbations(1) == [0.0]
    assert perturbations(4) == pytest.approx([0.0, 1e-3, 10**-2.5, 1e-2])


def test_mean_deviation_and_error_of_a_sample() -> None:
    sample = Sample((2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0))
    assert sample.mean == 5.0
    assert sample.deviation == pytest.approx(math.sqrt(32.0 / 7.0))
    assert sample.error == pytest.approx(math.sqrt(32.0 / 56.0))
    assert Sample((3.0,)).error == 0.0


@pytest.mark.parametrize(("effect", "needed"), [(0.5, 64), (0.8, 26), (1.2, 12)])
def test_runs_that_a_difference_needs(effect: float, needed: int) -> None:
    """Cohen's tables for two samples, 5 % and a power of 0.8: a difference of half a standard deviation needs 64 runs
    in each sample.
    """
    assert runs_needed(1.0, effect) == pytest.approx(needed, abs=1)


@pytest.mark.parametrize("free", [1.0, 2.0, 3.0, 4.0, 6.5, 20.0])
def test_quantiles_of_student(free: float) -> None:
    assert student(0.975, free) == pytest.approx(float(stats.t.ppf(0.975, free)), rel=0.012)


def test_two_samples_differ_by_the_test_of_welch() -> None:
    a, near, far = Sample((1.0, 1.2, 0.9, 1.1)), Sample((1.05, 1.3, 0.95, 1.2)), Sample((1.5, 1.7, 1.4, 1.6))
    for other in (near, far):
        assert differ(a, other) == (stats.ttest_ind(a.values, other.values, equal_var=False).pvalue < 0.05)
    assert differ(a, far)
    assert not differ(a, near)
