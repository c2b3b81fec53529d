"""Runs from submission to end, with real processes."""

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.server.launch.local import LocalLauncher

from .running import PATIENCE, TOML, Running, case_text


def test_a_run_succeeds(server: Running) -> None:
    run = server.ann.submit()
    ended = server.ann.wait_for(run)
    assert ended["state"] == "succeeded"
    assert ended["outcome"]["digest"] == "d" * 64
    assert ended["submitted"] <= ended["started"] <= ended["finished"]
    assert server.ann.states(run) == ["accepted", "queued", "starting", "running", "succeeded"]
    events = server.ann.events(run)
    assert [event["seq"] for event in events] == list(range(1, len(events) + 1))
    assert [event["type"] for event in events[-2:]] == ["finished", "status"]


def test_the_folder_is_complete(server: Running) -> None:
    text = case_text(ranks=2)
    run = server.ann.submit(text)
    server.ann.wait_for(run)
    folder = server.service.settings.runs / run
    assert (folder / "case.toml").read_text() == text
    assert json.loads((folder / layout.RESOLVED_CASE).read_text())["run"]["end_time"] == 1e-6
    assert json.loads((folder / layout.SUBMISSION).read_text())["owner"] == "ann"
    assert (folder / "log" / "rank-1.log").read_text() == "rank 1 greets\n"


