"""Data and files of the charts that compare ranks."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from conoid.cases.messages import AnyMessage, Balance, Load
from conoid.client.errors import ClientError, UsageError
from conoid.client.reports import charts


def load(t: float, outside: list[int]) -> Load:
    return Load(run="r", t=t, phases={"contact": [1.0] * (len(outside) or 2)}, imbalance=1.0, outside=outside)


def cut(t: float) -> Balance:
    return Balance(run="r", t=t, cause="", before={}, predicted=[], tets=1, nodes=1, cost=1.0, saved=0.0)


def test_the_course_of_a_run_that_went_on_from_a_checkpoint_is_drawn_once() -> None:
    """The run went back from step 3 to step 1: its messages about steps 2 and 3 occur twice, and the CPU time of both
    messages counts.
    """
    sent: list[AnyMessage] = [load(1.0, [5, 5]), load(2.0, [7, 5]), cut(2.0), load(3.0, [6, 6])]
    again: list[AnyMessage] = [load(2.0, [7, 5]), cut(2.5), load(3.0, [6, 7])]
    course = charts.course([*sent, *again])
    assert (course.times, course.outside) == ([1.0, 2.0, 3.0], [[5, 5], [7, 5], [6, 7]])
    assert course.cuts == [2.0, 2.5]
    assert course.seconds == {"contact": [5.0, 5.0]}


def test_a_journal_without_loads_is_refused() -> None:
    with pytest.raises(ClientError, match="has no messages with the loads of its ranks"):
        charts.course([cut(1.0)])


@pytest.mark.parametrize(("ranks", "named"), [(3, 3), (16, 2)])
def test_many_ranks_are_grey_but_for_the_extreme_ones(ranks: int, named: int) -> None:
    axes = Figure().subplots()
    charts._outside(axes, charts.course([load(t, [10 + rank for rank in range(ranks)]) for t in (1.0, 2.0)]))
    labels = [str(line.get_label()) for line in axes.get_lines() if not str(line.get_label()).startswith("_")]
    assert len(labels) == named
    assert {"rank 0", f"rank {ranks - 1}"} <= set(labels)
    assert len(axes.get_lines()) == ranks


@pytest.mark.parametrize("outside", [[4, 9], []])
def test_a_chart_is_written(outside: list[int], tmp_path: Path) -> None:
    """A chart is also written for a run without contact; the messages of such a run have no surface nodes."""
    out = tmp_path / "balance.png"
    course = charts.course([load(0.5e-6, outside), load(2e-6, outside)])
    charts.balance(course, "a bar", "glass_steel_bar", out)
    picture = imread(out)
    assert picture.shape[:2] == (480, 1100)
    assert picture[..., :3].std() > 0.1


def test_a_chart_with_an_unknown_suffix_is_a_usage_error(tmp_path: Path) -> None:
    course = charts.course([load(0.5e-6, [4, 9])])
    with pytest.raises(UsageError, match=r"balance.foo: cannot be written: Format 'foo' is not supported"):
        charts.balance(course, "a bar", "glass_steel_bar", tmp_path / "balance.foo")
    assert not list(tmp_path.iterdir())
