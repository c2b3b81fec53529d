"""Sweeps: all runs of a sweep are accepted or no run, each run is made once, with a limited number at a time; the table
has the results.
"""

import asyncio
import csv
import io
import json
import math
import shutil
import threading
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from starlette.testclient import TestClient

from conoid.cases.reading.problems import CaseError
from conoid.cases.run import State
from conoid.client.sweeps.sweep import SweepInfo
from conoid.server.answers import view
from conoid.server.app import build_app, opened
from conoid.server.errors import ServiceError
from conoid.server.intake import reader
from conoid.server.intake.submission import Desk
from conoid.server.intake.sweeps import Sweeps
from conoid.server.requests import limits
from conoid.server.requests.tokens import create_token
from conoid.server.runs import folder
from conoid.server.settings import Caps, Settings

from .running import Running, User, case_text
from .sweep_bodies import ENDS, Killed, Never, after, handed_in, wish


def test_a_sweep_ends_in_a_table(server: Running) -> None:
    sweep = handed_in(server.ann, wish())
    assert sweep["total"] == len(ENDS) == len(sweep["points"])
    for point in sweep["points"]:
        assert server.ann.wait_for(point["run"]["id"])["state"] == "succeeded"
        assert point["run"]["labels"]["sweep"] == sweep["id"]
    seen = server.ann.http.get(sweep["url"]).json()
    assert seen["states"] == {"succeeded": len(ENDS)}
    assert [point["values"]["run.end_time"] for point in seen["points"]] == ENDS
    text = server.ann.http.get(f"{sweep['url']}/table").text
    lines = list(csv.DictReader(io.StringIO(text)))
    assert [line["run.end_time [us]"] for line in lines] == ["1", "2", "3", "4"]
    assert {(line["state"], line["steps"]) for line in lines} == {("succeeded", "3")}
    assert [one["id"] for one in server.ann.http.get("/v1/sweeps").json()["sweeps"]] == [sweep["id"]]
    assert server.bob.http.get(sweep["url"]).status_code == 404
    assert server.bob.http.get("/v1/sweeps").json() == {"sweeps": [], "next": None}


def test_a_sweep_counts_the_runs_whose_folders_were_removed(server: Running) -> None:
    sweep = handed_in(server.ann, wish())
    ids = [point["run"]["id"] for point in sweep["points"]]
    for run in ids:
        server.ann.wait_for(run)
    shutil.rmtree(server.ann.runs / ids[1])
    assert server.ann.http.get(f"/v1/runs/{ids[1]}").status_code == 410
    seen = server.ann.http.get(sweep["url"]).json()
    assert (seen["states"], seen["removed"], seen["total"]) == ({"succeeded": len(ENDS) - 1}, 1, len(ENDS))
    assert [point["run"]["id"] for point in seen["points"]] == [ids[0], *ids[2:]]
    assert msgspec.convert(seen, SweepInfo).over


def test_one_key_is_one_sweep(server: Running) -> None:
    first, again = (handed_in(server.ann, wish(), "k") for _ in range(2))
    assert first["id"] == again["id"]
    assert [p["run"]["id"] for p in first["points"]] == [p["run"]["id"] for p in again["points"]]
    assert handed_in(server.ann, wish(at_once=1), "k", 422)["code"] == "key_reused"
    assert len(server.ann.http.get("/v1/runs").json()["runs"]) == len(ENDS)


