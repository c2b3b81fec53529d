"""Points of a sweep, given by arguments and by files."""

from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import CaseError
from conoid.cases.run import State
from conoid.client.commands import sweeping
from conoid.client.commands.sweep_progress import standing
from conoid.client.errors import ClientError
from conoid.client.remote.run_info import RunInfo
from conoid.client.sweeps import sweep_plot
from conoid.client.sweeps.sweep import SweepInfo, SweepPoint, listed, points_along, points_in, points_of


def test_keys_go_together_or_each_with_each() -> None:
    words = ["run.ranks=1,2", "run.end_time=1 us,2 us"]
    assert points_of(words) == [{"run.ranks": 1, "run.end_time": "1 us"}, {"run.ranks": 2, "run.end_time": "2 us"}]
    assert [tuple(point.values()) for point in points_of(words, grid=True)] == [
        (1, "1 us"), (1, "2 us"), (2, "1 us"), (2, "2 us")
    ]  # fmt: skip


def test_one_value_holds_at_every_point() -> None:
    words = ["run.ranks=1,2", "run.samples=40"]
    both = [{"run.ranks": 1, "run.samples": 40}, {"run.ranks": 2, "run.samples": 40}]
    assert points_of(words) == points_of(words, grid=True) == both
    assert points_along({"run.ranks": [1, 2], "run.samples": [40]}) == both


def test_a_comma_in_a_list_or_in_quotes_divides_nothing() -> None:
    word = """parts[0].velocity=[0, 0, "-1 m/s"],[0, 0, '-2, m/s']"""
    assert points_of([word]) == [
        {"parts[0].velocity": [0, 0, "-1 m/s"]}, {"parts[0].velocity": [0, 0, "-2, m/s"]}
    ]  # fmt: skip


@pytest.mark.parametrize(
    "words", [[], ["run.ranks"], ["run.ranks="], ["run.ranks=1,,2"], ["run.ranks=1,2,"], ["=1"], ["a=1,2", "b=1,2,3"]]
)
def test_wrong_words_are_refused(words: list[str]) -> None:
    with pytest.raises(ValueError, match="--set"):
        points_of(words)


def test_arrays_ranges_and_tuples_are_lists_of_values() -> None:
    both = points_along({"run.ranks": range(1, 3), "parts[0].temperature": np.array([300.0, 400.0])}, grid=False)
    assert both == [{"run.ranks": 1, "parts[0].temperature": 300.0}, {"run.ranks": 2, "parts[0].temperature": 400.0}]


@pytest.mark.parametrize("value", ["1 us", 4, None, {"ranks": [1]}])
def test_one_value_is_no_list_of_values(value: object) -> None:
    """A text must not be read letter by letter, and a table must not be read key by key."""
    with pytest.raises(CaseError, match=r"^points = .*: run.end_time has one value; write a list of values, such as"):
        points_along({"run.end_time": value})  # type: ignore[dict-item]


@pytest.mark.parametrize("points", ["run.ranks", 4, [{"run.ranks": 1}, ("run.ranks", 2)]])
def test_a_point_is_a_mapping(points: object) -> None:
    with pytest.raises(CaseError, match=r"^points\[\d\] = .*: a point is a mapping of keys to values, such as"):
        listed(points)


def test_points_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("run.ranks,run.end_time\n1,1 us\n2,2 us\n")
    assert points_in(path)[1] == {"run.ranks": 2, "run.end_time": "2 us"}
    path.write_text("run.ranks,run.end_time\n1\n")
    with pytest.raises(ValueError, match="--list"):
        points_in(path)


def test_a_key_has_one_list_of_values(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=r"--set = 'run.ranks': is given more than once; write all values") as raised:
        points_of(["run.ranks=1", "run.end_time=1 us", "run.ranks =2"])
    assert len(raised.value.problems) == 1
    path = tmp_path / "points.csv"
    path.write_text("run.ranks,run.end_time, run.ranks\n1,1 us,2\n")
    with pytest.raises(CaseError, match=r"--list = 'run.ranks': is given more than once; each column of '"):
        points_in(path)


