"""Rules for the removal of runs by age and by size, for runs that are never removed, and for answers about removed
runs.
"""

import os
import shutil
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest

from conoid.cases.run import State
from conoid.cases.site.batch import Site
from conoid.cases.site.policy import Retention
from conoid.server.database.store import Store
from conoid.server.keeping import removal
from conoid.server.keeping.removal import Removal
from conoid.server.keeping.removed_runs import FILE, RemovedRuns
from conoid.server.runs import existing, pins
from conoid.server.runs.existing import ExistingRuns

from .running import PATIENCE, TOML, Running, User, case_text


def keeper_of(server: Running, **rules: Any) -> Removal:
    """Returns a keeper with the given rules; the test calls the checks of the keeper."""
    service = server.service
    settings = replace(service.settings, site=Site(retention=Retention(**rules)))
    return Removal(settings, service.store, service.removed_runs,
                   lambda run: service.supervisor.current(run) is not None, service.uploads)  # fmt: skip


def ended(server: Running, label: str = "") -> str:
    """Returns a run of ann that has ended and that the supervisor has closed, which happens after the state is
    stored.
    """
    words = f"?label={label}" if label else ""
    run = str(server.ann.http.post(f"/v1/runs{words}", content=case_text(), headers=TOML).json()["id"])
    assert server.ann.wait_for(run)["state"] == "succeeded"
    deadline = time.monotonic() + PATIENCE
    while server.service.supervisor.current(run) is not None:
        assert time.monotonic() < deadline, f"run {run} is still open"
        time.sleep(0.01)
    return run


def test_old_runs_go_and_leave_a_line(server: Running, tmp_path: Path) -> None:
    old, pinned = ended(server), ended(server, "keep=yes")
    later = ended(server)
    assert server.ann.http.post(f"/v1/runs/{later}:keep").json()["labels"]["keep"] == "yes"
    running = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(running, State.RUNNING)
    looks = keeper_of(server, age="0.2 s")
    time.sleep(0.3)
    looks.look()
    answer = server.ann.http.get(f"/v1/runs/{old}")
    assert (answer.status_code, answer.json()["code"]) == (410, "gone")
    assert "older than 0.2 s" in answer.json()["detail"]
    kept = answer.json()["outcome"]
    assert (kept["state"], kept["steps"], kept["owner"]) == ("succeeded", 3, "ann")
    assert kept["bytes"] > 0
    assert server.bob.http.get(f"/v1/runs/{old}").status_code == 404
    for path in ("events", "files", "history", "stream", "logs/0"):
        assert server.ann.http.get(f"/v1/runs/{old}/{path}").status_code == 410
    assert [server.ann.show(run)["state"] for run in (pinned, later, running)] == ["succeeded", "succeeded", "running"]
    server.ann.http.post(f"/v1/runs/{later}:release")
    looks.look()
    assert server.ann.http.get(f"/v1/runs/{later}").status_code == 410
    (tmp_path / "go").touch()


def test_the_oldest_go_until_the_rest_is_small_enough(server: Running) -> None:
    runs = [ended(server) for _ in range(3)]
    for run in runs:
        (server.ann.runs / run / "large").write_bytes(b"x" * 1_000_000)
    looks = keeper_of(server, bytes=2_500_000)
    looks.look()
    assert [server.ann.http.get(f"/v1/runs/{run}").status_code for run in runs] == [410, 200, 200]
    assert 2_000_000 < looks.kept("ann") < 2_500_000
    assert "more than 2.50 MB" in server.ann.http.get(f"/v1/runs/{runs[0]}").json()["detail"]


def test_the_removal_of_a_run_is_reported_to_its_user(server: Running) -> None:
    run = ended(server)
    assert server.ann.http.delete(f"/v1/runs/{run}").status_code == 204
    answer = server.ann.http.delete(f"/v1/runs/{run}")
    assert (answer.status_code, answer.json()["outcome"]["why"]) == (410, "by ann")


def test_removed_runs_are_in_no_list(server: Running) -> None:
    """In an earlier version a removed run was listed as ``succeeded`` and as the newest run, although every request for
    this run fails.
    """
    runs = [ended(server) for _ in range(4)]
    for gone in (runs[3], runs[1]):
        server.ann.http.delete(f"/v1/runs/{gone}")
    first = server.ann.http.get("/v1/runs", params={"limit": 1}).json()
    second = server.ann.http.get("/v1/runs", params={"limit": 1, "cursor": first["next"]}).json()
    assert [[run["id"] for run in page["runs"]] for page in (first, second)] == [[runs[2]], [runs[0]]]
    assert second["next"] is None


def places_of(user: User, run: str) -> dict[str, bool]:
    """Returns the answers in which a successful run occurs."""
    text = user.http.get("/metrics").text
    return {
        "list": run in [line["id"] for line in user.http.get("/v1/runs").json()["runs"]],
        "prefix": bool(user.http.get("/v1/runs", params={"prefix": run}).json()["runs"]),
        "metrics": 'conoid_runs{state="succeeded"} 2.0' in text,
        "show": user.http.get(f"/v1/runs/{run}").status_code == 200,
    }


