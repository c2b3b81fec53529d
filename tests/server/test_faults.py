"""Faults other than kills: faults of disks, folders and clocks, and damaged files. The reported state of the run stays
true after each fault.
"""

import errno
import json
import os
import shutil
import signal
import sqlite3
import stat
import time
from pathlib import Path

import pytest

from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.server import durable
from conoid.server.alone import AloneError, only_one
from conoid.server.launch import processes
from conoid.server.runs import folder, retries
from conoid.server.runs.events import Run

from .faulty import House
from .running import PATIENCE, TOML, MakeProcess, Running, User, case_text


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retries, "_AGAIN", 0.02)
    monkeypatch.setattr("conoid.server.runs.supervisor._TIDY", 0.2)


def full(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


# Disks ----------------------------------------------------------------------------------------------------------------


def test_a_disk_that_is_full_at_the_launch_leaves_no_run_unfinished(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(durable, "write", full)
    monkeypatch.setattr(durable, "probe", full)
    runs = [server.ann.submit() for _ in range(3)]
    for run in runs:
        seen = server.ann.wait_for(run, State.QUEUED)
    assert server.ann.http.post(f"/v1/runs/{runs[2]}:cancel").status_code == 503
    deadline = time.monotonic() + PATIENCE
    while "No space left" not in (seen := server.ann.show(runs[0]))["reason"]:
        assert time.monotonic() < deadline, seen
    monkeypatch.undo()
    for run in runs:
        assert server.ann.wait_for(run)["state"] == "succeeded"


def test_a_launch_that_cannot_be_recorded_is_tried_again(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def fails_twice(path: Path, process: folder.Process) -> None:
        tried.append(process.pid)
        if len(tried) <= 2:
            full()
        durable.write(path / layout.WORKER, b"{}")

    monkeypatch.setattr(folder, "write_process", fails_twice)
    run = server.ann.submit()
    assert server.ann.wait_for(run)["state"] == "succeeded"
    assert len(tried) == 3
    assert server.ann.states(run).count("running") == 1


def test_a_run_whose_launch_fails_for_ever_can_be_cancelled(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folder, "write_process", full)
    run = server.ann.submit()
    server.ann.wait_for(run, State.QUEUED)
    assert server.ann.http.post(f"/v1/runs/{run}:cancel").status_code == 202
    assert (server.ann.wait_for(run)["state"], processes.of_run(run)) == ("cancelled", [])


def test_a_worker_that_complains_of_a_full_disk_failed_for_storage(server: Running) -> None:
    run = server.ann.submit(end="full")
    ended = server.ann.wait_for(run)
    assert (ended["state"], ended["cause"]) == ("failed", "storage")


def test_a_worker_names_the_removed_file(server: Running) -> None:
    """The last line on standard error is a line of MPI, which does not name the file."""
    ended = server.ann.wait_for(server.ann.submit(end="gone"))
    assert (ended["state"], ended["cause"]) == ("failed", "storage")
    assert ended["message"].endswith("its last words: a file of the run is gone or cannot be written: history.csv")


# Folders --------------------------------------------------------------------------------------------------------------


def test_a_removed_folder_ends_its_run_and_frees_its_slots(server: Running, tmp_path: Path) -> None:
    running, waiting = (server.ann.submit(ranks=2, wait=str(tmp_path / "go")) for _ in range(2))
    server.ann.wait_for(running, State.RUNNING)
    last = server.ann.submit()
    for run in (running, waiting):
        shutil.rmtree(server.service.settings.runs / run, ignore_errors=True)
        shutil.rmtree(server.service.settings.runs / run, ignore_errors=True)
    assert server.ann.wait_for(last)["state"] == "succeeded"
    for run in (running, waiting):
        answer = server.ann.http.get(f"/v1/runs/{run}")
        assert (answer.status_code, answer.json()["code"]) == (410, "gone")
        assert server.ann.http.post(f"/v1/runs/{run}:cancel").status_code == 410
        assert server.bob.http.get(f"/v1/runs/{run}").status_code == 404
        assert processes.of_run(run) == []
    assert [run["id"] for run in server.ann.http.get("/v1/runs").json()["runs"]] == [last]


def test_files_are_for_their_user_alone(process: MakeProcess) -> None:
    server = process("--no-zenoh")
    ann = server.user(server.start()["url"])
    run = ann.submit()
    ann.wait_for(run)
    for path in (server.runs, *server.runs.rglob("*")):
        mode = stat.S_IMODE(path.lstat().st_mode)
        assert mode == (0o700 if path.is_dir() else 0o600), f"{path}: {mode:o}"


def test_a_deleted_lock_admits_no_second_server(tmp_path: Path) -> None:
    with only_one(tmp_path):
        (tmp_path / "server.lock").unlink()
        with pytest.raises(AloneError, match="another server"), only_one(tmp_path):
            pass
    with only_one(tmp_path):
        pass


# Causes ---------------------------------------------------------------------------------------------------------------


def test_a_run_stopped_without_a_request_is_not_cancelled(server: Running, tmp_path: Path) -> None:
    run = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(run, State.RUNNING)
    os.kill(json.loads((server.service.settings.runs / run / layout.WORKER).read_text())["pid"], signal.SIGTERM)
    ended = server.ann.wait_for(run)
    assert (ended["state"], ended["cause"]) == ("failed", "preempted")
    assert (ended["outcome"]["state"], ended["outcome"]["cause"]) == ("failed", "preempted")


def test_a_rank_that_is_killed_is_a_matter_of_the_node(process: MakeProcess, tmp_path: Path) -> None:
    """The cause ``node`` is recorded by the server that started the run, and by a server that was started later."""
    server = process("--no-zenoh", "--slots", "4")
    ann = server.user(server.start()["url"])
    runs = [ann.submit(ranks=2, wait=str(tmp_path / "go")) for _ in range(2)]
    for n, run in enumerate(runs):
        ann.wait_for(run, State.RUNNING)
        if n:
            server.end(signal.SIGKILL)
            ann = server.user(server.start()["url"])
        pids = processes.of_run(run)
        assert len(pids) >= 3
        os.kill(pids[-1], signal.SIGKILL)
        ended = ann.wait_for(run)
        assert (ended["state"], ended["cause"]) == ("lost", "node"), ended["message"]


# Clocks ---------------------------------------------------------------------------------------------------------------


def test_a_clock_that_is_set_ends_no_run(server: Running, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    real = time.time
    run = server.ann.submit(case_text(extra='max_wall_time = "60 s"', wait=str(tmp_path / "go")))
    server.ann.wait_for(run, State.RUNNING)
    monkeypatch.setattr(time, "time", lambda: real() + 86400.0)
    time.sleep(0.2)
    assert server.ann.show(run)["state"] == "running"
    (tmp_path / "go").touch()
    assert server.ann.wait_for(run)["state"] == "succeeded"


def test_a_clock_that_is_set_back_extends_no_time_limit(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    real = time.time
    run = server.ann.submit(end="deaf", steps=1)
    server.ann.wait_for(run, State.RUNNING)
    server.ann.http.post(f"/v1/runs/{run}:cancel")
    monkeypatch.setattr(time, "time", lambda: real() - 86400.0)
    assert server.ann.wait_for(run)["state"] == "cancelled"


def test_ids_go_on_in_order_when_the_clock_was_set_back(monkeypatch: pytest.MonkeyPatch) -> None:
    first, _ = folder.new_id()
    real = time.time_ns
    monkeypatch.setattr(folder, "_last_stamp", 0)
    monkeypatch.setattr(time, "time_ns", lambda: real() - 10**15)
    assert folder.new_id()[0] < first
    folder.begin_after(first)
    assert folder.new_id()[0] > first


def test_an_adopted_run_has_used_the_time_that_it_ran(tmp_path: Path) -> None:
    ticks = os.sysconf("SC_CLK_TCK") * (time.clock_gettime(time.CLOCK_BOOTTIME) - 100.0)
    made = folder.Process(pid=1, started=int(ticks), boot="b", launched=0.0)
    folder.write_process(tmp_path, made)
    assert folder.runs_for(tmp_path) == pytest.approx(100.0, abs=1.0)


# Damaged files --------------------------------------------------------------------------------------------------------


def damaged(server: Running, run: str) -> Path:
    """Returns the folder of a run."""
    return server.service.settings.runs / run


def test_a_damaged_submission_leaves_the_state_true(server: Running, tmp_path: Path) -> None:
    run = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(run, State.RUNNING)
    (damaged(server, run) / layout.SUBMISSION).write_text('{"id": ')
    assert server.ann.show(run)["state"] == "running"
    (tmp_path / "go").touch()
    assert server.ann.wait_for(run)["state"] == "succeeded"


@pytest.mark.parametrize("name", [layout.SUBMISSION, layout.JOURNAL, layout.WORKER])
@pytest.mark.parametrize("how", ["deleted", "garbled"])
@pytest.mark.parametrize("lives", [True, False])
def test_a_file_is_lost_while_no_server_runs(tmp_path: Path, name: str, how: str, lives: bool) -> None:
    house = House(tmp_path / "runs")
    house.puppets.ends = "never"
    run = house.accept()
    until(house, run.id, State.RUNNING)
    path = house.settings.runs / run.id / name
    path.unlink() if how == "deleted" else path.write_bytes(b"\xff{")
    puppet = house.puppets.made[0]
    puppet.alive, puppet.ends = lives, "succeeded"
    house.supervisor = house.begin()
    ended = until(house, run.id)
    assert ended.state is (State.SUCCEEDED if lives else State.LOST)
    assert len(house.puppets.made) == 1, "what was launched is not launched again"
    house.store.close()


def until(house: House, run_id: str, state: State | None = None) -> Run:
    """Calls turns of the supervisor until the run is in the state or has ended."""
    for _ in range(50):
        house.supervisor._inbox.put(None)
        house.supervisor._turn()
        run = house.supervisor.current(run_id) or house.store.get(run_id)
        assert run is not None
        if run.state is state or run.state.final:
            return run
    raise AssertionError(f"the run is still {run}")


# Database -------------------------------------------------------------------------------------------------------------


def test_a_locked_database_is_reported_and_the_run_continues(
    server: Running, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    run = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(run, State.RUNNING)
    database = server.service.settings.runs / "server.sqlite"
    with sqlite3.connect(database, isolation_level=None) as other:
        other.execute("begin immediate")
        answer = server.ann.http.post("/v1/runs", content=case_text(), headers=TOML)
        assert (answer.status_code, answer.json()["code"], answer.json()["retryable"]) == (503, "unavailable", True)
        ready = server.nobody.http.get("/readyz")
        assert (ready.status_code, ready.json()["checks"]["database"]) == (503, False)
        (tmp_path / "go").touch()
        assert server.ann.wait_for(run)["state"] == "succeeded"
        assert server.ann.http.get("/v1/runs").json()["runs"][0]["state"] == "succeeded"
        other.execute("rollback")
    other.close()
    deadline = time.monotonic() + PATIENCE
    while server.nobody.http.get("/readyz").status_code != 200:
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert len(list(server.service.settings.runs.glob("[0-9]*"))) == 1, "what was refused left nothing"


def test_readiness_reports_a_full_disk(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(durable, "probe", full)
    answer = server.nobody.http.get("/readyz")
    assert (answer.status_code, answer.json()["checks"]["runs"]) == (503, False)


def test_a_cancel_is_kept_without_the_database(process: MakeProcess) -> None:
    server = process("--no-zenoh", "--grace", "300")
    ann = server.user(server.start()["url"])
    run = ann.submit(end="deaf", steps=1)
    ann.wait_for(run, State.RUNNING)
    ann.http.post(f"/v1/runs/{run}:cancel")
    server.end(signal.SIGKILL)
    for path in server.runs.glob("server.sqlite*"):
        path.unlink()
    again: User = server.user(server.start()["url"])
    assert again.show(run)["state"] == "stopping"
