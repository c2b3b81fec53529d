"""The projection of scaling compared with simple sums, the tables, and the command."""

import json
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from conoid.cases.outcome import Outcome
from conoid.client import cli
from conoid.client.commands import benches
from conoid.client.studies.chart import speed_up
from conoid.client.studies.projection import Projection, bandwidth, project
from conoid.client.studies.scaling import Trial, trials
from conoid.client.studies.study import from_json, to_json, to_markdown

from .studies import SLOW, by_tasks, load, one_rank, study, two_ranks, two_threads


def test_the_projection_is_the_sum_by_hand() -> None:
    run = two_ranks()
    assert run.longest == pytest.approx(2.25 + 3.0)
    assert run.messages == pytest.approx(0.010 + 0.004)
    assert run.collectives == pytest.approx(3 * 2 * 0.001 + 0.004 + 2 * 0.001)
    assert run.time == pytest.approx(5.276)
    assert run.coarse == pytest.approx(3.0 + 1.5 + 0.026)
    assert (run.work, run.wall) == (7.75, 7.0)
    assert run.imbalance == pytest.approx(5.25 / 3.875)
    assert {name: (p.total, p.imbalance) for name, p in run.phases.items()} == {
        "elements": (6.0, 1.0), "exchange": (0.25, 0.125), "contact": (1.5, 0.75),
    }  # fmt: skip
    assert run.worst == pytest.approx(3.875 + 1.875 + 0.026)
    assert (run.messages_sent, run.bytes_sent, run.collectives_made, run.bytes_shared) == (1.0, 1375.0, 1.0, 220.0)


def test_one_rank_takes_what_it_works() -> None:
    assert one_rank().time == one_rank().worst == one_rank().work == 7.0


@pytest.mark.parametrize(("ranks", "levels"), [(2, 1), (3, 2), (4, 2), (5, 3), (32, 5), (33, 6)])
def test_a_collective_goes_up_and_down_a_tree(ranks: int, levels: int) -> None:
    zeros = [0] * ranks
    window = load(
        phases={"exchange": [0.0] * ranks}, waiting=[0.0] * ranks, steps=1, messages=zeros, bytes=zeros,
        collectives=[1] * ranks, collective_bytes=zeros,
    )  # fmt: skip
    run = project([window], Outcome(state="succeeded", ranks=ranks), SLOW)
    assert run.collectives == pytest.approx(2 * levels * 1e-3)


def test_losses_are_all_that_lies_between_the_ideal_and_the_worst() -> None:
    one, run = one_rank(), two_ranks()
    losses = study(one, run).losses(run)
    assert losses["contact"] == pytest.approx((-0.25, 0.75))
    assert one.time / 2 + sum(map(sum, losses.values())) == pytest.approx(run.worst)


def test_the_tables_contain_the_results() -> None:
    text = to_markdown(study(one_rank(), two_ranks()))
    assert "1.00 ms latency and 1.00 MB/s bandwidth" in text
    row = next(line for line in text.splitlines() if line.startswith("| 2 "))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells == ["2", "4", "2.0", "7.0", "90", "5.28", "4.53", "5.78", "1.33", "66", "1.21", "1.35", "1"]
    assert text.startswith("`long_rod`, `run.samples=7`\n")
    assert "Digests: equal, abc." in text
    written = to_json(study(one_rank(), two_ranks()))
    assert from_json(written) == study(one_rank(), two_ranks())
    document = json.loads(written)
    assert document["runs"][1]["projected"] == pytest.approx(5.276)
    assert "Digests: NOT EQUAL." in to_markdown(study(one_rank(), two_ranks("xyz")))


def test_layouts_are_ranks_and_threads() -> None:
    assert benches.layouts_of("1, 2,4x4,1x16") == [(1, 1), (2, 1), (4, 4), (1, 16)]


def test_threads_without_cores_are_projected_and_two_show_how_right_that_is() -> None:
    some = [(1, 16), (4, 4), (1, 4), (16, 1)]
    assert trials(some, 2) == [
        Trial(1, 1), Trial(1, 2), Trial(16, 1), Trial(1, 16, by_tasks=True), Trial(4, 4, by_tasks=True),
    ]  # fmt: skip
    assert trials(some, 16) == [Trial(1, 1), Trial(1, 4), Trial(1, 16), Trial(4, 4), Trial(16, 1)]
    assert trials([(4, 4)], 1) == [Trial(1, 1), Trial(1, 4, by_tasks=True), Trial(4, 4, by_tasks=True)]
    assert len({trial.folder for trial in [*trials(some, 2), *trials(some, 16)]}) == 8


def test_a_projection_by_tasks_takes_the_work_of_so_many_threads() -> None:
    one, run = one_rank(), by_tasks(4)
    assert (run.name, run.cores, run.time) == ("1x4*", 4, 3.5)
    assert by_tasks(2).time == 5.0
    found = study(one, by_tasks(2), run)
    assert found.speed_up(run) == 2.0
    assert found.losses(run)["elements"] == pytest.approx((1.5 - 5.0 / 4, 0.0))
    text = to_markdown(found)
    assert "10.0 parallel regions per step, 3.0 colours per region, 4.0 tasks per colour" in text
    assert "off." not in text, "nothing was measured with two threads"
    two = to_markdown(study(one, two_threads(), by_tasks(2), run))
    assert "Two threads are 1.40 times as fast as one thread if projected, 1.75 times if measured: -20 % off." in two
    alone = study(one, by_tasks(1), run)
    assert (run.time, by_tasks(1).time, alone.speed_up(run)) == (3.5, 8.0, 8.0 / 3.5)


