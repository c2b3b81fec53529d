"""Damaged files of a run: the run's end is reported, only accepted cases are run, and no answer fails."""

import errno
import os
import shutil
import time
from pathlib import Path

import pytest
from sqlalchemy.exc import OperationalError

from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.server.runs import folder, index, launcher_log, retries
from conoid.server.runs.events import Run

from .faulty import House, Plan, faults
from .running import TOML, Running, case_text


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retries, "_AGAIN", 0.01)
    monkeypatch.setattr(retries, "_LASTING", 0.02)


def folder_in_place(path: Path) -> None:
    path.unlink(missing_ok=True)
    path.mkdir()


def turned(house: House, run: Run, state: State | None = None) -> Run:
    """Calls turns of the supervisor until the run is in the state or has ended; returns the run."""
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline:
        house.supervisor._inbox.put(None)
        house.supervisor._turn()
        seen = house.supervisor.current(run.id) or house.store.get(run.id)
        assert seen is not None
        if seen.state is state or seen.state.final:
            return seen
        time.sleep(0.002)
    raise AssertionError(f"the run is still {seen}")


@pytest.mark.parametrize("when", ["waits", "runs", "no server is there"])
def test_a_journal_that_cannot_be_written_ends_its_run(tmp_path: Path, when: str) -> None:
    house = House(tmp_path / "runs")
    house.puppets.ends = "never"
    run = house.accept()
    if when != "waits":
        turned(house, run, State.RUNNING)
    folder_in_place(house.settings.runs / run.id / layout.JOURNAL)
    if when == "no server is there":
        house.supervisor = house.begin()
    for puppet in house.puppets.made:
        assert turned(house, run, State.RUNNING).state is State.RUNNING, "a living worker is not ended"
        puppet.alive = False
    ended = turned(house, run)
    assert (ended.state, ended.cause) == (State.LOST, "storage")
    other = house.accept()
    house.puppets.ends = "succeeded"
    assert turned(house, other).state is State.SUCCEEDED, "others are not held up"
    house.supervisor = house.begin()
    assert turned(house, run).state is State.LOST
    house.store.close()


@pytest.mark.parametrize("name", [layout.SUBMISSION, layout.WORKER, layout.OUTCOME])
def test_a_folder_stands_in_the_place_of_a_file(tmp_path: Path, name: str) -> None:
    house = House(tmp_path / "runs")
    house.puppets.ends = "never"
    run = house.accept()
    turned(house, run, State.RUNNING)
    folder_in_place(house.settings.runs / run.id / name)
    house.supervisor = house.begin()
    house.puppets.made[0].alive = False
    assert turned(house, run).state is State.FAILED
    assert len(house.puppets.made) == 1
    house.store.close()


def test_a_refused_case_is_not_run(server: Running, tmp_path: Path) -> None:
    large = server.ann.submit(ranks=2, wait=str(tmp_path / "go"))
    runs = [server.ann.submit() for _ in range(4)]
    server.ann.wait_for(large, State.RUNNING)
    changed, without_case, unknown, without_logs = (server.service.settings.runs / run for run in runs)
    (changed / "case.toml").write_text(case_text(end_time="9 us"))
    (without_case / "case.toml").unlink()
    (unknown / layout.SUBMISSION).unlink()
    shutil.rmtree(without_logs / layout.LOGS)
    (tmp_path / "go").touch()
    for run in runs[:3]:
        ended = server.ann.wait_for(run)
        assert (ended["state"], ended["cause"]) == ("failed", "storage"), ended["message"]
        assert "running" not in server.ann.states(run)
    assert server.ann.wait_for(runs[3])["state"] == "succeeded", "a folder of logs is made again"


def test_answers_about_a_damaged_run_do_not_fail(server: Running) -> None:
    body, key = case_text(), {**TOML, "Idempotency-Key": "k"}
    run = server.ann.http.post("/v1/runs", content=body, headers=key).json()["id"]
    server.ann.wait_for(run)
    path = server.service.settings.runs / run
    for name in (layout.OUTCOME, layout.JOURNAL, layout.SUBMISSION):
        folder_in_place(path / name)
    assert server.ann.show(run)["state"] == "succeeded"
    assert server.ann.show(run)["outcome"] is None
    for part in ("events", "history", "snapshots"):
        answer = server.ann.http.get(f"/v1/runs/{run}/{part}")
        assert (answer.status_code, answer.json()["code"]) == (503, "unavailable"), part
    assert server.ann.http.post("/v1/runs", content=body, headers=key).status_code == 410
    (path / layout.SUBMISSION).rmdir()
    (path / layout.SUBMISSION).write_text('{"id": ')
    assert server.ann.http.post("/v1/runs", content=body, headers=key).status_code == 410


