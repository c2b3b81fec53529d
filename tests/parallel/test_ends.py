"""Ends of a run: in every case the run ends soon, with the right exit code, a reason on disk, and no remaining
process.
"""

import os
import signal
from pathlib import Path

import pytest

from conoid.cases import messages
from conoid.cases.estimates.estimate import RANK_BYTES, estimate
from conoid.cases.load import read_case, shipped_path
from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout

from .launching import command, ended, processes, started, wait_for, wait_until_gone
from .scenes import CASE as BREAKING

pytestmark = pytest.mark.slow

LONG = ("--set", "run.end_time=1 s", "--set", "reference=[]", "--set", "run.frames=0")
"""Changes a case so that it runs for hours."""


def outcome(folder: Path) -> Outcome:
    return from_json((folder / layout.OUTCOME).read_bytes())


def journal(folder: Path) -> list[messages.AnyMessage]:
    return [messages.from_json(line) for line in (folder / layout.JOURNAL).read_bytes().splitlines()]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGUSR1])
def test_a_signal_to_the_launcher_cancels_the_run(number: signal.Signals, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with started(command(2, "free_spin", "--out", str(folder), *LONG)) as launcher:
        for kind in ("progress", "snapshot"):
            wait_for(folder / layout.JOURNAL, f'"{kind}"', launcher)
        launcher.send_signal(number)
        launcher.communicate(timeout=30.0)
    assert launcher.returncode == 4
    assert outcome(folder).state == "cancelled"
    assert outcome(folder).cause == "cancelled"
    assert outcome(folder).message == "stopped on request"
    assert outcome(folder).steps
    assert outcome(folder).digest
    journaled = journal(folder)
    assert isinstance(journaled[-1], messages.Finished)
    assert journaled[-1].state == "cancelled"
    assert [message.seq for message in journaled] == list(range(1, len(journaled) + 1))
    worst = [message.worst_residual for message in journaled if isinstance(message, messages.Progress)]
    assert 0.0 < (worst[-1] or 0.0) <= outcome(folder).worst_residual
    seen = [message for message in journaled if isinstance(message, messages.Snapshot)]
    assert seen[-1].step == outcome(folder).steps, "the last state has a snapshot"
    assert not wait_until_gone(processes(folder))


def test_a_file_in_the_folder_cancels_the_run_and_a_second_worker_keeps_out(tmp_path: Path) -> None:
    """The worker runs as in a batch system, in which a signal without the stop file is an interruption."""
    folder = tmp_path / "run"
    words = command(2, "free_spin", "--out", str(folder), *LONG, "--interruptible")
    with started(words) as launcher:
        wait_for(folder / layout.JOURNAL, '"progress"', launcher)
        second = ended(words)
        assert second.returncode == 1
        assert "another worker writes into this folder" in second.stderr
        (folder / layout.STOP_REQUEST).touch()
        launcher.communicate(timeout=30.0)
    assert launcher.returncode == 4
    assert (outcome(folder).state, outcome(folder).cause) == ("cancelled", "cancelled")
    journaled = journal(folder)
    assert isinstance(journaled[-1], messages.Finished)
    assert [message.seq for message in journaled] == list(range(1, len(journaled) + 1))


def test_a_request_to_stop_one_attempt_stops_no_other_attempt(tmp_path: Path) -> None:
    """In an earlier version the stop file remained and stopped every later attempt."""
    folder = tmp_path / "run"
    words = command(1, "free_spin", "--out", str(folder), "--set", "run.end_time=1us")
    assert ended(words).returncode == 0
    (folder / layout.STOP_REQUEST).touch()
    assert ended(words).returncode == 0
    assert outcome(folder).state == "succeeded"
    assert not (folder / layout.STOP_REQUEST).exists()


def test_an_interrupted_run_has_a_checkpoint_and_no_outcome(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with started(command(2, "free_spin", "--out", str(folder), *LONG, "--interruptible")) as launcher:
        wait_for(folder / layout.JOURNAL, '"progress"', launcher)
        launcher.send_signal(signal.SIGUSR1)
        launcher.communicate(timeout=30.0)
    assert launcher.returncode == 4
    assert not (folder / layout.OUTCOME).exists()
    assert from_json((folder / layout.INTERRUPTED).read_bytes()).steps
    assert list((folder / layout.CHECKPOINTS).glob("*[0-9]"))
    assert not any(isinstance(message, messages.Finished) for message in journal(folder))


def test_a_rank_that_raises_ends_the_job(tmp_path: Path) -> None:
    """The log of the failing rank has its number and the traceback; the other ranks do not wait for this rank."""
    folder, program = tmp_path / "run", Path(__file__).with_name("broken.py")
    done = ended(command(3, "1", "free_spin", "--out", str(folder), *LONG, module=[str(program)]))
    assert done.returncode not in (0, 2, 3, 4)
    log = layout.rank_log(folder, 1).read_text(encoding="utf-8")
    assert "rank 1" in log
    assert "Traceback (most recent call last)" in log
    assert "RuntimeError: the tenth step goes wrong" in log
    assert "Traceback" not in layout.rank_log(folder, 0).read_text(encoding="utf-8")
    assert not (folder / layout.OUTCOME).exists()
    assert len(processes(folder)) == 3
    assert not wait_until_gone(processes(folder))


def test_a_rank_that_is_killed_ends_the_job(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with started(command(3, "free_spin", "--out", str(folder), *LONG)) as launcher:
        wait_for(folder / layout.JOURNAL, '"progress"', launcher)
        numbers = processes(folder)
        assert len(numbers) == 3
        os.kill(numbers[2], signal.SIGKILL)
        launcher.communicate(timeout=30.0)
    assert launcher.returncode != 0
    assert not (folder / layout.OUTCOME).exists()
    assert not wait_until_gone(numbers)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (("run.end_time=-1 s",), ("run.end_time", "-1 s")),
        (("parts[0].material=stele",), ("parts[0].material", "stele", "steel")),
        (("numerics.presure=nodal",), ("numerics.presure", "pressure")),
        (("parts[0].mesh.element_size=3 kg",), ("parts[0].mesh.element_size", "3 kg")),
    ],
)
def test_bad_input_is_one_line_and_exit_code_two(
    changes: tuple[str, ...], words: tuple[str, ...], tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    sets = [word for change in changes for word in ("--set", change)]
    done = ended(command(2, "free_spin", "--out", str(folder), *sets))
    assert done.returncode == 2
    lines = [line for line in done.stderr.splitlines() if "application called MPI_Abort" not in line]
    assert len(lines) == 1, done.stderr
    assert all(word in lines[0] for word in words)
    assert "Traceback" not in done.stdout + done.stderr
    end = outcome(folder)
    assert (end.state, end.cause, end.message) == ("failed", "input", lines[0])


MESH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
4
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 {height}
$EndNodes
$Elements
1
7 4 2 1 1 1 2 3 4
$EndElements
"""
CASE = """
name = "one"
[[parts]]
name = "tet"
material = "steel"
[parts.mesh]
shape = "file"
path = "one.msh"
unit = "1 mm"
[run]
end_time = "1 us"
"""


@pytest.mark.parametrize(
    ("height", "words"),
    [(None, ("one.msh", "no such file")), (-1, ("tet 7", "inverted")), (0, ("tet 7", "flat")), ("nan", ("node 4",))],
)
def test_a_bad_mesh_is_one_line_and_exit_code_two(height: object, words: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "one.toml").write_text(CASE, encoding="utf-8")
    if height is not None:
        (tmp_path / "one.msh").write_text(MESH.format(height=height), encoding="utf-8")
    done = ended(command(2, str(tmp_path / "one.toml"), "--out", str(tmp_path / "run")))
    assert done.returncode == 2
    end = outcome(tmp_path / "run")
    assert (end.state, end.cause) == ("failed", "mesh")
    assert "\n" not in end.message
    assert end.message in done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    assert all(word in end.message for word in ("parts[0].mesh", *words)), end.message


def test_a_folder_that_cannot_be_made_is_one_line() -> None:
    done = ended(command(1, "free_spin", "--out", "/proc/none"))
    assert done.returncode == 5
    lines = [line for line in done.stderr.splitlines() if "application called MPI_Abort" not in line]
    assert len(lines) == 1, done.stderr
    assert "was removed or cannot be written: [Errno 2] No such file or directory: '/proc/none" in lines[0]


def test_a_case_that_is_not_there(tmp_path: Path) -> None:
    done = ended(command(1, "fre_spin", "--out", str(tmp_path / "run")))
    assert done.returncode == 2
    assert "free_spin" in done.stderr
    assert outcome(tmp_path / "run").cause == "input"


@pytest.mark.parametrize(
    ("case", "keys", "words"),
    [
        ("free_spin", [*LONG, "--set", "run.residual_limit=1e-14"], "energy residual"),
        (str(BREAKING), ["--set", "run.made_limit=2e-5"], "the term stepping of the energy ledger"),
    ],
)
def test_a_ledger_that_does_not_close_fails_the_run(case: str, keys: list[str], words: str, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    done = ended(command(2, case, "--out", str(folder), *keys))
    assert done.returncode == 3
    assert (outcome(folder).state, outcome(folder).cause) == ("failed", "energy")
    assert words in outcome(folder).message
    assert keys[-1].partition("=")[0] in outcome(folder).message


def test_wall_time_and_steps_run_out(tmp_path: Path) -> None:
    slow = ended(command(2, "free_spin", "--out", str(tmp_path / "slow"), *LONG, "--set", "run.max_wall_time=0.5 s"))
    assert slow.returncode == 4
    assert outcome(tmp_path / "slow").state == "timed_out"
    assert outcome(tmp_path / "slow").cause == "walltime"
    assert outcome(tmp_path / "slow").message.startswith("run.max_wall_time is used up, at ")
    assert "stable step" not in outcome(tmp_path / "slow").message
    short = ended(command(1, "free_spin", "--out", str(tmp_path / "short"), *LONG, "--set", "run.max_steps=20"))
    assert short.returncode == 4
    end = outcome(tmp_path / "short")
    assert (end.state, end.cause, end.steps) == ("timed_out", "steps", 20)
    assert end.message.startswith("the run reached run.max_steps before run.end_time, at ")
    more = ("--set", "run.max_steps=30", "--restart")
    assert ended(command(1, "free_spin", "--out", str(tmp_path / "short"), *LONG, *more)).returncode == 4
    assert outcome(tmp_path / "short").steps == 30


def test_as_many_ranks_as_tets_and_not_more(tmp_path: Path) -> None:
    """With five tets the answer is equal on one and on five ranks; six ranks are refused, because one rank would have
    no tet.
    """
    few = ("--set", "parts[0].mesh.element_size=10 mm", "--set", "parts[0].mesh.split=5", "--set", "run.end_time=20 us")
    digests = []
    for ranks in (1, 5, 6):
        folder = tmp_path / str(ranks)
        done = ended(command(ranks, "free_spin", "--out", str(folder), *few, "--set", "reference=[]"))
        assert done.returncode == (2 if ranks == 6 else 0), done.stderr
        digests.append(outcome(folder).digest)
    assert digests[0] == digests[1]
    assert outcome(tmp_path / "5").elements == 5
    assert max(outcome(tmp_path / "5").peak_memory) == pytest.approx(RANK_BYTES, rel=0.15)
    assert "run.ranks = 6: at most 5" in outcome(tmp_path / "6").message


def test_complete_fragmentation_takes_the_estimated_memory(tmp_path: Path) -> None:
    case = read_case(shipped_path("glass_ball_cohesive"))
    expected = estimate(case.model_copy(update={"run": case.run.model_copy(update={"ranks": 2})}))
    done = ended(command(2, "glass_ball_cohesive", "--out", str(tmp_path)))
    assert done.returncode == 0, done.stderr
    assert expected.memory_bytes is not None
    assert 1.0 <= (expected.memory_bytes + expected.dust_bytes) / sum(outcome(tmp_path).peak_memory) < 1.3
