"""The command ``conoid sweep`` with a real server: progress, a repeated command, a separate server, the table, an
adaptive sweep.
"""

import csv
import io
import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from conoid.client.cli import app
from conoid.client.local.own_server import LocalServer

from .fakes import FAKE_WORKER, case_file

SPEED = "parts[0].velocity[2]"


@pytest.fixture
def user(server: LocalServer, quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Sets a working folder, and an environment with the address of a server."""
    monkeypatch.setenv("CONOID_URL", server.session.url)
    monkeypatch.setenv("CONOID_TOKEN", server.token)
    return quiet_home


def conoid(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def found(result: Result) -> Any:
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_a_failed_point_is_run_again_by_the_same_command_and_no_other(user: Path) -> None:
    flaw = user / "flaw"
    flaw.touch()
    case = case_file(user, flaw=str(flaw))
    words = ("sweep", case, "--set", f"{SPEED}=200 m/s,300 m/s,400 m/s", "--set", "run.end_time=2 us", "--wait")
    first = conoid(*words)
    assert first.exit_code == 1
    assert "of 3: parts[0].velocity[2] = 200 m/s, run.end_time = 2 us: succeeded" in first.stderr
    assert "3 of 3: " in first.stderr
    assert "1 of 3 runs have not succeeded; " in first.stderr
    before = rows(conoid("sweep-table", "last").stdout)
    assert [(line[f"{SPEED} [m/s]"], line["run.end_time [us]"], line["state"]) for line in before] == [
        ("200", "2", "succeeded"), ("300", "2", "succeeded"), ("400", "2", "failed"),
    ]  # fmt: skip
    flaw.unlink()
    second = conoid(*words, "--out", user / "sweep.csv")
    assert second.exit_code == 0, second.output
    assert second.stdout == first.stdout, "it is the same sweep"
    after = rows((user / "sweep.csv").read_text())
    assert [line["run"] for line in after[:2]] == [line["run"] for line in before[:2]]
    assert after[2]["run"] != before[2]["run"]
    assert after[2]["probe.left [m/s]"] == str((400.0**2 - 250.0**2) ** 0.5)
    assert conoid(*words).stdout == first.stdout
    assert conoid(*words, "--new").stdout != first.stdout


def test_a_changed_case_is_refused_in_one_line(user: Path) -> None:
    case = case_file(user)
    words = ("sweep", case, "--set", "run.samples=11,12")
    assert conoid(*words, "--wait").exit_code == 0
    case.write_text(case.read_text().replace('"1 us"', '"3 us"'))
    refused = conoid(*words)
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert refused.stderr.splitlines() == [
        f"conoid: {case}: the case has changed since the start of this sweep: run.end_time was '1 us' and is '3 us'; "
        "--new starts a new sweep"
    ]


def test_a_sweep_without_a_server_goes_on_and_its_file_is_a_table(
    quiet_home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CONOID_WORKER", FAKE_WORKER)
    case = case_file(quiet_home)
    words = ("sweep", case, "--set", f"{SPEED}=200,400", "--local", "--runs", quiet_home / "runs")
    first = conoid(*words)
    assert first.exit_code == 0, first.output
    assert conoid(*words).stdout == first.stdout
    kept = quiet_home / "runs" / "sweeps" / f"{first.stdout.strip()}.json"
    lines = rows(conoid("sweep-table", kept).stdout)
    assert [(line[f"{SPEED} [m/s]"], line["state"], line["elements"]) for line in lines] == [
        ("200", "succeeded", "5"), ("400", "succeeded", "5"),
    ]  # fmt: skip
    assert conoid("sweep-plot", kept, "--out", quiet_home / "s.png", "--column", "probe.left").exit_code == 0


def test_a_threshold_by_one_command_and_again_from_its_file(user: Path) -> None:
    case = case_file(user)
    words = ("sweep", case, "--adaptive", "probe.left = 0", "--set", f"{SPEED}=200:400 m/s", "--tolerance", "5 m/s")
    result = conoid(*words)
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[0].startswith(f"{SPEED} = 25")
    assert "where probe.left = 0 m/s: 0 m/s at " in lines[0]
    assert lines[1].startswith("Lambert and Jonas: 250 +- ")
    assert lines[-1].startswith("kept in bar-")
    again = found(conoid(*words, "--json"))
    assert (again["fresh"], again["failed"]) == (0, 0)
    assert abs(again["limit"] - 250.0) <= again["uncertainty"] <= 2.5
    kept = lines[-1].removeprefix("kept in ")
    assert len(rows(conoid("sweep-table", kept).stdout)) == again["points"]
    assert conoid("sweep-plot", kept, "--out", user / "a.png").exit_code == 0


def test_the_same_threshold_from_python(server: LocalServer, quiet_home: Path) -> None:
    found = server.session.adaptive_sweep(
        case_file(quiet_home), {SPEED: ("200 m/s", "400 m/s")}, "probe.left = 0", "5 m/s", at_once=3
    )
    assert found.reached
    assert found.limit is not None
    assert found.uncertainty is not None
    assert abs(found.limit - 250.0) <= found.uncertainty


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--adaptive", "probe.left = 0"), "KEY=LOW:HIGH"),
        (("--adaptive", "probe.left = 0", "--grid", "--set", "a=1:2"), "neither --grid nor --list"),
        (("--tolerance", "1", "--set", "run.ranks=1"), "are allowed only with --adaptive"),
    ],
)
def test_options_that_do_not_go_together(user: Path, words: tuple[str, ...], message: str) -> None:
    refused = conoid("sweep", case_file(user), *words)
    assert refused.exit_code == 2
    assert message in refused.stderr
