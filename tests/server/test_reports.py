"""Reports that the server makes: each report is made once, with limits, for its owner; an error is one line."""

import importlib.util
import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from conoid.cases.output import report
from conoid.server.answers import reports
from conoid.server.launch.bounded import Bounds

from .running import Running, case_text

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def program(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report, "PROGRAM", "tests.server.fake_report")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setattr(reports, "_BOUNDS", Bounds(cpu=20, wall=8, memory=1 << 30, file=1 << 20))


def ended(server: Running, does: str = "makes") -> str:
    run = server.ann.submit(case_text().replace('title = "A bar"', f'title = "{does}"'))
    server.ann.wait_for(run)
    return run


def test_a_report_is_made_once_and_is_a_file_of_the_run(server: Running) -> None:
    run = ended(server)
    with ThreadPoolExecutor(3) as pool:
        answers = [a.json() for a in pool.map(lambda _: server.ann.http.post(f"/v1/runs/{run}:report"), range(3))]
    assert answers[0] == answers[1] == answers[2]
    body = server.ann.http.get(answers[0]["url"])
    assert (len(body.content), body.text[:15]) == (answers[0]["size"], "<!doctype html>")
    assert body.headers["Content-Type"] == "application/octet-stream", "the server shows no page of a run"
    assert [path.name for path in (server.ann.runs / run).glob("*report*")] == [report.NAME]


def test_it_is_for_the_owner_of_a_run_that_has_ended(server: Running) -> None:
    run = ended(server)
    assert server.bob.http.post(f"/v1/runs/{run}:report").status_code == 404
    assert server.nobody.http.post(f"/v1/runs/{run}:report").status_code == 401
    going = server.ann.submit(steps=1000, pace=0.1)
    answer = server.ann.http.post(f"/v1/runs/{going}:report")
    assert (answer.status_code, answer.json()["code"]) == (409, "not_ended")
    server.ann.http.post(f"/v1/runs/{going}:cancel")


@pytest.mark.parametrize(
    ("does", "says"),
    [
        ("hangs", "not ready after 8 s"),
        ("eats", "MemoryError"),
        ("writes", "File too large"),
        ("fails", "no frame"),
    ],
)
def test_a_program_above_its_limits_is_ended_and_reported_in_one_line(server: Running, does: str, says: str) -> None:
    run = ended(server, does)
    answer = server.ann.http.post(f"/v1/runs/{run}:report")
    assert (answer.status_code, answer.json()["code"]) == (500, "no_report")
    assert says in answer.json()["detail"]
    assert "\n" not in answer.json()["detail"]
    began = time.monotonic()
    assert server.ann.http.post(f"/v1/runs/{run}:report").json() == answer.json()
    assert does != "hangs" or time.monotonic() - began < 4.0, "a failed report is not attempted at each request"
    again = [path.name for path in (server.ann.runs / run).iterdir() if "report" in path.name]
    assert [name for name in again if not name.endswith(".part")] == []


def test_a_server_without_packages_names_them(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    run, real = ended(server), importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "pyvista" else real(name))
    answer = server.ann.http.post(f"/v1/runs/{run}:report")
    assert (answer.status_code, answer.json()["hint"]) == (501, f"conoid report {run}")
    assert answer.json()["detail"] == "the server lacks pyvista: pip install 'conoid[client,view]' on the server"


def test_a_link_in_its_place_is_not_followed(server: Running, tmp_path: Path) -> None:
    run, secret = ended(server), tmp_path / "secret"
    secret.write_text("secret")
    os.symlink(secret, server.ann.runs / run / report.NAME)
    answer = server.ann.http.post(f"/v1/runs/{run}:report").json()
    assert server.ann.http.get(answer["url"]).text.startswith("<!doctype html>")
    assert secret.read_text() == "secret"
