"""A server that is killed loses no acknowledged run, and the workers of the runs continue."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.run import State
from conoid.server.__main__ import main
from conoid.server.runs.folder import Submission, create, new_id

from .running import PATIENCE, TOML, MakeProcess, Process, User, case_text, processes

SLOTS = 12


@dataclass
class Aftermath:
    """State after a kill: a new server continues the runs of the killed server, which had runs in every state."""

    ann: User
    runs: Path
    go: Path
    names: dict[str, str]
    pids: dict[str, int]

    def show(self, name: str) -> dict[str, Any]:
        """Returns the state that the new server reports for the named run."""
        return self.ann.show(self.names[name])

    def last_words(self, name: str) -> float:
        """Returns the time of the last message that the worker of the run wrote."""
        return float(self.ann.events(self.names[name])[-2]["wall"])

    def states(self, name: str) -> list[str]:
        """Returns the states in the run's journal."""
        return self.ann.states(self.names[name])


@pytest.fixture(scope="module")
def after(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Aftermath]:
    folder = tmp_path_factory.mktemp("killed")
    with processes(folder) as make:
        server = make("--no-zenoh", "--slots", str(SLOTS))
        yield stage(server, folder)


def stage(server: Process, folder: Path) -> Aftermath:
    """Brings runs into every state, kills the server, waits, and starts the next server."""
    ann, go, soon = server.user(server.start()["url"]), folder / "go", folder / "soon"
    names = {
        "lives": ann.submit(ranks=2, wait=str(go)),
        "unrecorded": ann.submit(wait=str(go)),
        "obeys": ann.submit(steps=100_000, pace=0.01),
        "deaf": ann.submit(end="deaf", steps=1),
        "finishes": ann.submit(wait=str(soon)),
        "dies": ann.submit(wait=str(go)),
        "rebooted": ann.submit(wait=str(go)),
        "replaced": ann.submit(wait=str(go)),
    }
    for run in names.values():
        ann.wait_for(run, State.RUNNING)
    names["large"] = ann.submit(ranks=SLOTS)
    names["announced"] = ann.submit()
    names |= {f"small {number}": ann.submit(steps=1) for number in range(8)}
    ann.wait_for(names["small 7"], State.QUEUED)
    ann.http.post(f"/v1/runs/{names['deaf']}:cancel")
    server.end(signal.SIGKILL)

    soon.touch()
    records = {name: server.runs / names[name] / "worker.json" for name in names}
    worker_records = {name: json.loads(path.read_text()) for name, path in records.items() if path.exists()}
    records["unrecorded"].unlink()
    for name in ("dies", "rebooted", "replaced"):
        os.kill(worker_records[name]["pid"], signal.SIGKILL)
    for name in ("finishes", "dies", "rebooted", "replaced"):
        gone(names[name])
    records["rebooted"].write_text(json.dumps({**worker_records["rebooted"], "boot": "another"}))
    records["replaced"].write_text(json.dumps({**worker_records["replaced"], "pid": os.getpid()}))
    with (server.runs / names["announced"] / "journal.jsonl").open("a") as file:
        line = {"type": "status", "run": names["announced"], "seq": 3, "wall": 1.0, "state": "starting"}
        file.write(json.dumps(line) + "\n")
    names["accepted"] = accepted(server.runs)
    (server.runs / f".new-{names['accepted']}").mkdir()
    ann = server.user(server.start()["url"])
    return Aftermath(ann, server.runs, go, names, {name: record["pid"] for name, record in worker_records.items()})


def accepted(runs: Path) -> str:
    """Makes a run whose server was killed directly after it accepted the run."""
    run, now = new_id()
    made = Submission(
        id=run, owner="ann", name="bar", title="", ranks=1, submitted=now, case_file="case.toml", body_sha256="",
        idempotency_key=None, wall_time=None, estimate={},
    )  # fmt: skip
    create(runs, made, case_text().encode(), b"{}")
    return run


def test_a_living_worker_is_adopted_and_keeps_its_slots(after: Aftermath) -> None:
    assert after.show("lives")["state"] == "running"
    assert after.show("large")["state"] == "queued"
    assert after.ann.http.get("/v1/me").json()["slots"]["used"] >= 2


def test_a_worker_without_a_record_is_found(after: Aftermath) -> None:
    assert after.show("unrecorded")["state"] == "running"
    record = json.loads((after.runs / after.names["unrecorded"] / "worker.json").read_text())
    assert record["pid"] == after.pids["unrecorded"]


def test_an_adopted_worker_can_be_cancelled(after: Aftermath) -> None:
    after.ann.http.post(f"/v1/runs/{after.names['obeys']}:cancel")
    assert after.ann.wait_for(after.names["obeys"])["state"] == "cancelled"


def test_a_worker_that_ignores_signals_is_killed_by_the_next_server(after: Aftermath) -> None:
    ended = after.ann.wait_for(after.names["deaf"])
    assert (ended["state"], ended["cause"]) == ("cancelled", "cancelled")


def test_a_worker_that_finished_meanwhile_is_read_from_its_outcome(after: Aftermath) -> None:
    ended = after.show("finishes")
    assert ended["state"] == "succeeded"
    assert after.states("finishes")[-1] == "succeeded"
    assert ended["finished"] == after.last_words("finishes"), "the time of the worker, not that of the next server"