def test_what_spreadsheets_write(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_bytes(b"\xef\xbb\xbfrun.ranks,run.end_time\r\n1,1 us\r\n\r\n")
    assert points_in(path) == [{"run.ranks": 1, "run.end_time": "1 us"}]
    path.write_text("run.ranks;run.end_time\n1;1,5 us\n")
    with pytest.raises(CaseError, match=r"the columns are separated by semicolons; separate columns by commas"):
        points_in(path)


ROWS = [
    {"v [m/s]": str(v), "run.ranks": str(ranks), "run": "r", "state": "succeeded", "cpu [s]": str(v),
     "fragments": str(v * v), "energy.plastic [J]": str(v + ranks), "eroded": "0", "digest": ""}
    for v in (100, 200, 300) for ranks in (1, 2)
]  # fmt: skip


def test_differing_results_are_drawn_over_the_changed_key() -> None:
    made = sweep_plot.figure(
        [*ROWS, {**ROWS[0], "fragments": "", "energy.plastic [J]": ""}], ["v", "run.ranks"], None, []
    )
    assert [axes.get_ylabel() for axes in made.axes] == ["fragments", "energy.plastic, J"]
    assert made.axes[0].get_xlabel() == "v, m/s"
    assert [line.get_label() for line in made.axes[0].lines] == ["run.ranks 1", "run.ranks 2"]
    assert [float(y) for y in np.asarray(made.axes[0].lines[0].get_ydata())] == [1e4, 4e4, 9e4]


@pytest.mark.parametrize("x", [None, "w"])
def test_keys_that_go_together_are_one_axis(x: str | None) -> None:
    rows = [{"v [m/s]": row["v [m/s]"], "w [K]": f"{9000 / float(row['v [m/s]']):g}", **row} for row in ROWS]
    made = sweep_plot.figure(rows, ["v", "w", "run.ranks"], x, ["cpu"])
    assert made.axes[0].get_xlabel() == f"{'w, K' if x else 'v, m/s'}\nand 1 more that goes with it"
    assert [(line.get_label(), len(np.asarray(line.get_xydata()))) for line in made.axes[0].lines] == [
        ("run.ranks 1", 3), ("run.ranks 2", 3)
    ]  # fmt: skip


def test_words_on_the_axis_and_columns_by_name() -> None:
    made = sweep_plot.figure(
        [{**row, "v [m/s]": f"law {row['v [m/s]'][0]}"} for row in ROWS], ["v", "run.ranks"], "v", ["cpu"]
    )
    assert [axes.get_ylabel() for axes in made.axes] == ["cpu, s"]
    assert [label.get_text() for label in made.axes[0].get_xticklabels()] == ["law 1", "law 2", "law 3"]


@pytest.mark.parametrize(
    ("x", "columns", "words"), [("w", [], "x = 'w'"), (None, ["mass"], "'mass': not a numeric column")]
)
def test_a_plot_of_what_is_not_there_is_refused(x: str | None, columns: list[str], words: str) -> None:
    with pytest.raises(ClientError, match=words):
        sweep_plot.figure(ROWS, ["v", "run.ranks"], x, columns)


def test_a_sweep_without_an_ended_run_has_no_figure() -> None:
    with pytest.raises(ClientError, match="no run of the sweep has ended"):
        sweep_plot.figure([{**ROWS[0], "cpu [s]": ""}], ["v"], None, [])


def test_a_sweep_that_has_not_succeeded_names_a_run() -> None:
    def point(speed: int, state: State, message: str) -> SweepPoint:
        run = RunInfo(id=f"r{speed}", owner="ann", name="a", state=state, ranks=1, submitted=0.0, message=message)
        return SweepPoint(values={"run.ranks": speed}, run=run)

    failed = [point(2, State.FAILED, "the energy residual"), point(3, State.CANCELLED, "")]
    assert (
        sweeping.failures(failed, 5) == "2 of 5 runs have not succeeded; r2 (run.ranks = 2) failed: the energy residual"
    )
    assert sweeping.failures(failed[1:], 5) == "1 of 5 runs have not succeeded; r3 (run.ranks = 3) cancelled"


def test_the_standing_of_a_sweep_has_the_runs_by_state() -> None:
    states = {"succeeded": 1, "failed": 1, "running": 2, "queued": 0, "accepted": 1}
    many = (State(state) for state, n in states.items() for _ in range(n))
    runs = [RunInfo(id="r", owner="ann", name="a", state=state, ranks=1, submitted=0.0) for state in many]
    points = [SweepPoint(values={}, run=run) for run in runs]
    info = SweepInfo(id="1k1h05qxr836bycy2pfs81", name="", submitted=0.0, total=5, states=states, points=points)
    assert standing(info) == "2 of 5 runs have ended, 2 running, 1 accepted"