def test_a_sweep_that_broke_off_is_completed(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    real, left = Desk.submit, [2]

    def breaks(self: Desk, *arguments: Any) -> dict[str, Any]:
        left[0] -= 1
        if left[0] < 0:
            raise OSError("broken off")
        return real(self, *arguments)

    monkeypatch.setattr(Desk, "submit", breaks)
    headers = {"Content-Type": "application/json", "Idempotency-Key": "k"}
    answer = server.ann.http.post("/v1/sweeps", content=wish(), headers=headers)
    assert (answer.status_code, answer.json()["code"]) == (503, "unavailable")
    monkeypatch.undo()
    assert len(handed_in(server.ann, wish(), "k")["points"]) == len(ENDS)
    assert len(server.ann.http.get("/v1/runs").json()["runs"]) == len(ENDS)


def test_no_more_points_run_at_a_time_than_requested(server: Running, tmp_path: Path) -> None:
    case = tomllib.loads(case_text(wait=str(tmp_path / "go")))
    body = json.dumps({"case": case, "points": [{"run.end_time": end} for end in ENDS], "at_once": 1}).encode()
    sweep = handed_in(server.ann, body)
    runs = [point["run"]["id"] for point in sweep["points"]]
    server.ann.wait_for(runs[0], State.RUNNING)
    other = server.bob.submit()
    assert server.bob.wait_for(other)["state"] == "succeeded", "others are not held up"
    assert [server.ann.show(run)["state"] for run in runs[1:]] == ["queued"] * 3
    (tmp_path / "go").touch()
    ended = [server.ann.wait_for(run) for run in runs]
    for earlier, later in pairwise(ended):
        assert earlier["finished"] <= later["started"]


def test_a_sweep_is_cancelled_at_once(server: Running, tmp_path: Path) -> None:
    case = tomllib.loads(case_text(wait=str(tmp_path / "go")))
    body = json.dumps({"case": case, "points": [{"run.end_time": end} for end in ENDS]}).encode()
    sweep = handed_in(server.ann, body)
    assert server.ann.http.post(f"{sweep['url']}:cancel").status_code == 202
    for point in sweep["points"]:
        assert server.ann.wait_for(point["run"]["id"])["state"] == "cancelled"


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (wish(points=[]), "1 to 1000"),
        (wish(points=[{}] * 1001), "1 to 1000"),
        (wish(at_once=0), "at_once"),
        (wish(points=[{"run.end_time": "1 us"}, {"run.end_time": "1 kg"}]), "point 1"),
        (wish(points=[{"run.end": "1 us"}]), "run.end"),
        (wish(more=1), "more"),
        (b"[]", "object"),
        (b"{", "broken JSON"),
    ],
)
def test_a_wrong_sweep_makes_no_run(server: Running, body: bytes, words: str) -> None:
    assert words in handed_in(server.ann, body, status=422)["detail"]
    assert server.ann.http.get("/v1/runs").json()["runs"] == []


def test_a_damaged_file_does_not_affect_other_sweeps(server: Running) -> None:
    sweep = handed_in(server.ann, wish())
    (server.service.settings.runs / "sweeps" / f"{folder.new_id()[0]}.json").write_text("{")
    again = Sweeps(server.service.settings, server.service.desk)
    assert [plan.id for plan in again.plans.of("ann")] == [sweep["id"]]


def test_the_same_from_python(server: Running, tmp_path: Path) -> None:
    from conoid.client.remote.session import Session

    with Session("http://127.0.0.1") as session:
        session._http.close()
        session._http = server.ann.http
        made = session.sweep(tomllib.loads(case_text()), {"run.end_time": ENDS}, at_once=2)
        assert made.wait(60.0).over
        assert [line["state"] for line in made.table()] == ["succeeded"] * len(ENDS)
        assert list(made.frame()["steps"]) == [3] * len(ENDS)
        assert made.plot(tmp_path / "sweep.png", ["steps"]).stat().st_size > 1000
        assert session.find_sweep("last").id == made.id
        assert [run.status().labels["point"] for run in made.runs()] == ["0", "1", "2", "3"]
        assert made.cancel().states == {"succeeded": len(ENDS)}


def test_an_invalid_number_is_named(server: Running) -> None:
    from conoid.client.remote.session import Session

    with Session("http://127.0.0.1") as session:
        session._http.close()
        session._http = server.ann.http
        case = tomllib.loads(case_text())
        with pytest.raises(CaseError, match=r"^run.end_time = nan: is not finite \(point 1\)$"):
            session.sweep(case, {"run.end_time": ["1 us", math.nan]})
        made = session.sweep(case, {"run.samples": np.array([10, 20]), "run.end_time": [1e-6, np.float64(2e-6)]})
        assert [point.values["run.samples"] for point in made.status().points] == [10, 20]