@pytest.mark.parametrize("message", ["Input/output error", "Read-only file system", "No space left on device"])
def test_complaints_of_a_disk_are_known(tmp_path: Path, message: str) -> None:
    (tmp_path / layout.LOGS).mkdir()
    log = tmp_path / layout.LOGS / layout.LAUNCHER_LOG
    log.write_text("a tet has turned inside out\n")
    assert not launcher_log.disk_failed(tmp_path)
    log.write_text(f"OSError: {message}\n")
    assert launcher_log.disk_failed(tmp_path)


def test_an_unreadable_outcome_frees_its_slots(tmp_path: Path) -> None:
    from conoid.cases.outcome import Outcome

    folder_in_place(tmp_path / layout.OUTCOME)
    folder.write_outcome(tmp_path, Outcome(state="lost", cause="service"))
    ended = folder.outcome(tmp_path)
    assert ended is not None
    assert ended.state == "lost"


def test_a_disk_that_was_full_at_the_end_is_the_cause(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    house = House(tmp_path / "runs")
    house.puppets.ends = "never"
    run = house.accept()
    turned(house, run, State.RUNNING)
    monkeypatch.setattr(launcher_log, "disk_failed", lambda _: True)
    watch = house.supervisor._watches[run.id]
    house.puppets.made[0].alive = False
    list(watch.look())
    monkeypatch.setattr(launcher_log, "disk_failed", lambda _: False)
    assert turned(house, run).cause == "storage"
    house.store.close()


@pytest.mark.parametrize("state", [State.QUEUED, State.RUNNING])
def test_a_folder_that_is_locked_away_keeps_no_server_from_its_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, state: State
) -> None:
    house = House(tmp_path / "runs")
    house.puppets.ends = "never"
    run = turned(house, house.accept(), State.RUNNING)
    if state is State.QUEUED:
        run = house.accept()
        house.supervisor._turn()
    path, lstat = house.settings.runs / run.id, Path.lstat
    refusal = PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    def refused(self: Path) -> os.stat_result:
        if path in self.parents:
            raise refusal
        return lstat(self)

    def not_renamed(source: Path, _: Path) -> None:
        raise refusal

    monkeypatch.setattr(Path, "lstat", refused)
    monkeypatch.setattr(os, "replace", not_renamed)
    for puppet in house.puppets.made:
        puppet.alive = False
    with faults(Plan(path, 0, refusal, times=10**9, reads=True)):
        house.supervisor = house.begin()
        ended = turned(house, run)
    assert (ended.state, ended.cause) == (State.LOST, "storage")
    house.store.close()


@pytest.mark.parametrize("state", [State.QUEUED, State.RUNNING])
def test_a_run_whose_folder_was_emptied_is_continued(tmp_path: Path, state: State) -> None:
    house = House(tmp_path / "runs")
    house.puppets.ends = "never"
    run = turned(house, house.accept(), State.RUNNING)
    if state is State.QUEUED:
        run = house.accept()
        house.supervisor._turn()
    path = house.settings.runs / run.id
    shutil.rmtree(path)
    path.mkdir()
    for puppet in house.puppets.made:
        puppet.alive = False
    house.supervisor = house.begin()
    ended = turned(house, run)
    assert ended.state in {State.LOST, State.FAILED}
    assert len(house.puppets.made) == 1
    house.store.close()


def test_an_end_that_the_database_missed_twice_is_written_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The end of the run could not be written to the database, neither at the end of the run nor at the start of the
    next server.
    """
    house = House(tmp_path / "runs")
    run = house.accept()

    def away(*_: object) -> None:
        raise OperationalError("update", {}, Exception("database is locked"))

    with monkeypatch.context() as patch:
        patch.setattr(house.store, "save", away)
        patch.setattr(house.store, "add", away)
        assert turned(house, run).state is State.SUCCEEDED
        house.supervisor = house.begin()
        seen = house.supervisor.current(run.id)
        assert seen is not None
        assert seen.state is State.SUCCEEDED, "the database still has the state of a waiting run"
    monkeypatch.setattr(index, "_REST", 0.0)
    house.supervisor._tidy()
    row = house.store.get(run.id)
    assert row is not None
    assert (row.state, house.supervisor.current(run.id)) == (State.SUCCEEDED, None)
    house.store.close()
