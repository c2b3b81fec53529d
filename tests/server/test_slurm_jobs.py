"""Decisions about Slurm jobs, without Slurm: lost answers, second jobs, the meaning of signals, the lock."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from conoid.cases.messages import Status
from conoid.cases.output import layout
from conoid.cases.run import Cause, State
from conoid.cases.site import batch, slurm, slurm_call
from conoid.cases.site.batch import Job, Profile, Slurm
from conoid.cases.site.slurm import Entry
from conoid.server.launch.arrays import Arrays
from conoid.server.launch.slurm import SlurmLauncher
from conoid.server.launch.slurm_run import SlurmWorker
from conoid.server.runs import journal, recovery
from conoid.server.runs.events import Run
from conoid.server.runs.folder import Submission, create, new_id
from conoid.server.settings import Settings
from conoid.worker.run import job as attempt
from conoid.worker.run.lock import hold

from .fake_slurm import ACCEPT, commands

JOB = batch.new_job("run", 2, ("a", Profile()), ["true"], 0.0)


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """Folders for the Slurm commands and for the run."""
    (tmp_path / "bin").mkdir()
    (tmp_path / "run" / layout.LOGS).mkdir(parents=True)
    return tmp_path


def calls(place: Path) -> int:
    path = place / "calls"
    return len(path.read_text().splitlines()) if path.exists() else 0


def test_a_job_whose_number_was_lost_on_the_way_is_not_handed_over_again(place: Path) -> None:
    found = commands(place, f"{ACCEPT}; echo 'sbatch: error: Socket timed out on send/recv operation' >&2; exit 1")
    with pytest.raises(slurm_call.AwayError):
        slurm.submit(found, place / "run", JOB, Profile())
    assert slurm.submit(found, place / "run", JOB, Profile()) == "101"
    assert calls(place) == 1


def test_no_job_is_submitted_while_the_queue_cannot_be_read(place: Path) -> None:
    found = commands(place, f"{ACCEPT}; echo 101")
    (place / "away").touch()
    with pytest.raises(slurm_call.AwayError):
        slurm.submit(found, place / "run", JOB, Profile())
    assert calls(place) == 0


@pytest.mark.parametrize(
    "output", [b"\xff{|||\n", b"<html>\n", b"7|\n", b"7|RUNNING|0|conoid-a|None\n8|PEND", b"a|b|c|d|e\n"]
)
def test_an_invalid_list_is_not_an_empty_list(place: Path, output: bytes) -> None:
    """A damaged list of jobs is no empty list: otherwise a run whose job is missing in the list would be submitted
    again.
    """
    found = commands(place, "echo 101")
    (place / "queue").write_bytes(output)
    with pytest.raises(slurm_call.AwayError, match="squeue"):
        slurm.submit(found, place / "run", JOB, Profile())
    assert calls(place) == 0


@pytest.mark.parametrize("output", ["", "<html>", "101 102"])
def test_a_missing_job_number_is_searched(place: Path, output: str) -> None:
    found = commands(place, f"{ACCEPT}; echo '{output}'")
    with pytest.raises(slurm_call.AwayError, match="sbatch"):
        slurm.submit(found, place / "run", JOB, Profile())
    assert slurm.submit(found, place / "run", JOB, Profile()) == "101"
    assert calls(place) == 1


def test_an_sbatch_that_outlives_its_server_keeps_the_next_from_a_second(place: Path) -> None:
    found = commands(place, f"sleep 2; {ACCEPT}; echo 101")
    code = (
        "from pathlib import Path; from conoid.cases.site import batch, slurm\n"
        f"job = batch.new_job('run', 2, ('a', batch.Profile()), ['true'], 0.0)\n"
        f"slurm.submit({found!r}, Path({str(place / 'run')!r}), job, batch.Profile())"
    )
    server = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL)
    while not calls(place):
        assert server.poll() is None
    server.kill()
    server.wait(10)
    with pytest.raises(slurm_call.AwayError, match="under way"):
        slurm.submit(found, place / "run", JOB, Profile())
    assert calls(place) == 1


@pytest.mark.parametrize(
    ("output", "kind"),
    [
        ("sbatch: error: Batch job submission failed: Invalid partition name specified", slurm_call.RefusedError),
        (
            "sbatch: error: Batch job submission failed: Requested node configuration is not available",
            slurm_call.RefusedError,
        ),
        (
            "sbatch: error: Batch job submission failed: Unable to contact slurm controller (connect failure)",
            slurm_call.AwayError,
        ),
        ("slurm_load_jobs error: Zero Bytes were transmitted or received", slurm_call.AwayError),
        ("sbatch: error: If munged is up, restart with --num-threads=10", slurm_call.AwayError),
    ],
)
def test_a_refusal_by_slurm_is_distinguished_from_a_missing_answer(
    place: Path, output: str, kind: type[Exception]
) -> None:
    found = commands(place, f"echo '{output}' >&2; exit 1")
    with pytest.raises(kind):
        slurm_call.call(found, ["sbatch"])


def test_of_two_jobs_the_one_that_has_begun_stays(place: Path) -> None:
    found = commands(place, "exit 1")
    layout.claim(place / "run", JOB.name).write_text("8")
    worker = SlurmWorker(place / "run", JOB, Slurm(profiles={"a": Profile()}, bin=found))
    entries = [Entry("7", "PENDING", 0.0, JOB.name, "Resources"), Entry("8", "RUNNING", 5.0, JOB.name, "None")]
    worker.write_down(job="7")
    worker.turn(entries)
    assert (place / "ended").read_text() == "7\n"
    assert (worker.phase(), worker.began()) == ("runs", 5.0)
    record = batch.read_job(place / "run")
    assert record is not None
    assert record.job == "8"


@pytest.mark.parametrize("reason", ["launch failed requeued held", "launch_failed_requeued_held"])
def test_a_job_that_no_node_starts_is_released_a_few_times_and_then_lost(place: Path, reason: str) -> None:
    """Slurm holds the job until an operator releases the job; a run never waits for the operator."""
    worker = SlurmWorker(place / "run", JOB, Slurm(profiles={"a": Profile()}, bin=commands(place, "exit 1")))
    worker.write_down(job="7")
    held, runs = Entry("7", "PENDING", 0.0, JOB.name, reason), Entry("7", "RUNNING", 5.0, JOB.name, "None")
    for entry in (held, runs, held, held):
        worker.turn([entry])
        assert worker.exited() is None
    assert (place / "released").read_text().splitlines() == ["release 7"] * 3
    worker.turn([held])
    assert (place / "ended").read_text() == "7\n"
    ended = worker.exited()
    assert ended is not None
    assert ended.reading is not None
    assert ended.reading[:2] == (State.LOST, Cause.NODE)


@pytest.mark.parametrize("reason", ["JobHeldUser", "JobHeldAdmin", "Resources"])
def test_a_held_job_stays_held(place: Path, reason: str) -> None:
    worker = SlurmWorker(place / "run", JOB, Slurm(profiles={"a": Profile()}, bin=commands(place, "exit 1")))
    worker.write_down(job="7")
    worker.turn([Entry("7", "PENDING", 0.0, JOB.name, reason)])
    assert not (place / "released").exists()
    assert worker.note().endswith(reason)


@pytest.mark.parametrize(("asked", "state"), [(None, State.RUNNING), (Cause.CANCELLED, State.STOPPING)])
def test_a_restarted_server_ends_no_run_that_was_interrupted(
    tmp_path: Path, asked: Cause | None, state: State, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The worker has reported that it stopped. Only the database contains that a user requested the stop."""
    monkeypatch.setattr(SlurmLauncher, "_work", lambda launcher: None)
    run, now = new_id()
    made = Submission(
        id=run, owner="ann", name="bar", title="", ranks=2, submitted=now, case_file="case.toml", body_sha256="",
        idempotency_key=None, wall_time=None, estimate={},
    )  # fmt: skip
    folder = create(tmp_path, made, b"", b"{}")
    for last in (State.QUEUED, State.STARTING, State.RUNNING, State.STOPPING):
        journal.append(folder / layout.JOURNAL, Status(run=run, wall=now, state=last))
    (folder / layout.JOB).write_bytes(batch.to_json(JOB))
    site = Slurm(profiles={"a": Profile()}, bin=commands_of(tmp_path))
    known = Run(run, "ann", "bar", 2, now, state=State.RUNNING, stopping_for=asked)
    left = recovery.look(folder, known, SlurmLauncher(Settings(runs=tmp_path), site))
    assert (left.run.state, left.run.stopping_for, left.found.worker) == (state, asked, "alive")