# All or none ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def narrow(settings: Settings) -> Iterator[User]:
    """A user with one open run, whose limit of open runs is the number of points of the sweep."""
    allowed = replace(settings, caps=Caps(free_disk=0, queued=len(ENDS)))
    with opened(allowed) as service, TestClient(build_app(service), base_url="http://127.0.0.1") as client:
        client.headers["Authorization"] = f"Bearer {create_token(service.store, 'ann', frozenset({'read', 'submit'}))}"
        yield User(client, "ann", settings.runs)
        service.supervisor.end_all()


def test_a_sweep_for_which_there_is_no_room_makes_no_run(narrow: User, tmp_path: Path) -> None:
    first = narrow.submit(wait=str(tmp_path / "go"))
    for _ in range(2):
        refused = handed_in(narrow, wish(), "k", 429)
        assert "1 of your runs have not ended, and the sweep has 4; this server allows 4" in refused["detail"]
    assert [run["id"] for run in narrow.http.get("/v1/runs").json()["runs"]] == [first]
    assert narrow.http.get("/v1/sweeps").json() == {"sweeps": [], "next": None}
    (tmp_path / "go").touch()
    narrow.wait_for(first)
    assert len(handed_in(narrow, wish(), "k")["points"]) == len(ENDS)


def test_a_sweep_larger_than_any_room_is_refused_for_good(narrow: User) -> None:
    refused = handed_in(narrow, wish(points=[{}] * 5), status=422)
    assert (refused["detail"], refused["retryable"]) == ("5 points; this server allows 4 open runs of a user", False)