def test_serial_time_is_reported_by_phase() -> None:
    text = to_markdown(study(one_rank(), two_threads()))
    lines = [line.replace(" ", "") for line in text.splitlines()]
    assert "|phase|1x2|" in lines
    assert "|elements|250.000+500.000|" in lines
    assert "|contact|500.000+0.000|" in lines
    assert "|all|750.000+500.000|" in lines


def test_the_figure_marks_what_others_measured() -> None:
    svg = "{http://www.w3.org/2000/svg}"
    for others in ({}, {32: 23.79}, {16: 12.32, 32: 18.74}):
        drawn = ElementTree.fromstring(speed_up(study(one_rank(), two_ranks()), others, "somebody"))
        red = [e for e in drawn.iter(f"{svg}circle") if e.get("fill") == "#c8553d"]
        assert len(red) == len(others) + (len(others) > 0), "the points and their mark in the legend"
        labels = [e.text for e in drawn.iter(f"{svg}text") if re.fullmatch(r"\d+\.\d\d", e.text or "")]
        assert labels == [*(f"{value:.2f}" for value in others.values()), "1.33"]


@pytest.mark.parametrize(
    ("text", "value"), [("5GB/s", 5e9), ("12.5 MB/s", 12.5e6), ("800 B/s", 800.0), ("1e3 kB/s", 1e6)]
)
def test_bandwidths(text: str, value: float) -> None:
    assert bandwidth(text) == value


@pytest.mark.parametrize("text", ["5", "GB/s", "0 GB/s", "5 Gb/s", "-1 GB/s"])
def test_an_invalid_bandwidth_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not a bandwidth"):
        bandwidth(text)


def conoid(*words: object) -> Result:
    return CliRunner().invoke(cli.app, ["bench", "scale", *map(str, words)])


@pytest.mark.parametrize(("digest", "code"), [("abc", 0), ("xyz", 1)])
def test_another_answer_on_more_ranks_is_an_error(
    digest: str, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def scale(*_: object) -> Iterator[Projection]:
        return iter((one_rank(), two_ranks(digest)))

    monkeypatch.setattr(benches, "scale", scale)
    result = conoid("demo", "--ranks", "2", "--out", tmp_path)
    assert result.exit_code == code
    assert result.stdout == (tmp_path / "scale.md").read_text()
    assert json.loads((tmp_path / "scale.json").read_bytes())["digests_equal"] is (code == 0)
    assert (tmp_path / "scale.svg").read_text().startswith("<svg")


@pytest.mark.parametrize(("option", "value"), [("--ranks", "two"), ("--latency", "2 m"), ("--bandwidth", "5")])
def test_an_unreadable_file_is_one_line(option: str, value: str) -> None:
    result = conoid("demo", option, value)
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
    assert result.stderr.startswith(f"conoid: {option} = '{value}': ")


@pytest.mark.parametrize(
    "ranks", ["two", "0", "-1", "1,,2", "1 2", "2.5", "4097", "9" * 5000, "²", "", "x4", "4x", "1x257", "2x2x2"]
)
def test_numbers_of_ranks_that_cannot_be(ranks: str) -> None:
    result = conoid("demo", "--ranks", ranks)
    assert result.exit_code == 2
    message = (
        "allowed: numbers of ranks, or ranks x threads, with commas between them, such as 1,2,4x4; up to 4096 ranks, "
        "up to 256 threads\n"
    )
    assert result.stderr.endswith(message)
    assert len(result.stderr) < 250


def test_a_folder_with_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "ranks-1").mkdir()
    result = conoid("demo", "--out", tmp_path)
    assert result.exit_code == 1
    assert "ranks-1 contains another run" in result.stderr


@pytest.mark.slow
def test_a_case_on_one_and_two_ranks(tmp_path: Path) -> None:
    short = ("--set", "reference=[]", "--set", "run.end_time='3 us'", "--set", "run.frames=0")
    words = ("bar_on_bar", "--ranks", "1,2", *short, "--out", tmp_path)
    result = conoid(*words)
    assert result.exit_code == 0, result.stderr
    one, two = json.loads((tmp_path / "scale.json").read_bytes())["runs"]
    assert one["digest"] == two["digest"] != ""
    assert one["messages_sent"] == one["collectives_made"] == 0 < two["messages_sent"]
    assert 0.0 < one["work"] == pytest.approx(one["projected"])
    assert two["work"] / 2 < two["projected"] <= two["at_worst"]
    written = (tmp_path / "ranks-2" / "journal.jsonl").stat().st_mtime
    assert conoid(*words, "--latency", "1 ms").exit_code == 0
    assert (tmp_path / "ranks-2" / "journal.jsonl").stat().st_mtime == written, "runs that are there are only read"
    again = json.loads((tmp_path / "scale.json").read_bytes())["runs"][1]
    assert again["collectives"] > two["collectives"]
    assert conoid(*words, "--set", "run.samples=7").exit_code == 1