def commands_of(place: Path) -> str:
    """Writes commands of a Slurm that does not answer."""
    (place / "bin").mkdir()
    (place / "away").touch()
    return commands(place, "exit 1")


def test_a_job_that_waits_though_its_run_has_ended_is_taken_out(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A controller of Slurm that crashed has requeued a started job under the same number."""
    run = place / "run"
    worker = SlurmWorker(run, JOB, Slurm(profiles={"a": Profile()}, bin=commands(place, "exit 1")))
    worker.write_down(job="7", command=["false"])
    (run / layout.OUTCOME).write_text("{}")
    monkeypatch.setattr(attempt.Relay, "listen", lambda self: None)
    monkeypatch.setenv("SLURM_JOB_ID", "7")
    assert attempt.main([str(run), JOB.name]) == 0, "nothing is run again"
    worker.turn([Entry("7", "PENDING", 0.0, JOB.name, "launch failed requeued held")])
    assert (place / "ended").read_text() == "7\n"
    assert worker.over


@pytest.mark.parametrize(
    ("state", "reading"),
    [
        ("CANCELLED", (State.CANCELLED, Cause.CANCELLED)),
        ("TIMEOUT", (State.TIMED_OUT, Cause.WALLTIME)),
        ("OUT_OF_MEMORY", (State.FAILED, Cause.MEMORY)),
        ("REVOKED", (State.LOST, Cause.NODE)),
    ],
)
def test_an_end_without_outcome_is_read_from_slurm(place: Path, state: str, reading: tuple[State, Cause]) -> None:
    worker = SlurmWorker(place / "run", JOB, Slurm(profiles={"a": Profile()}, bin=commands(place, "exit 1")))
    worker.write_down(job="7")
    worker.turn([Entry("7", state, 5.0, JOB.name, "None")])
    ended = worker.exited()
    assert ended is not None
    assert ended.reading is not None
    assert ended.reading[:2] == reading


@pytest.mark.parametrize("state", ["PREEMPTED", "NODE_FAIL", "FAILED"])
def test_a_job_that_was_interrupted_gets_a_next_one(place: Path, state: str) -> None:
    worker = SlurmWorker(place / "run", JOB, Slurm(profiles={"a": Profile()}, bin=commands(place, "exit 1")))
    worker.write_down(job="7")
    (place / "run" / layout.INTERRUPTED).write_text("{}")
    worker.turn([Entry("7", state, 5.0, JOB.name, "None")])
    assert (worker.exited(), worker.phase()) == (None, "waits")
    record = batch.read_job(place / "run")
    assert record is not None
    assert (record.attempt, record.job) == (2, "")
    assert record.name != JOB.name
    worker.stop()
    worker.turn([])
    assert worker.exited() is not None, "nothing is handed over once somebody has asked for the end"
    assert calls(place) == 0


RUNNING = {"JobState": "RUNNING", "Restarts": "0", "StartTime": "1000", "TimeLimit": "01:00:00", "PreemptTime": "None"}


@pytest.mark.parametrize(
    ("changes", "now", "verdict"),
    [
        ({}, 1100.0, "outside"),
        ({"JobState": "CANCELLED"}, 1100.0, "cancelled"),
        ({}, 4450.0, "time limit"),
        ({"JobState": "COMPLETING"}, 1100.0, "cancelled"),
        ({"JobState": "COMPLETING"}, 4600.0, "unknown"),
        ({"PreemptTime": "1090"}, 1100.0, "preempted"),
        ({"PreemptTime": "1090", "JobState": "COMPLETING"}, 1100.0, "unknown"),
        ({"JobState": "COMPLETING", "Restarts": "1"}, 1100.0, "requeued"),
        ({"TimeLimit": "UNLIMITED"}, 9e9, "outside"),
        ({"TimeLimit": "1-00:00:00"}, 4450.0, "outside"),
        ({"TimeLimit": "1-00:00:00", "JobState": "COMPLETING"}, 4450.0, "cancelled"),
    ],
)
def test_a_signal_is_mapped_to_a_cause(changes: dict[str, str], now: float, verdict: str) -> None:
    assert attempt.judge({**RUNNING, **changes}, 0, 120.0, now) == verdict
    assert attempt.judge({}, 0, 120.0, now) == "unknown"


def test_the_first_job_of_a_name_has_the_run_and_may_come_back(tmp_path: Path) -> None:
    assert attempt.claim(tmp_path, JOB, "7")
    assert not attempt.claim(tmp_path, JOB, "8")
    assert attempt.claim(tmp_path, JOB, "7")
    assert slurm.begun(tmp_path, JOB) == "7"


def test_a_job_that_starts_after_the_stop_runs_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = Job(**{**{name: getattr(JOB, name) for name in JOB.__struct_fields__}, "command": ["false"]})
    (tmp_path / layout.JOB).write_bytes(batch.to_json(record))
    (tmp_path / layout.STOP_REQUEST).touch()
    monkeypatch.setattr(attempt.Relay, "listen", lambda self: None)
    assert attempt.main([str(tmp_path), JOB.name]) == 0
    assert '"state": "cancelled"' in (tmp_path / layout.OUTCOME).read_text()


def test_one_worker_writes_into_a_folder(tmp_path: Path) -> None:
    assert not slurm.held(tmp_path)
    first = hold(tmp_path)
    assert first is not None
    assert slurm.held(tmp_path)
    assert hold(tmp_path, 0.3) is None
    first.close()
    assert not slurm.held(tmp_path)
    second = hold(tmp_path, 0.3)
    assert second is not None
    second.close()


def test_a_wrong_number_of_ranks_is_reported(tmp_path: Path) -> None:
    """Without --mpi=pmi2, srun starts processes each of which is an MPI world of one rank."""
    words = [sys.executable, "-m", "conoid.worker", "two_tets", "--out", str(tmp_path / "out"), "--ranks", "2"]
    ended = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert ended.returncode == 1
    assert "MPI has started 1 rank(s) instead of 2" in ended.stderr
    assert not (tmp_path / "out").exists()


ARRAY = """#!/bin/bash
for word in "$@"; do case "$word" in
--job-name=*) name="${{word#--job-name=}}";; --array=*) tasks="${{word#--array=}}";; esac; done
cd {place}; echo "$tasks" >> arrays; {body}
number=$((100 + $(wc -l < arrays)))
for task in ${{tasks//,/ }}; do echo "${{number}}_$task|PENDING|N/A|$name|Resources" >> queue; done
echo $number
"""


def group_of(place: Path, number: int, body: str = "") -> tuple[Arrays, list[SlurmWorker]]:
    """Returns runs of one sweep that are not submitted yet; sbatch runs ``body`` first."""
    bin_ = commands(place, "exit 1")
    (place / "bin" / "sbatch").write_text(ARRAY.format(place=place, body=body))
    site, made = Slurm(profiles={"a": Profile()}, bin=bin_), []
    for n in range(number):
        folder = place / f"run{n}"
        folder.mkdir()
        made.append(SlurmWorker(folder, batch.new_job(f"r{n}", 1, ("a", Profile()), ["true"], 0.0), site, "ann/s"))
        made[-1].since = 0.0
    return Arrays(place, site), made


def numbers(workers: list[SlurmWorker]) -> list[str]:
    return [worker.record.job for worker in workers]


def test_runs_that_start_together_are_one_array(place: Path) -> None:
    arrays, workers = group_of(place, 3)
    workers[0].since = time.monotonic()
    assert arrays.hand_over(workers) == {worker.name for worker in workers}, "it may still grow"
    workers[0].since = 0.0
    assert arrays.hand_over(workers) == set()
    assert numbers(workers) == ["101_0", "101_1", "101_2"]
    assert (place / "arrays").read_text() == "0,1,2\n"
    records = [batch.read_job(worker.folder) for worker in workers]
    assert [job.key for job in records if job] == [entry.name for entry in slurm.jobs(str(place / "bin"))]
    arrays.hand_over(workers)
    assert (place / "arrays").read_text() == "0,1,2\n"


def test_an_array_whose_number_was_lost_is_not_submitted_again(place: Path) -> None:
    """The next server, which has only the records, does not submit the array again. The next server submits a task that
    does not exist.
    """
    lost = 'echo "101_0|PENDING|N/A|$name|R" >> queue; echo "sbatch: error: Socket timed out" >&2; exit 1'
    arrays, workers = group_of(place, 2, lost)
    with pytest.raises(slurm_call.AwayError):
        arrays.hand_over(workers)
    records = [batch.read_job(worker.folder) for worker in workers]
    again = [SlurmWorker(w.folder, job, w._site) for w, job in zip(workers, records, strict=True) if job]
    (place / "bin" / "sbatch").write_text(ARRAY.format(place=place, body=""))
    arrays.hand_over(again)
    assert numbers(again) == ["101_0", "102_1"]
    assert (place / "arrays").read_text() == "0,1\n1\n"


def test_an_array_that_is_refused_goes_one_by_one(place: Path) -> None:
    arrays, workers = group_of(place, 2, 'echo "sbatch: error: Invalid job array specification" >&2; exit 1')
    arrays.hand_over(workers)
    assert len({worker.name for worker in workers}) == 2
    assert [worker.record.task for worker in workers] == [None, None]
    assert arrays.hand_over(workers) == set()
    assert (place / "arrays").read_text() == "0,1\n"


def test_a_task_finds_its_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The task computes nothing if another job has the run."""
    (tmp_path / "run" / layout.LOGS).mkdir(parents=True)
    (tmp_path / layout.ARRAY).write_text(json.dumps([str(tmp_path), str(tmp_path / "run")]))
    monkeypatch.setattr(os, "dup2", lambda log, stream: None)
    env = {"SLURM_ARRAY_TASK_ID": "1", "SLURM_ARRAY_JOB_ID": "7", "SLURM_JOB_ID": "9"}
    assert attempt._place(tmp_path, env) == (tmp_path / "run", "7_1")
    assert attempt._place(tmp_path / "run", env) == (tmp_path / "run", "9")
