"""Results of a run, each of which is read at its first use."""

import warnings
from array import array
from pathlib import Path

import pytest

from conoid.client.columns import read_columns
from conoid.client.errors import ClientError, UnfinishedError
from conoid.client.result import Result

from .bodies import write_run


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_run(tmp_path / "bar")


def test_the_outcome_with_its_reference(folder: Path) -> None:
    outcome = Result.open(folder).outcome
    assert outcome.state == "succeeded"
    assert [check.passed for check in outcome.reference] == [True]


def test_history_is_columns_of_numbers_and_text(folder: Path) -> None:
    history = Result.open(folder).history
    assert list(history) == ["step", "t", "dt", "limiter", "kinetic"]
    assert history["t"] == array("d", [0.0, 8e-5])
    assert history["limiter"] == ["tet 1", "tet 9"]


def test_a_line_that_is_being_written_is_left_out() -> None:
    assert read_columns("step,t\n1,2.0\n2,4.")["t"] == array("d", [2.0, 4.0])
    assert read_columns("step,t\n1,2.0\n2")["t"] == array("d", [2.0])
    assert read_columns("step,t\n") == {"step": array("d"), "t": array("d")}


def test_frames_have_numbers_and_times(folder: Path) -> None:
    result = Result.open(folder)
    assert [(frame.index, frame.time) for frame in result.frames] == [(0, 0.0), (7, 80e-6)]
    assert result.frame().name == "000007.vtkhdf"
    assert result.frame(0).name == "000000.vtkhdf"
    with pytest.raises(UnfinishedError, match="has not written frame 3; it has 2"):
        result.frame(3)


def test_frames_without_a_series_have_no_times(folder: Path) -> None:
    (folder / "frames" / "frames.vtkhdf.series").unlink()
    assert [frame.time for frame in Result.open(folder).frames] == [None, None]


def test_a_run_that_goes_on_has_no_outcome(tmp_path: Path) -> None:
    with pytest.raises(UnfinishedError, match=r"has no outcome\.json"):
        _ = Result.open(tmp_path).outcome


def test_a_folder_of_runs_is_distinguished_from_a_folder_of_a_run(tmp_path: Path) -> None:
    for number in range(10):
        (tmp_path / f"bar-{number}").mkdir()
        (tmp_path / f"bar-{number}" / "journal.jsonl").touch()
    with pytest.raises(UnfinishedError, match=r"not the folder of a run; .* of the runs bar-0, .*, bar-7 and 2 more"):
        _ = Result.open(tmp_path).outcome
    (tmp_path / "journal.jsonl").touch()
    with pytest.raises(UnfinishedError, match=r"has no outcome\.json"):
        _ = Result.open(tmp_path).outcome


def test_no_folder_and_a_damaged_outcome_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(ClientError, match="this folder does not exist"):
        Result.open(tmp_path / "nothing")
    (tmp_path / "outcome.json").write_text('{"state": 1')
    with pytest.raises(ClientError, match="cannot be read"):
        _ = Result.open(tmp_path).outcome


def test_nothing_is_read_before_it_is_asked_for_and_then_kept(folder: Path) -> None:
    result = Result.open(folder)
    (folder / "history.csv").write_text("step\n5\n")
    assert result.history["step"] == array("d", [5.0])
    (folder / "history.csv").unlink()
    assert result.history["step"] == array("d", [5.0])


def test_a_mesh_is_that_of_the_nearest_frame(folder: Path) -> None:
    result = Result.open(folder)
    late, early = result.mesh(70e-6), result.mesh(1e-6)
    assert (late.field_data["time"][0], early.field_data["time"][0]) == (80e-6, 0.0)
    assert "mises" in result.mesh().cell_data


def test_a_result_shows_itself_in_notebooks(folder: Path) -> None:
    html = Result.open(folder)._repr_html_()
    for words in ("A steel bar", "succeeded", "extent of rod", "pass"):
        assert words in html


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("step,t [s]\n0,0\n9,8e-5\n", None),
        ("step,t [s]\n0,0\n5,4e-5\n", "the lines end at 40.0 µs, the run at 80.0 µs; the last lines are missing"),
        ("step,t [s]\n", "the lines end at 0 s, the run at 80.0 µs; the last lines are missing"),
        ("step,t [s]\n0,0\n9,8e-5\n5,4e-5\n", "the file is damaged: its lines are not in the order of time"),
        ("step,t [s]\n0,0\n9,8e-\ufffd5\n", "the file is damaged: a time is not a number"),
    ],
)
def test_missing_lines_of_a_history_give_a_warning(text: str, problem: str | None, tmp_path: Path) -> None:
    """A truncated history must not give values of an earlier time as the values at the end."""
    (tmp_path / "history.csv").write_text(text)
    (tmp_path / "outcome.json").write_text('{"state": "succeeded", "time": 8e-5}')
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert "t" in Result.open(tmp_path).history
    assert [str(each.message) for each in caught] == ([] if problem is None else [f"{tmp_path}/history.csv: {problem}"])
    (tmp_path / "history.csv").write_text("")
    with pytest.raises(UnfinishedError, match=r"history\.csv has no columns"):
        _ = Result.open(tmp_path).history
