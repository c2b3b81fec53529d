"""The command line, in the process of the test with a real server, and in separate processes."""

import fcntl
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from conoid.cases.estimates.cores import usable_cores
from conoid.cases.load import read_case, resolved_json, shipped_path
from conoid.client.cli import app
from conoid.client.commands import run_command
from conoid.client.local.own_server import LocalServer

from .bodies import write_run
from .fakes import FAKE_WORKER, case_file

CONOID = [sys.executable, "-m", "conoid.client.cli"]


@pytest.fixture
def user(server: LocalServer, quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Sets a working folder, and an environment with the address of a server."""
    monkeypatch.setenv("CONOID_URL", server.session.url)
    monkeypatch.setenv("CONOID_TOKEN", server.token)
    return quiet_home


def conoid(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def submitted(folder: Path, **plan: Any) -> str:
    result = conoid("submit", case_file(folder, **plan))
    assert result.exit_code == 0, result.output
    return result.stdout.strip()


def read(result: Result) -> Any:
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


# Without a server -----------------------------------------------------------------------------------------------------


def test_validate_estimates_without_a_server(quiet_home: Path) -> None:
    result = conoid("validate", "demo")
    assert result.exit_code == 0
    assert "demo: valid" in result.stdout
    assert "about 25 920" in result.stdout
    assert read(conoid("validate", "demo", "--json"))["estimate"]["elements"] == 25920


def test_validate_prints_every_error_and_ends_with_2(quiet_home: Path) -> None:
    result = conoid("validate", "demo", "--set", "run.end_tim=1", "--set", "run.ranks=many")
    assert result.exit_code == 2
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    assert lines[0].startswith("conoid: run.ranks = 'many': ")
    assert lines[1:] == ["conoid: run.end_tim: unknown key; did you mean 'end_time'?"]


def test_validate_searches_mesh_files(quiet_home: Path) -> None:
    result = conoid("validate", "demo", "--set", 'parts[0].mesh={shape="file", path="rod.msh", unit="1 mm"}')
    assert result.exit_code == 2
    assert "parts[0].mesh.path = 'rod.msh': no such file (" in result.stderr


def test_validate_prints_mass_and_energy_of_parts(quiet_home: Path) -> None:
    shown = conoid("validate", "demo").stdout
    line = next(line for line in shown.splitlines() if line.startswith("rod"))
    assert " ".join(line.split()) == "rod steel_42crmo4 25 920 4.08 g 3.2 x 6.4 x 32.4 mm 1.17 N s 168 J"
    for word in ("steps", "memory", "core time"):
        assert word in shown
    (rod,) = read(conoid("validate", "demo", "--json"))["estimate"]["parts"]
    assert rod["bulk"]["energy"] == pytest.approx(168.1, rel=1e-3)


def test_validate_warns_of_a_bare_number_and_what_it_comes_to(quiet_home: Path) -> None:
    result = conoid("validate", "demo", "--set", "run.end_time=80")
    assert result.exit_code == 0
    assert result.stdout.startswith("demo: valid, 3 warnings\n")
    assert result.stderr.splitlines()[0] == "conoid: warning: run.end_time = 80: no unit, taken for 80 s"
    assert "hours of core time" in result.stderr
    warnings = read(conoid("validate", "demo", "--set", "run.end_time=80", "--json"))["warnings"]
    assert warnings[0] == {"key": "run.end_time", "value": "80", "message": "no unit, taken for 80 s"}
    assert conoid("validate", "demo").stderr == ""


def test_warnings_of_a_case_in_si_do_not_fill_the_screen(quiet_home: Path) -> None:
    (quiet_home / "si.json").write_bytes(resolved_json(read_case(shipped_path("long_rod"))))
    lines = conoid("validate", "si.json").stderr.splitlines()
    assert len(lines) == 13
    assert lines[-1].endswith(" more warnings; conoid validate --json prints all")


def test_a_case_that_is_about_to_run_gets_its_warnings(user: Path) -> None:
    path = case_file(user, steps=1)
    path.write_text(path.read_text().replace('end_time = "1 us"', "end_time = 1e-6"))
    result = conoid("submit", path)
    assert result.exit_code == 0
    assert "conoid: warning: run.end_time = 1e-06: no unit, taken for 1e-06 s" in result.stderr.splitlines()


@pytest.mark.parametrize("words", [("ls",), ("submit", "demo"), ("watch", "last"), ("show", "x"), ("cancel", "x")])
def test_no_server_is_one_line(words: tuple[str, ...], quiet_home: Path) -> None:
    result = conoid(*words, "--url", "http://127.0.0.1:1")
    assert result.exit_code == 1
    hint = "is a server running there? (conoid serve; another address: CONOID_URL or --url)"
    assert result.stderr == f"conoid: no answer from http://127.0.0.1:1: {hint}\n"


def test_a_label_is_a_name_and_a_value(quiet_home: Path) -> None:
    result = conoid("ls", "--label", "batch", "--url", "http://127.0.0.1:1")
    assert (result.exit_code, result.stderr) == (2, "conoid: label = 'batch': write NAME=VALUE\n")
    result = conoid("ls", "--label", "a=1", "--label", "a=2", "--url", "http://127.0.0.1:1")
    assert (result.exit_code, result.stderr) == (
        2,
        "conoid: label: each name may have only one value; given are a=1, a=2\n",
    )


@pytest.mark.usefixtures("warm")
def test_view_draws_a_folder(quiet_home: Path) -> None:
    folder = write_run(quiet_home / "bar")
    result = conoid(
        "view", folder, "--field", "rank", "--mirror", "auto", "--size", 200, 150, "--json", "--out", "p.png"
    )
    drawn = read(result)
    assert (drawn["field"], drawn["low"], drawn["high"]) == ("rank", 0.0, 1.0)
    assert (quiet_home / "p.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("warm")
def test_view_takes_times_with_their_units(quiet_home: Path) -> None:
    folder = write_run(quiet_home / "bar")
    words = ("view", folder, "--camera", "-x", "--size", 200, 150, "--json", "--out", "p.png", "--time")
    near = conoid(*words, "79 us")
    assert read(near)["times"] == [80e-6]
    assert near.stderr == "conoid: time = 79.0 µs: the nearest frame has the time 80.0 µs\n"
    assert conoid(*words, "80 us").stderr == ""
    assert conoid(*words, "1 ms").stderr == "conoid: time = 1.00 ms: the frames of bar have times from 0 s to 80.0 µs\n"
    one = conoid("view", folder / "frames" / "000007.vtkhdf", "--time", "80 us")
    assert one.stderr.endswith("000007.vtkhdf: this is one frame; the options frame and time need a run\n")
    assert conoid(*words, "79").stderr == "conoid: time = '79': write the time with its unit, such as '60 us'\n"


def test_view_prints_the_description_of_a_frame(quiet_home: Path) -> None:
    result = conoid("view", write_run(quiet_home / "bar"), "--field", "misses")
    assert result.exit_code == 2
    assert result.stderr.startswith("conoid: field = 'misses': allowed: mises, pressure, principal_stress, damage")


# With a server --------------------------------------------------------------------------------------------------------


def test_submit_show_ls_get(user: Path) -> None:
    run = submitted(user, steps=2)
    assert conoid("watch", run, "--plain").exit_code == 0
    shown = conoid("show", "last")
    assert run in shown.stdout
    assert "succeeded" in shown.stdout
    assert "FAIL" in shown.stdout, "a missed reference value is printed"
    listed = read(conoid("runs", "--json"))[0]
    assert listed["id"] == run
    assert listed["results"]["steps"] == 2
    assert not listed.keys() & {"estimate", "outcome"}, "a list does not know them"
    assert listed["short"] in conoid("ls", "--limit", 5).stdout
    assert read(conoid("show", run, "--json"))["outcome"]["steps"] == 2
    got = conoid("get", run, "outcome.json", "history.csv", "--out", "here")
    assert got.stdout.split() == ["here/outcome.json", "here/history.csv"]
    assert (user / "here" / "history.csv").read_text().startswith("step,t")
    assert {file["path"] for file in read(conoid("get", run, "--json"))} >= {"outcome.json", "journal.jsonl"}
    some = conoid("get", run, "nothing.csv", "history.csv", "--out", "there")
    assert some.exit_code == 1
    assert "has no nothing.csv" in some.stderr
    assert some.stdout.split() == ["there/history.csv"]
    assert conoid("replay-balance", "last").stderr == "conoid: the journal of the run has no loads of groups of tets\n"


@pytest.mark.parametrize(
    ("plan", "code", "message"),
    [
        ({}, 0, ""),
        ({"fail": "diverged"}, 1, "the diverged of the tale"),
        ({"fail": "input"}, 2, "the input of the tale"),
    ],
)
def test_watch_ends_as_the_run_does(plan: dict[str, str], code: int, message: str, user: Path) -> None:
    result = conoid("watch", submitted(user, **plan))
    assert result.exit_code == code, result.output
    assert message in result.stderr


def test_cancel_and_the_exit_code_of_watch(user: Path) -> None:
    run = submitted(user, steps=2000, pace=0.02)
    assert conoid("cancel", run).exit_code == 0
    assert conoid("watch", run).exit_code == 4


def test_watch_as_json_lines(user: Path) -> None:
    result = conoid("watch", submitted(user, steps=3), "--json")
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert [line["seq"] for line in lines] == list(range(1, len(lines) + 1))
    assert (lines[0]["state"], lines[-1]["state"]) == ("accepted", "succeeded")


def test_an_unknown_run_is_one_line(user: Path) -> None:
    for words in (("show", "nothing"), ("watch", "nothing"), ("get", "nothing"), ("view", "nothing")):
        result = conoid(*words)
        assert result.exit_code == 1
        assert result.stderr == "conoid: run 'nothing': there is none\n"


def test_a_process_that_has_no_terminal_prints_plain_lines(user: Path) -> None:
    run = submitted(user, steps=400, pace=0.001)
    done = subprocess.run([*CONOID, "watch", run], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stdout.splitlines() if run in line]
    assert done.stdout.splitlines()[: len(lines)] == lines, "what the probes measured follows"
    assert "\x1b" not in done.stdout
    assert 6 <= len(lines) <= 107, "a line a percent, not a line a step"


# All in one -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def alone(quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CONOID_WORKER", FAKE_WORKER)
    return quiet_home


def processes_of(folder: Path) -> list[str]:
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            try:
                command = (entry / "cmdline").read_bytes()
            except OSError:
                continue
            if str(folder).encode() in command:
                found.append(command.replace(b"\0", b" ").decode())
    return found


def wait_for(truth: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60
    while not truth():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def a_run_runs(runs: Path) -> bool:
    return any(b'"running"' in path.read_bytes() for path in runs.glob("*/journal.jsonl"))


def test_run_does_it_all_and_leaves_no_process(alone: Path) -> None:
    case = case_file(alone, steps=3, warn="run.end_time = 1e-06: no unit, taken for 1e-06 s")
    short = ("title=Short", "run.end_time=1e-6")
    cores = ("--ranks", "2", "--threads", "2")
    words = ["run", str(case), *cores, *(f"--set={each}" for each in short), "--out", str(alone / "runs")]
    done = subprocess.run([*CONOID, *words], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert (done.stdout + done.stderr).count("no unit") == 1, "a warning is printed once"
    assert "extent of rod" in done.stdout
    assert "pass" in done.stdout
    assert "FAIL" in done.stdout
    folders = [path for path in (alone / "runs").iterdir() if path.is_dir()]
    resolved = json.loads((folders[0] / "case.resolved.json").read_bytes())["run"]
    assert (resolved["ranks"], resolved["threads"]) == (2, 2)
    assert ("2 ranks x 2 threads want 4 cores" in done.stderr) == (usable_cores() < 4)
    assert f"results    {folders[0]}" in done.stdout
    assert processes_of(alone / "runs") == []
    checked = conoid(*words, "--check", "--json")
    assert checked.exit_code == 1, "a reference number is missed"
    assert json.loads(checked.stdout)["outcome"]["steps"] == 3


def test_an_interrupted_run_is_cancelled(alone: Path) -> None:
    """Two processes, each with a server, are interrupted at the same time: one by SIGINT and one by SIGTERM."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    folders = {number: alone / f"runs-{number.value}" for number in numbers}
    case = str(case_file(alone, steps=2000, pace=0.02))
    children = {
        number: subprocess.Popen(
            [*CONOID, "run", case, "--out", str(runs)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for number, runs in folders.items()
    }
    try:
        for number, child in children.items():
            wait_for(partial(a_run_runs, folders[number]))
            child.send_signal(number)
        for number, child in children.items():
            printed, complained = child.communicate(timeout=60)
            assert child.returncode == 4, complained
            assert "cancelling: the run stops at its next step" in printed
            outcome = next(folders[number].glob("*/outcome.json"))
            assert json.loads(outcome.read_bytes())["state"] == "cancelled"
            assert processes_of(folders[number]) == []
    finally:
        for child in children.values():
            child.kill()


def test_a_killed_client_leaves_no_server(alone: Path) -> None:
    runs = alone / "runs"
    words = ["run", str(case_file(alone, steps=150, pace=0.02)), "--out", str(runs)]
    child = subprocess.Popen([*CONOID, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_for(lambda: a_run_runs(runs))
    child.kill()
    child.wait(10)
    wait_for(lambda: not processes_of(runs))
    outcome = next(runs.glob("*/outcome.json"))
    assert json.loads(outcome.read_bytes())["state"] == "succeeded", "the worker went on to its end"
    resolved = json.loads((outcome.parent / "case.resolved.json").read_bytes())["run"]
    assert resolved["threads"] == usable_cores(), "a run uses all cores if neither the case nor an option gives threads"


@pytest.mark.parametrize(("ranks", "threads"), [(1, 8), (2, 4), (3, 2), (8, 1), (16, 1)])
def test_ranks_share_the_cores(ranks: int, threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_command, "usable_cores", lambda: 8)
    assert run_command.all_cores(ranks) == threads


def test_watch_can_be_left(user: Path) -> None:
    run = submitted(user, steps=5000, pace=0.02)
    child = subprocess.Popen([*CONOID, "watch", run], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout is not None
    child.stdout.readline()
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=60)
    assert child.returncode == 130
    assert errors == f"conoid: the run continues; conoid watch {run} shows the run again\n"
    assert read(conoid("show", run, "--json"))["state"] in {"starting", "running"}
    conoid("cancel", run)


def test_a_server_that_cannot_start_prints_the_reason(alone: Path) -> None:
    (alone / "runs").mkdir()
    (alone / "runs" / "server.log").write_text("of the other server\n")
    with (alone / "runs" / "server.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        result = conoid("run", case_file(alone), "--out", alone / "runs")
    assert result.exit_code == 1
    assert "the server did not start: " in result.stderr
    assert "another server or 'conoid run' uses this folder; wait until it ends" in result.stderr
    assert [path.read_text() for path in (alone / "runs").glob("*server.log*")] == ["of the other server\n"]


def test_run_refuses_a_wrong_case_before_anything_starts(alone: Path) -> None:
    began = time.monotonic()
    result = conoid("run", "demo", "--set", "run.end_time=-1", "--out", alone / "runs")
    assert result.exit_code == 2
    assert result.stderr.startswith("conoid: run.end_time = -1: ")
    assert not (alone / "runs").exists()
    assert time.monotonic() - began < 10
    assert conoid("run", "demo", "--field", "colour").exit_code == 2
    lacking = conoid("run", "taylor_copper", "--view", "bar.png", "--field", "damage", "--out", alone / "runs")
    assert (lacking.exit_code, (alone / "runs").exists()) == (2, False)
    assert lacking.stderr.startswith("conoid: field = 'damage': no frame of taylor_copper has it; allowed: mises, ")


def test_serve_hands_its_options_on(alone: Path) -> None:
    helped = subprocess.run([*CONOID, "serve", "--help"], capture_output=True, text=True, timeout=60, check=True)
    assert "--zenoh-port" in helped.stdout
    token = [*CONOID, "serve", "token", "add", "ann", "--runs", str(alone / "runs")]
    made = subprocess.run(token, capture_output=True, text=True, timeout=60, check=True)
    assert made.stdout.startswith("conoid_")
