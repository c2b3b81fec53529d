"""Temporary refusals of Slurm, unusual names, cancels by the operator, and Slurm commands that hang."""

import time
from pathlib import Path

import msgspec
import pytest

from conoid.cases.output import layout
from conoid.cases.run import Cause, State
from conoid.cases.site import batch, slurm, slurm_call
from conoid.cases.site.batch import Profile, Slurm
from conoid.cases.site.slurm import Entry
from conoid.server.launch.accounting import Accounting
from conoid.server.launch.slurm_run import SlurmWorker

from .fake_slurm import commands

FAILED = "sbatch: error: Batch job submission failed: "
POLICY = f"{FAILED}Job violates accounting/QOS policy (job submit limit, user's size and/or time limits)"
PASSING = (
    f"sbatch: error: AssocMaxSubmitJobLimit\n{POLICY}",
    f"sbatch: error: QOSMaxSubmitJobPerUserLimit\n{POLICY}",
    f"sbatch: error: AssocGrpSubmitJobsLimit\n{POLICY}",
    f"sbatch: error: QOSMaxJobsPerUserLimit\n{POLICY}",
    POLICY,
    f"{FAILED}Required partition not available (inactive or drain)",
    f"{FAILED}Requested partition configuration not available now",
    f"{FAILED}Resource temporarily unavailable",
    f"{FAILED}Slurm temporarily unable to accept job, sleeping and retrying",
    f"{FAILED}I/O error writing script/environment to file",
)
LASTING = (
    f"{FAILED}Invalid account or account/partition combination specified",
    f"{FAILED}Invalid qos specification",
    f"{FAILED}User's group not permitted to use this partition",
    f"{FAILED}Requested time limit is invalid (missing or exceeds some limit)",
    f"{FAILED}Requested node configuration is not available",
    f"sbatch: error: QOSMaxCpuPerJobLimit\n{POLICY}",
    f"sbatch: error: AssocMaxWallDurationPerJobLimit\n{POLICY}",
)
AWAY = (
    f"{FAILED}Unable to contact slurm controller (connect failure)",
    f"{FAILED}Socket timed out on send/recv operation",
    "sbatch: error: auth_munge: _print_cred: Munge encode failed: Failed to access",
)


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "bin").mkdir()
    return tmp_path


def worker_of(place: Path, name: str = "run", accounting: Accounting | None = None) -> SlurmWorker:
    """Returns a run that is not submitted yet."""
    folder = place / name
    (folder / layout.LOGS).mkdir(parents=True)
    job = batch.new_job(name, 1, ("a", Profile()), ["true"], 0.0, place=str(place / "bin"))
    made = SlurmWorker(folder, job, Slurm(profiles={"a": Profile()}, bin=str(place / "bin")), accounting=accounting)
    made.write_down()
    return made


def answers(place: Path, text: str, code: int = 1) -> None:
    """Sets the answer of sbatch."""
    (place / "answer").write_text(f"{text}\n")
    commands(place, f"cat answer >&2; exit {code}")


@pytest.mark.parametrize("output", PASSING)
def test_a_run_waits_for_a_refusal_that_passes(place: Path, output: str) -> None:
    answers(place, output)
    worker = worker_of(place)
    worker.turn([])
    assert worker.exited() is None
    assert (worker.phase(), worker.over) == ("waits", False)
    assert output.splitlines()[-1][:80] in worker.note()
    worker.turn([])
    assert (place / "calls").read_text() == "called\n", "asked again after a pause"
    commands(place, "echo 7")
    worker._not_before = 0.0
    worker.turn([])
    assert worker.record.job == "7"
    assert "takes no job" not in worker.note()


@pytest.mark.parametrize("output", LASTING)
def test_a_refusal_that_lasts_fails_the_run(place: Path, output: str) -> None:
    answers(place, output)
    worker = worker_of(place)
    worker.turn([])
    ended = worker.exited()
    assert ended is not None
    assert ended.reading is not None
    assert ended.reading[:2] == (State.FAILED, Cause.LAUNCH)
    assert output.splitlines()[-1] in ended.reading[2]


@pytest.mark.parametrize("output", AWAY)
def test_a_controller_that_is_away_has_refused_nothing(place: Path, output: str) -> None:
    answers(place, output)
    with pytest.raises(slurm_call.AwayError):
        worker_of(place).turn([])


def test_a_run_that_waits_so_can_be_cancelled(place: Path) -> None:
    answers(place, PASSING[0])
    worker = worker_of(place)
    worker.turn([])
    worker.stop()
    worker.turn([])
    assert worker.exited() is not None


EVIL = ("a\nb", "a|b\n5|RUNNING", "\n", "a\n\nb|", "x" * 400, "|||||", "\t%j")


@pytest.mark.parametrize("name", EVIL)
@pytest.mark.parametrize("first", [True, False])
def test_a_name_of_another_job_hides_no_run(place: Path, name: str, first: bool) -> None:
    commands(place, "echo 7")
    own, other = "8|RUNNING|5|conoid-run-1|None\n", f"4|PENDING|N/A|{name}|Resources\n"
    (place / "queue").write_text(other + own if first else own + other)
    assert [entry.job for entry in slurm.jobs(str(place / "bin"), "conoid-run-1")] == ["8"]


