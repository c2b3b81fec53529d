"""Adaptive sweeps that the server stores: their reports, limits and owners, and requests to cancel."""

import json
from typing import Any

import pytest

from conoid.server.intake import searches
from conoid.server.intake.plans import Plans

from .running import Running, User
from .sweep_bodies import handed_in, wish

NAME = "0123456789abcdef"
SEARCH: dict[str, Any] = {
    "name": "bar", "began": 1.0, "result": "probe.left", "threshold": 0.0, "result_unit": "m/s",
    "key": "parts[0].velocity[2]", "unit": "m/s", "low": 200.0, "high": 800.0, "tolerance": 5.0,
}  # fmt: skip


def report(user: User, status: int = 200, name: str = NAME, **more: Any) -> dict[str, Any]:
    answer = user.http.put(f"/v1/sweeps/adaptive/{name}", content=json.dumps({**SEARCH, **more}))
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found


def point(x: float, run: str, **more: Any) -> dict[str, Any]:
    return {"x": x, "changed": {SEARCH["key"]: f"{x} m/s"}, "run": run, **more}


def test_an_adaptive_sweep_is_there_from_its_first_report_on_and_after_a_restart(server: Running) -> None:
    made = report(server.ann)
    runs = [server.ann.submit() for _ in range(2)]
    points = [point(200.0, runs[0], value=-1.0), point(800.0, runs[1])]
    assert report(server.ann, points=points, bracket=[200.0, 800.0]) == made
    for run in runs:
        server.ann.wait_for(run)
    seen = server.ann.http.get(made["url"]).json()
    assert (seen["total"], seen["states"], seen["search"]["bracket"]) == (2, {"succeeded": 2}, [200.0, 800.0])
    assert [(one["values"], one["run"]["id"]) for one in seen["points"]] == [(p["changed"], p["run"]) for p in points]
    (line,) = server.ann.http.get("/v1/sweeps").json()["sweeps"]
    assert (line["id"], line["search"]["points"][0]["value"]) == (made["id"], -1.0)
    rows = server.ann.http.get("/v1/table", params={"sweep": made["id"]}).json()["runs"]
    assert {row["id"] for row in rows} == set(runs)
    (kept,) = Plans(server.service.settings)
    assert (kept.id, kept.runs, kept.whole) == (made["id"], runs, True)


def test_it_is_its_owners_and_shows_no_runs_of_others(server: Running) -> None:
    foreign = server.bob.submit()
    made = report(server.ann, points=[point(200.0, foreign, value=1.0), point(300.0, "no-such-run")])
    seen = server.ann.http.get(made["url"]).json()
    assert (seen["points"], [one["run"] for one in seen["search"]["points"]]) == ([], ["", ""])
    assert seen["search"]["points"][0]["value"] == 1.0, "of a run on another server"
    assert server.bob.http.get(made["url"]).status_code == 404
    assert server.bob.http.get("/v1/table", params={"sweep": made["id"]}).status_code == 404
    assert report(server.bob)["id"] != made["id"]


def test_a_cancel_reaches_the_command_and_not_the_next_one(server: Running) -> None:
    made = report(server.ann)
    run = server.ann.submit(steps=1000, pace=0.1)
    assert report(server.ann, points=[point(200.0, run)])["stop"] is False
    assert server.ann.http.post(f"{made['url']}:cancel").status_code == 202
    assert server.ann.wait_for(run)["state"] == "cancelled"
    assert report(server.ann)["stop"] is True
    assert report(server.ann, began=2.0)["stop"] is False
    again = server.ann.http.post(f"{made['url']}:again", content=wish())
    assert (again.status_code, again.json()["code"]) == (409, "adaptive")


@pytest.mark.parametrize(
    "more",
    [
        {"points": [{"x": 1.0}] * 501}, {"points": [{"x": "1"}]}, {"key": "k" * 201}, {"unknown": 1}, {"low": None},
        {"points": [{"x": 1.0, "changed": {f"k{n}": n for n in range(21)}}]}, {"curve": {"law": "line"}},
    ],
)  # fmt: skip
def test_a_wrong_report_is_refused(server: Running, more: dict[str, Any]) -> None:
    assert report(server.ann, 422, **more)["code"] == "invalid_report"
    assert server.ann.http.get("/v1/sweeps").json()["sweeps"] == []


def test_an_invalid_report_is_refused(server: Running) -> None:
    for body in (b"", b"[" * 100_000, b"\xff", b'{"low": 1e999}'):
        assert server.ann.http.put(f"/v1/sweeps/adaptive/{NAME}", content=body).status_code == 422
    assert server.ann.http.put(f"/v1/sweeps/adaptive/{NAME}", content=b" " * 300_000).status_code == 413
    for name in ("x" * 16, "0" * 65, "..%2f..%2fetc"):
        assert server.ann.http.put(f"/v1/sweeps/adaptive/{name}", content=json.dumps(SEARCH)).status_code == 404


def test_the_newest_are_kept_and_other_sweeps_beside_them(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(searches, "_MOST", 3)
    other = handed_in(server.ann, wish(), NAME)
    ids = [report(server.ann, name=f"{n:016x}")["id"] for n in range(5)]
    assert report(server.bob, name=NAME)["id"] not in ids
    kept = [one["id"] for one in server.ann.http.get("/v1/sweeps").json()["sweeps"]]
    assert kept == [*reversed(ids[2:]), other["id"]]
    assert {plan.id for plan in Plans(server.service.settings) if plan.owner == "ann"} == set(kept)
    assert handed_in(server.ann, wish(), NAME)["id"] == other["id"]