@pytest.mark.parametrize(("name", "cause"), [("dies", "service"), ("rebooted", "node"), ("replaced", "service")])
def test_a_worker_that_died_meanwhile_is_lost(after: Aftermath, name: str, cause: str) -> None:
    ended = after.show(name)
    assert (ended["state"], ended["cause"], ended["outcome"]["state"]) == ("lost", cause, "lost")
    assert after.states(name)[-1] == "lost"
    assert ended["finished"] == after.last_words(name)
    assert ended["outcome"]["elapsed"] == pytest.approx(ended["finished"] - ended["started"])
    assert (ended["outcome"]["elements"], ended["outcome"]["steps"]) == (5, None), "reported, and not reported"


def test_everything_acknowledged_runs_once(after: Aftermath) -> None:
    after.go.touch()
    for name in ("lives", "unrecorded", "large", "announced", "accepted", *(f"small {n}" for n in range(8))):
        assert after.ann.wait_for(after.names[name])["state"] == "succeeded", name
        assert after.states(name).count("running") == 1, name
        events = after.ann.events(after.names[name])
        assert [event["seq"] for event in events] == list(range(1, len(events) + 1)), name
    assert after.states("unrecorded").count("starting") == 1
    again = ["accepted", "queued", "starting", "queued", "starting", "running", "succeeded"]
    assert after.states("announced") == again
    assert not list(after.runs.glob(".new-*"))


def test_a_stopped_server_leaves_its_workers_and_can_lose_its_database(process: MakeProcess, tmp_path: Path) -> None:
    server = process("--no-zenoh")
    ann = server.user(server.start()["url"])
    headers = {**TOML, "Idempotency-Key": "k"}
    first = ann.http.post("/v1/runs", content=case_text(), headers=headers)
    before = ann.wait_for(first.json()["id"])
    living = ann.submit(wait=str(tmp_path / "go"))
    ann.wait_for(living, State.RUNNING)
    assert server.end(signal.SIGTERM) == 0
    for path in server.runs.glob("server.sqlite*"):
        path.unlink()
    ann = server.user(server.start()["url"])
    assert ann.show(first.json()["id"]) == before
    assert ann.http.post("/v1/runs", content=case_text(), headers=headers).content == first.content
    (tmp_path / "go").touch()
    assert ann.wait_for(living)["state"] == "succeeded"


def test_a_server_ends_its_runs_on_request(process: MakeProcess, tmp_path: Path) -> None:
    server = process("--no-zenoh", "--end-runs")
    ann = server.user(server.start()["url"])
    run = ann.submit(steps=100_000, pace=0.01)
    ann.wait_for(run, State.RUNNING)
    assert server.end(signal.SIGTERM) == 0
    assert not living(run)
    assert json.loads((server.runs / run / "outcome.json").read_text())["state"] == "cancelled"


def gone(run: str) -> None:
    """Waits until all processes of the run have ended."""
    deadline = time.monotonic() + PATIENCE
    while living(run):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def living(run: str) -> bool:
    """Returns True while a process has the run in its command line."""
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                if run.encode() in (entry / "cmdline").read_bytes():
                    return True
            except OSError:
                continue
    return False


def test_the_folder_of_the_runs_may_have_any_name(tmp_path: Path) -> None:
    """The name of the folder occurs in the database, in the commands of the launcher, in the log and in the backup."""
    name = "100%s a%20b\\c #1?mode=ro&x=y;[z] 'q' \"w\" {v} $u \u00e4"
    place = tmp_path / name
    place.mkdir()
    with processes(place) as make:
        server = make("--no-zenoh")
        ann = server.user(server.start()["url"])
        run = ann.submit(ranks=2)
        assert ann.wait_for(run)["state"] == "succeeded"
        server.end(signal.SIGTERM)
        again = server.user(server.start()["url"])
        assert again.show(run)["state"] == "succeeded"
        files = again.http.get(f"/v1/runs/{run}/files").json()["files"]
        assert all(again.http.get(file["url"]).status_code == 200 for file in files)
        assert sorted(path.name for path in tmp_path.iterdir()) == [name]
        script = Path(__file__).parents[2] / "deploy" / "backup.sh"
        command = [str(script), str(server.runs / "server.sqlite"), str(place / "kept.sqlite")]
        subprocess.run(command, check=True, env={**os.environ, "PYTHON": sys.executable})
        assert (place / "kept.sqlite").stat().st_size > 0


def test_the_help_has_the_folder_of_the_runs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CONOID_RUNS", "/100%s/runs")
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "/100%s/runs" in capsys.readouterr().out


def test_a_server_leaves_nothing_of_its_reader(
    process: MakeProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    passing = tmp_path / "passing"
    passing.mkdir()
    monkeypatch.setenv("TMPDIR", str(passing))
    server = process("--no-zenoh")
    ann = server.user(server.start()["url"])
    ann.wait_for(ann.submit(steps=1))
    assert server.child is not None
    reader = [pid for pid in children(server.child.pid) if b"conoid.server.intake.reading" in command_of(pid)]
    assert len(reader) == 1
    assert not list(passing.iterdir())
    server.end(signal.SIGKILL)
    deadline = time.monotonic() + PATIENCE
    while command_of(reader[0]):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def children(pid: int) -> list[int]:
    return [int(word) for path in Path(f"/proc/{pid}/task").glob("*/children") for word in path.read_text().split()]


def command_of(pid: int) -> bytes:
    """Returns the command line of a process; empty if the process does not exist."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""