def test_the_worker_runs_with_one_thread_and_without_the_servers_secrets(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CONOID_DATABASE", "postgresql://user:secret@db/x")
    run = server.ann.submit()
    server.ann.wait_for(run)
    seen = json.loads((server.service.settings.runs / run / "environment.json").read_text())
    assert seen["OMP_NUM_THREADS"] == seen["NUMBA_NUM_THREADS"] == "1"
    assert "CONOID_DATABASE" not in seen


def test_progress_while_it_runs(server: Running, tmp_path: Path) -> None:
    run = server.ann.submit(steps=500, pace=0.01)
    server.ann.wait_for(run, State.RUNNING)
    deadline = time.monotonic() + PATIENCE
    while (progress := server.ann.show(run)["progress"]) is None:
        assert time.monotonic() < deadline
    assert progress["limiter"] == "tet 1"
    server.ann.http.post(f"/v1/runs/{run}:cancel")
    assert server.ann.wait_for(run)["progress"] is None


def test_cancel_while_it_runs(server: Running) -> None:
    run = server.ann.submit(steps=10_000, pace=0.01)
    server.ann.wait_for(run, State.RUNNING)
    answer = server.ann.http.post(f"/v1/runs/{run}:cancel")
    assert (answer.status_code, answer.json()["state"]) == (202, "stopping")
    ended = server.ann.wait_for(run)
    assert (ended["state"], ended["cause"], ended["outcome"]["state"]) == ("cancelled", "cancelled", "cancelled")
    assert ended["outcome"]["steps"] > 0
    again = server.ann.http.post(f"/v1/runs/{run}:cancel")
    assert (again.status_code, again.json()["state"]) == (202, "cancelled")


def test_a_checkpoint_is_asked_for_while_it_runs(server: Running, tmp_path: Path) -> None:
    first = server.ann.submit(ranks=2, wait=str(tmp_path / "go"))
    second = server.ann.submit()
    server.ann.wait_for(first, State.RUNNING)
    assert server.ann.http.post(f"/v1/runs/{first}:checkpoint").status_code == 202
    assert (server.ann.runs / first / layout.CHECKPOINT_REQUEST).exists()
    refused = server.ann.http.post(f"/v1/runs/{second}:checkpoint")
    assert (refused.status_code, refused.json()["code"]) == (409, "not_running")
    assert server.bob.http.post(f"/v1/runs/{first}:checkpoint").status_code == 404
    (tmp_path / "go").touch()
    assert server.ann.wait_for(first)["state"] == "succeeded"


def test_a_worker_that_does_not_listen_is_killed(server: Running) -> None:
    run = server.ann.submit(end="deaf", steps=1)
    server.ann.wait_for(run, State.RUNNING)
    server.ann.http.post(f"/v1/runs/{run}:cancel")
    ended = server.ann.wait_for(run)
    assert (ended["state"], ended["outcome"]["state"]) == ("cancelled", "cancelled")
    assert server.ann.states(run)[-1] == "cancelled"


def test_cancel_in_the_queue(server: Running, tmp_path: Path) -> None:
    first = server.ann.submit(ranks=2, wait=str(tmp_path / "go"))
    second = server.ann.submit()
    assert server.ann.http.post(f"/v1/runs/{second}:cancel").json()["state"] == "cancelled"
    assert server.ann.show(second)["outcome"]["message"] == "cancelled before it started"
    assert server.ann.states(second) == ["accepted", "queued", "cancelled"]
    (tmp_path / "go").touch()
    assert server.ann.wait_for(first)["state"] == "succeeded"


def test_first_come_first_served_within_the_slots(server: Running, tmp_path: Path) -> None:
    go = tmp_path / "go"
    runs = [server.ann.submit(ranks=ranks, wait=str(go)) for ranks in (1, 2, 1)]
    server.ann.wait_for(runs[0], State.RUNNING)
    time.sleep(0.1)
    seen = [server.ann.show(run) for run in runs]
    assert [one["state"] for one in seen] == ["running", "queued", "queued"]
    assert seen[1]["reason"] == "waiting for 2 of 2 slots; 1 free"
    assert seen[2]["reason"] == "waiting for 1 run before it"
    assert server.ann.http.get("/v1/me").json()["slots"] == {"total": 2, "used": 1}
    go.touch()
    ended = [server.ann.wait_for(run) for run in runs]
    assert [one["state"] for one in ended] == ["succeeded"] * 3
    assert ended[0]["finished"] <= ended[1]["started"]
    assert ended[1]["finished"] <= ended[2]["started"]


@pytest.mark.parametrize(
    ("end", "state", "cause", "words"),
    [
        ("crash", "failed", "service", "RuntimeError: a tet has turned inside out"),
        ("vanish", "failed", "service", "ended with code 0 and left no readable outcome"),
        ("garbled", "failed", "service", "outcome.json: Input data was truncated"),
        ("killed", "lost", "node", "killed from outside"),
        ("refuse", "failed", "input", "the body is empty"),
        ("torn", "failed", "service", "ended with code 1"),
    ],
)
def test_a_worker_that_dies_leaves_a_true_state(server: Running, end: str, state: str, cause: str, words: str) -> None:
    run = server.ann.submit(end=end)
    ended = server.ann.wait_for(run)
    assert (ended["state"], ended["cause"]) == (state, cause)
    assert words in ended["message"]
    assert (ended["outcome"]["state"], ended["outcome"]["cause"]) == (state, cause)
    events = server.ann.events(run)
    assert [event["seq"] for event in events] == list(range(1, len(events) + 1))
    assert events[-1]["state"] == state


def test_an_outcome_that_cannot_be_read_is_kept(server: Running) -> None:
    run = server.ann.submit(end="garbled")
    server.ann.wait_for(run)
    assert (server.service.settings.runs / run / "outcome.unreadable.json").read_text() == '{"state": "succ'


def test_a_launcher_that_does_not_exist(server: Running) -> None:
    absent = replace(server.service.settings, mpiexec="/no/such/mpiexec")
    server.service.supervisor._hands._launcher = LocalLauncher(absent)
    run = server.ann.submit()
    ended = server.ann.wait_for(run)
    assert (ended["state"], ended["cause"]) == ("failed", "launch")
    assert ended["message"] == "/no/such/mpiexec cannot be started: No such file or directory"
    assert server.ann.states(run) == ["accepted", "queued", "starting", "failed"]


def test_wall_time(server: Running) -> None:
    run = server.ann.submit(case_text(extra='max_wall_time = "0.1 s"', steps=10_000, pace=0.01))
    ended = server.ann.wait_for(run)
    assert (ended["state"], ended["cause"]) == ("timed_out", "walltime")
    assert (ended["outcome"]["state"], ended["outcome"]["cause"]) == ("timed_out", "walltime")


def test_a_finished_worker_whose_launcher_hangs(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("conoid.server.runs.watch._FAREWELL", 0.2)
    run = server.ann.submit(end="hang")
    assert server.ann.wait_for(run)["state"] == "succeeded"


def test_wait_returns_when_the_state_changes(server: Running, tmp_path: Path) -> None:
    run = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(run, State.RUNNING)
    began = time.monotonic()
    assert server.ann.http.get(f"/v1/runs/{run}", params={"wait": 0.2}).json()["state"] == "running"
    assert 0.2 <= time.monotonic() - began < 2.0
    (tmp_path / "go").touch()
    assert server.ann.http.get(f"/v1/runs/{run}", params={"wait": 20}).json()["state"] == "succeeded"
    began = time.monotonic()
    server.ann.http.get(f"/v1/runs/{run}", params={"wait": 20})
    assert time.monotonic() - began < 2.0, "a run that has ended is not waited for"


def test_etag_of_a_run(server: Running) -> None:
    run = server.ann.submit()
    server.ann.wait_for(run)
    first = server.ann.http.get(f"/v1/runs/{run}")
    tag = first.headers["etag"]
    second = server.ann.http.get(f"/v1/runs/{run}", headers={"If-None-Match": tag})
    assert (second.status_code, second.content, second.headers["etag"]) == (304, b"", tag)


def test_wait_with_a_known_etag_answers_when_anything_changes(server: Running, tmp_path: Path) -> None:
    run = server.ann.submit(wait=str(tmp_path / "go"), steps=1, end="deaf")
    server.ann.wait_for(run, State.RUNNING)
    tag = server.ann.http.get(f"/v1/runs/{run}").headers["etag"]
    same = server.ann.http.get(f"/v1/runs/{run}", params={"wait": 0.1}, headers={"If-None-Match": tag})
    assert same.status_code == 304
    (tmp_path / "go").touch()
    news = server.ann.http.get(f"/v1/runs/{run}", params={"wait": 20}, headers={"If-None-Match": tag})
    assert news.status_code == 200
    assert (news.json()["state"], news.json()["progress"]["step"]) == ("running", 1)


def test_a_full_disk_delays_and_loses_nothing(server: Running, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from conoid.server.runs import journal, retries

    run = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(run, State.RUNNING)
    real, full = journal.append, [True]

    def append(*arguments: object) -> object:
        if full.pop() if full else False:
            raise OSError(28, "No space left on device")
        return real(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(retries, "_AGAIN", 0.05)
    monkeypatch.setattr(journal, "append", append)
    (tmp_path / "go").touch()
    assert server.ann.wait_for(run)["state"] == "succeeded"
    assert not full
    assert server.ann.states(run)[-1] == "succeeded"


def test_runs_are_found_by_their_labels(server: Running) -> None:
    words = [["batch=1", "of=me"], ["batch=2"], ["batch=1"], []]
    runs = []
    for labels in words:
        answer = server.ann.http.post("/v1/runs", params={"label": labels}, content=case_text(steps=1), headers=TOML)
        runs.append(answer.json()["id"])

    def found(limit: int, *labels: str, **more: str) -> dict[str, Any]:
        answer: dict[str, Any] = server.ann.http.get(
            "/v1/runs", params={"label": list(labels), "limit": limit, **more}
        ).json()
        return answer

    first = found(1, "batch=1")
    assert [run["id"] for run in first["runs"]] == [runs[2]]
    second = found(1, "batch=1", cursor=first["next"])
    assert ([run["id"] for run in second["runs"]], second["next"]) == ([runs[0]], None)
    assert [run["id"] for run in found(9, "batch=1", "of=me")["runs"]] == [runs[0]]
    assert found(9, "batch=3")["runs"] == []
    assert {run["id"] for run in found(9)["runs"]} >= set(runs)
    assert server.ann.http.get("/v1/runs", params={"label": "batch"}).status_code == 400
    for answer in (
        server.ann.http.get("/v1/runs", params={"label": ["batch=1", "batch=2"]}),
        server.ann.http.post("/v1/runs", params={"label": ["a=1", "a=2"]}, content=case_text(), headers=TOML),
    ):
        assert (answer.status_code, answer.json()["pointer"]) == (400, "label")
        assert "given twice" in answer.json()["detail"]


def test_a_run_that_has_ended_can_be_removed(server: Running, tmp_path: Path) -> None:
    run = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(run, State.RUNNING)
    path = f"/v1/runs/{run}"
    assert server.ann.http.delete(path).status_code == 409
    (tmp_path / "go").touch()
    server.ann.wait_for(run)
    assert server.bob.http.delete(path).status_code == 404
    assert server.ann.http.delete(path).status_code == 204
    for answer in (server.ann.http.get(path), server.ann.http.delete(path), server.ann.http.get(f"{path}/files")):
        assert (answer.status_code, answer.json()["code"]) == (410, "gone")
    assert server.ann.http.get("/v1/runs").json()["runs"] == []
    assert list(server.service.settings.runs.glob("*" + run)) == []