def test_a_run_whose_folder_was_removed_is_in_no_answer(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(existing, "_FRESH", 0.0)
    run, _ = ended(server), ended(server)
    everywhere, nowhere = (
        dict.fromkeys(places_of(server.ann, run), True),
        dict.fromkeys(places_of(server.ann, run), False),
    )
    assert places_of(server.ann, run) == everywhere
    folder = server.ann.runs / run
    folder.rename(folder.with_name("away"))
    assert places_of(server.ann, run) == nowhere
    folder.with_name("away").rename(folder)
    assert places_of(server.ann, run) == everywhere


def test_a_list_reads_names_once_a_second_and_no_folder(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = [ended(server) for _ in range(3)]
    shutil.rmtree(server.ann.runs / runs[0])
    looked: list[str] = []
    there, names = ExistingRuns.there, os.listdir

    def one(self: ExistingRuns, run: str) -> bool:
        looked.append(run)
        return there(self, run)

    def every(path: Path) -> list[str]:
        looked.append("names")
        return names(path)

    monkeypatch.setattr(ExistingRuns, "there", one)
    monkeypatch.setattr(os, "listdir", every)
    listed = ExistingRuns(server.ann.runs)
    known = [run for run in server.service.store.all() if run.id in runs]
    for _ in range(20):
        assert sorted(run.id for run in listed.left(known)) == sorted(runs[1:])
    assert looked == ["names", runs[0]]


def test_no_run_is_gone_because_the_folder_of_all_is_not_there(server: Running) -> None:
    run, runs = ended(server), server.ann.runs
    runs.rename(runs.with_name("away"))
    runs.mkdir()
    try:
        assert server.ann.http.get(f"/v1/runs/{run}").status_code == 503
        assert server.ann.http.get("/v1/runs").status_code in {200, 503}
    finally:
        runs.rmdir()
        runs.with_name("away").rename(runs)
    assert server.ann.show(run)["state"] == "succeeded"


def test_lines_survive_a_lost_database_and_a_torn_end(server: Running, tmp_path: Path) -> None:
    run, other = ended(server), ended(server)
    server.ann.http.delete(f"/v1/runs/{run}")
    path = server.ann.runs / FILE
    path.write_bytes(path.read_bytes() + b'{"id": "to')
    lines = RemovedRuns(server.ann.runs)
    row = server.service.store.get(other)
    assert row is not None
    lines.add(farewell(lines, run, other))
    again = RemovedRuns(server.ann.runs)
    assert [again.get(one) is not None for one in (run, other, "nobody")] == [True, True, False]
    fresh = Store(f"sqlite:///{tmp_path / 'fresh.sqlite'}")
    removal.restore(fresh, again)
    found = fresh.get(run)
    fresh.close()
    assert found is not None
    assert (found.owner, found.state) == ("ann", State.SUCCEEDED)


def farewell(lines: RemovedRuns, run: str, other: str) -> Any:
    """Returns the record of a removed run, for another id."""
    line = lines.get(run)
    assert line is not None
    return msgspec.structs.replace(line, id=other)


@pytest.mark.parametrize("verb", ["keep", "release"])
def test_others_pin_nothing(server: Running, verb: str) -> None:
    assert server.bob.http.post(f"/v1/runs/{ended(server)}:{verb}").status_code == 404


def test_bytes_written_after_the_last_check_of_a_run_count(server: Running, tmp_path: Path) -> None:
    run = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(run, State.RUNNING)
    looks = keeper_of(server, age="1 h")
    looks.look()
    before = looks.kept("ann")
    (server.ann.runs / run / "large").write_bytes(bytes(1_000_000))
    (tmp_path / "go").touch()
    server.ann.wait_for(run)
    looks.look()
    assert looks.kept("ann") > before + 1_000_000
    looks.look()
    assert looks.kept("ann") > before + 1_000_000


def test_a_user_gets_the_disk_usage_of_own_runs_without_any_rule(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    def bytes_of(user: User) -> int:
        return int(user.http.get("/v1/me").json()["used"]["output_bytes"])

    monkeypatch.setattr(removal, "_PATIENCE", 0.0)
    assert bytes_of(server.ann) == 0
    (server.ann.runs / ended(server) / "large").write_bytes(bytes(1_000_000))
    assert 1_000_000 < bytes_of(server.ann) < 1_100_000
    assert bytes_of(server.bob) == 0


def test_a_run_removed_during_a_check_does_not_end_the_check(server: Running) -> None:
    first, second = ended(server), ended(server)
    looks = keeper_of(server, bytes=1)
    store = server.service.store

    def removed(folder: Path) -> bool:
        run = store.get(folder.name)
        assert run is not None
        looks.remove(run, "by ann")
        return False

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pins, "pinned", removed)
        looks.look()
    for run in (first, second):
        assert "by ann" in server.ann.http.get(f"/v1/runs/{run}").json()["detail"]
    assert looks.kept("ann") == 0


def test_no_error_ends_the_periodic_checks(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    looked = threading.Event()
    left = [2]

    def fails(self: Removal) -> None:
        left[0] -= 1
        if left[0] >= 0:
            raise KeyError("an unexpected error")
        looked.set()

    monkeypatch.setattr(Removal, "look", fails)
    looks = keeper_of(server, age="1 h", every="0.01 s")
    looks.start()
    assert looked.wait(5)
    looks.close()