@pytest.mark.parametrize(
    "output", ["nonsense\n", "8|RUNNING|5|conoid-run-1|None", "\n", "8|running|5|a|None\n", "slurm: x\n"]
)
def test_invalid_output_is_not_read_as_an_empty_list(place: Path, output: str) -> None:
    commands(place, "echo 7")
    (place / "queue").write_text(output)
    with pytest.raises(slurm_call.AwayError):
        slurm.jobs(str(place / "bin"), "conoid-run-1")


def test_words_of_a_path_are_no_state_of_a_job(place: Path) -> None:
    commands(place, "echo 7")
    script = place / "bin" / "scontrol"
    script.write_text("#!/bin/sh\necho 'JobId=7 JobState=RUNNING WorkDir=/a JobState=COMPLETED Restarts=9 Comment=x'\n")
    assert slurm.details(str(place / "bin"), "7")["JobState"] == "RUNNING"


def array_of(place: Path, size: int) -> list[SlurmWorker]:
    """Returns runs that are tasks of the array 101."""
    workers = [worker_of(place, f"run{n}") for n in range(size)]
    folder = place / "array"
    folder.mkdir()
    (folder / layout.ARRAY).write_bytes(msgspec.json.encode([str(worker.folder) for worker in workers]))
    for n, worker in enumerate(workers):
        worker.write_down(name="conoid-array", task=n, array=str(folder), job=f"101_{n}")
    return workers


def test_a_task_that_was_cancelled_while_it_waited_is_cancelled(place: Path) -> None:
    commands(place, "echo 7")
    worker = array_of(place, 3)[2]
    for _ in range(2):
        worker.turn([], {"101"})
    ended = worker.exited()
    assert ended is not None
    assert ended.reading is not None
    assert ended.reading[:2] == (State.CANCELLED, Cause.CANCELLED)
    assert not (place / "calls").exists(), "no new job"


def test_a_task_is_cancelled_where_another_one_has_started(place: Path) -> None:
    commands(place, "echo 7")
    workers = array_of(place, 3)
    layout.claim(workers[0].folder, "conoid-array").write_text("101_0")
    for _ in range(2):
        workers[2].turn([])
    assert workers[2].exited() is not None


def test_tasks_that_a_crash_has_swallowed_with_their_array_are_handed_over_again(place: Path) -> None:
    commands(place, "echo 7")
    worker = array_of(place, 3)[2]
    for _ in range(2):
        worker.turn([], {"77"})
    assert worker.exited() is None
    assert worker.waits_for_array


def test_a_command_that_hangs_is_left_alone_for_a_while(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(slurm_call._LONGEST, "scancel", 0.1)
    commands(place, "echo 7")
    (place / "bin" / "scancel").write_text("#!/bin/sh\nexec sleep 20\n")
    for why in ("has not answered within", "tried again soon"):
        began = time.monotonic()
        with pytest.raises(slurm_call.AwayError, match=why) as raised:
            slurm.cancel(str(place / "bin"), "7")
        assert raised.value.command == "scancel"
        assert time.monotonic() < began + 5.0
    assert slurm.jobs(str(place / "bin")) == [], "others are asked"


def test_an_accounting_database_that_hangs_delays_no_run(place: Path) -> None:
    commands(place, "echo 7")
    (place / "bin" / "sacct").write_text("#!/bin/sh\nexec sleep 20\n")
    (place / "bin" / "sacct").chmod(0o755)
    accounting, began = Accounting(str(place / "bin")), time.monotonic()
    for name in ("one", "two", "three"):
        worker = worker_of(place, name, accounting)
        worker.write_down(job="7")
        worker.turn([Entry("7", "FAILED", 5.0, worker.name, "None")])
        assert worker.exited() is not None
    assert time.monotonic() < began + 5.0


def test_a_crashed_task_is_reported_with_its_message(place: Path) -> None:
    commands(place, "echo 7")
    worker = array_of(place, 2)[1]
    (place / "array" / "1.log").write_text("loading\nmodule: cannot find gcc/99\n")
    worker.turn([Entry("101_1", "FAILED", 5.0, worker.name, "NonZeroExitCode")])
    ended = worker.exited()
    assert ended is not None
    assert ended.last_words == "module: cannot find gcc/99"


def test_the_names_of_folders_are_no_pattern_for_slurm() -> None:
    job = batch.new_job("r", 1, ("a", Profile()), ["true"], 0.0)
    for name, log in (("/runs/50%j", "/dev/null"), ("/runs/a\\n", "/dev/null"), ("/a b", "log/launcher.log")):
        words = batch.sbatch_words(job, Profile(), Path(name))
        assert [word for word in words if word.startswith("--output=")] == [f"--output={log}"]
        assert f"--chdir={name}" in words
