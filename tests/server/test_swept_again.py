"""Points of a sweep without success run again; the results of successful points stay."""

import json
import shutil
import tomllib
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.run import State
from conoid.server.app import opened
from conoid.server.errors import ServiceError
from conoid.server.intake.submission import Desk
from conoid.server.intake.sweeps import Sweeps
from conoid.server.requests import limits
from conoid.server.settings import Settings

from .running import Running, User, case_text
from .sweep_bodies import ENDS, Killed, Never, after, handed_in, wish


def again(user: User, sweep: dict[str, Any], body: bytes, status: int = 202) -> dict[str, Any]:
    answer = user.http.post(f"{sweep['url']}:again", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found


def cancelled_in_part(server: Running, tmp_path: Path) -> tuple[dict[str, Any], bytes, list[str]]:
    """Returns a sweep whose third run was cancelled and whose other runs have succeeded."""
    body = json.dumps({
        "case": tomllib.loads(case_text(wait=str(tmp_path / "go"))), "points": [{"run.end_time": end} for end in ENDS],
    }).encode()  # fmt: skip
    sweep = handed_in(server.ann, body, "k")
    runs = [point["run"]["id"] for point in sweep["points"]]
    server.ann.http.post(f"/v1/runs/{runs[2]}:cancel")
    assert server.ann.wait_for(runs[2])["state"] == "cancelled"
    (tmp_path / "go").touch()
    for run in runs:
        server.ann.wait_for(run)
    return sweep, body, runs


def test_only_what_has_not_succeeded_is_run_again(server: Running, tmp_path: Path) -> None:
    sweep, body, runs = cancelled_in_part(server, tmp_path)
    shutil.rmtree(server.ann.runs / runs[0])
    assert server.ann.http.get(f"/v1/runs/{runs[0]}").status_code == 410
    made = again(server.ann, sweep, body)
    now = [point["run"]["id"] for point in made["points"]]
    assert (now[1], now[3]) == (runs[1], runs[3])
    assert not {now[0], now[2]} & set(runs)
    for run in now:
        assert server.ann.wait_for(run)["state"] == "succeeded"
    assert [server.ann.show(run)["labels"]["point"] for run in now] == ["0", "1", "2", "3"]
    assert [p["run"]["id"] for p in again(server.ann, sweep, body)["points"]] == now, "nothing is left to do"
    kept = Sweeps(server.service.settings, server.service.desk).plans.of("ann")
    assert [(plan.runs, plan.whole) for plan in kept] == [(now, True)]
    assert [p["run"]["id"] for p in handed_in(server.ann, body, "k")["points"]] == now, "the key is still its own"


def test_another_case_or_another_user_runs_nothing_again(server: Running, tmp_path: Path) -> None:
    sweep, body, runs = cancelled_in_part(server, tmp_path)
    assert again(server.ann, sweep, wish(), 422)["code"] == "key_reused"
    assert again(server.bob, sweep, body, 404)["code"] == "not_found"
    assert [point["run"]["id"] for point in server.ann.http.get(sweep["url"]).json()["points"]] == runs


def test_a_sweep_is_unchanged_if_a_point_cannot_run_again(
    server: Running, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep, body, runs = cancelled_in_part(server, tmp_path)
    monkeypatch.setattr(limits, "check_room", lambda *_: (_ for _ in ()).throw(ServiceError(507, "disk_full", "full")))
    assert again(server.ann, sweep, body, 507)["code"] == "disk_full"
    monkeypatch.undo()
    real = Desk.submit

    def refuses(self: Desk, *arguments: Any) -> dict[str, Any]:
        real(self, *arguments)
        raise ServiceError(507, "storage", "the run cannot be kept")

    monkeypatch.setattr(Desk, "submit", refuses)
    assert again(server.ann, sweep, body, 507)["code"] == "storage"
    monkeypatch.undo()
    assert [point["run"]["id"] for point in server.ann.http.get(sweep["url"]).json()["points"]] == runs
    last = again(server.ann, sweep, body)["points"][2]["run"]["id"]
    assert server.ann.wait_for(last)["state"] == "succeeded"


def test_a_repetition_that_a_killed_server_left_is_completed(
    settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    body = wish()
    with opened(settings) as service:
        plan = service.sweeps.submit("ann", body, "k")
        after(service, plan.id, {State.SUCCEEDED})
        real = service.desk.submit

        def dies(*arguments: Any) -> dict[str, Any]:
            real(*arguments)
            raise Killed

        monkeypatch.setattr(service.desk, "submit", dies)
        monkeypatch.setattr(service.sweeps, "_filling", Never())
        with pytest.raises(Killed):
            service.sweeps.again(plan, body, {1: plan.runs[1], 2: plan.runs[2]})
    with opened(settings) as service:
        after(service, plan.id, {State.SUCCEEDED})
        made = service.sweeps.get(plan.id, "ann")
        assert made is not None
        assert made.whole
        assert [made.runs[n] == plan.runs[n] for n in range(4)] == [True, False, False, True]
        assert len(service.store.all()) == 6