def test_a_sweep_that_is_refused_in_the_middle_leaves_nothing_that_runs(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, left = limits.check_room, [3]

    def full(*arguments: Any) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise ServiceError(507, "disk_full", "0 bytes are free", retryable=True)
        real(*arguments)

    monkeypatch.setattr(limits, "check_room", full)
    assert handed_in(server.ann, wish(), "k", 507)["code"] == "disk_full"
    monkeypatch.undo()
    runs = server.ann.http.get("/v1/runs").json()["runs"]
    assert [run["state"] for run in runs] == ["cancelled"] * 2
    assert server.ann.http.get("/v1/sweeps").json() == {"sweeps": [], "next": None}
    assert not list((server.service.settings.runs / "sweeps").glob("*.json"))
    made = handed_in(server.ann, wish(), "k")
    assert len(made["points"]) == len(ENDS)
    assert {server.ann.wait_for(point["run"]["id"])["state"] for point in made["points"]} == {"succeeded"}


def broken_off(settings: Settings, monkeypatch: pytest.MonkeyPatch, key: str | None) -> str:
    """Returns a sweep of four points; two of the points were accepted before the server was killed."""
    with opened(settings) as service:
        real, left = service.desk.submit, [2]

        def dies(*arguments: Any) -> dict[str, Any]:
            left[0] -= 1
            if left[0] < 0:
                raise Killed
            return real(*arguments)

        monkeypatch.setattr(service.desk, "submit", dies)
        monkeypatch.setattr(service.sweeps, "_filling", Never())
        with pytest.raises(Killed):
            service.sweeps.submit("ann", wish(), key)
        return next((settings.runs / "sweeps").glob("*.json")).stem


def test_a_sweep_that_a_killed_server_left_is_completed_before_any_run_starts(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep = broken_off(settings, monkeypatch, "k")
    with opened(settings) as service:
        runs = after(service, sweep, {State.SUCCEEDED})
        plan = service.sweeps.get(sweep, "ann")
        assert plan is not None
        assert plan.whole
        assert sorted(plan.runs) == sorted(run.id for run in runs)
        assert len(runs) == len(ENDS)


def test_a_sweep_that_cannot_be_completed_is_cancelled_with_its_runs(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep = broken_off(settings, monkeypatch, None)
    with opened(settings) as service:
        runs = after(service, sweep, {State.CANCELLED})
        assert len(runs) == 2
        assert service.sweeps.get(sweep, "ann") is None
    assert not list((settings.runs / "sweeps").glob("*.json"))


# Answers about a sweep ------------------------------------------------------------------------------------------------


def test_a_run_that_is_forgotten_shifts_no_other_to_its_point(server: Running) -> None:
    sweep = handed_in(server.ann, wish())
    runs = [point["run"]["id"] for point in sweep["points"]]
    for run in runs:
        server.ann.wait_for(run)
    with server.service.store._engine.begin() as connection:
        connection.exec_driver_sql(f"delete from runs where id = '{runs[1]}'")
    points = server.ann.http.get(sweep["url"]).json()["points"]
    rest = dict(zip(ENDS, runs, strict=True))
    del rest[ENDS[1]]
    assert {point["values"]["run.end_time"]: point["run"]["id"] for point in points} == rest
    lines = csv.DictReader(io.StringIO(server.ann.http.get(f"{sweep['url']}/table").text))
    assert {f"{line['run.end_time [us]']} us": line["run"] for line in lines} == rest


def test_a_cancel_that_cannot_be_recorded_is_refused(server: Running, tmp_path: Path) -> None:
    body = json.dumps({"case": tomllib.loads(case_text(wait=str(tmp_path / "go"))), "points": [{}]}).encode()
    sweep = handed_in(server.ann, body)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(server.service.supervisor, "cancel", lambda run_id: (_ for _ in ()).throw(TimeoutError()))
        answer = server.ann.http.post(f"{sweep['url']}:cancel")
    assert answer.status_code == 503
    assert answer.json()["detail"] == "the request could not be recorded: no answer in time"
    server.ann.http.post(f"{sweep['url']}:cancel")


def test_the_answer_to_a_sweep_is_not_made_in_the_event_loop(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    threads: list[bool] = []
    real = view.brief

    def brief(*arguments: Any) -> dict[str, Any]:
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            threads.append(True)
        else:
            threads.append(False)
        return real(*arguments)

    monkeypatch.setattr(view, "brief", brief)
    handed_in(server.ann, wish())
    assert threads == [True] * len(ENDS), "a thousand points would stop all other answers"


def test_a_point_that_is_nested_too_deeply_is_refused(server: Running) -> None:
    point = {"a" + ".a" * 5000: 1}
    assert "nested too deeply (point 0)" in handed_in(server.ann, wish(points=[point]), status=422)["detail"]


def test_a_submitted_run_does_not_wait_for_sweeps(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    """The user of the sweep also does not wait, and a sweep does not wait for the sweep of another user."""
    monkeypatch.setattr(reader, "usable_cores", lambda: 1)
    real, reading, go = Desk.read, {"ann": threading.Event(), "bob": threading.Event()}, threading.Event()

    def slow(self: Desk, body: bytes, content_type: str, *more: Any, **options: Any) -> Any:
        case = tomllib.loads(body.decode()) if content_type == "application/toml" else json.loads(body)
        if case["name"] in reading:
            reading[case["name"]].set()
            assert go.wait(20)
        return real(self, body, content_type, *more, **options)

    monkeypatch.setattr(Desk, "read", slow)
    with opened(settings) as service, TestClient(build_app(service), base_url="http://127.0.0.1") as client:
        statuses: dict[str, int] = {}

        def hand_in(name: str, path: str, body: bytes, kind: str) -> None:
            scopes = frozenset({"read", "submit"})
            headers = {"Authorization": f"Bearer {create_token(service.store, name, scopes)}", "Content-Type": kind}
            statuses[f"{name} {path}"] = client.post(path, content=body, headers=headers).status_code

        sweeps = [
            threading.Thread(
                target=hand_in,
                args=(name, "/v1/sweeps", wish(case=tomllib.loads(case_text(name))), "application/json"),
            )
            for name in reading
        ]
        for thread in sweeps:
            thread.start()
        try:
            assert all(event.wait(10) for event in reading.values()), "a sweep waits for another one"
            run = threading.Thread(
                target=hand_in, args=("ann", "/v1/runs", case_text("other").encode(), "application/toml")
            )
            run.start()
            run.join(10)
            assert statuses == {"ann /v1/runs": 202}
        finally:
            go.set()
            for thread in sweeps:
                thread.join()
        assert statuses == {"ann /v1/runs": 202, "ann /v1/sweeps": 202, "bob /v1/sweeps": 202}
        service.supervisor.end_all()
