"""A run as a Slurm job without a server, by the commands of docs/howto/cluster.md."""

import hashlib
import json
import os
import re
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner, Result

from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.reading.files import located
from conoid.cases.run import Cause, State
from conoid.cases.site import batch
from conoid.client.cli import app
from conoid.client.commands.batch import slurm_of
from conoid.client.local import following
from conoid.client.local.following import FolderRun

from . import real_slurm
from .fake_slurm import ACCEPT, commands
from .real_slurm import Cluster

ROOT = Path(__file__).parents[2]
SITE = """
[slurm.profiles.standard]
partition = "low"
lines = ["export HYDRA_IFACE=lo"]
"""
needs_slurm = pytest.mark.skipif(bool(real_slurm.missing()), reason=real_slurm.missing() or "Slurm is there")


def conoid(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with real_slurm.running(tmp_path_factory.mktemp("slurm")) as up:
        yield up


@pytest.fixture
def place(cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "site.toml").write_text(SITE)
    monkeypatch.setenv("CONOID_SITE", str(tmp_path / "site.toml"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@needs_slurm
def test_a_run_without_a_server_is_handed_over_once_and_followed_to_its_end(place: Path, cluster: Cluster) -> None:
    handed = conoid("batch", "two_tets", "--ranks", 1)
    assert handed.exit_code == 0, handed.output
    again = conoid("batch", "two_tets", "--json")
    folder = place / "runs" / "two_tets"
    watched = conoid("watch", "--plain", folder)
    assert watched.exit_code == 0, watched.output + (folder / "log/launcher.log").read_text()
    assert "succeeded" in watched.output
    if again.exit_code == 0:
        assert json.loads(again.stdout)["job"] in handed.stdout
    assert len(cluster.jobs("conoid-two_tets-")) == 1
    assert json.loads((folder / layout.OUTCOME).read_text())["state"] == "succeeded"
    assert "has ended" in conoid("batch", "two_tets", "--ranks", 1).output


@needs_slurm
def test_a_job_that_waits_is_cancelled_by_its_folder(place: Path, cluster: Cluster) -> None:
    handed = conoid("batch", "two_tets", "--ranks", 2 * real_slurm.CORES, "--out", "large")
    assert handed.exit_code == 0, handed.output
    assert "is requested to stop" in conoid("cancel", "large").stdout
    deadline = time.monotonic() + 20.0
    while cluster.jobs("conoid-large-")[0][1] != "CANCELLED":
        assert time.monotonic() < deadline
        time.sleep(0.2)


def test_a_message_about_a_missing_profile_lists_the_existing_ones(tmp_path: Path) -> None:
    (tmp_path / "site.toml").write_text(SITE)
    result = conoid("batch", "two_tets", "--ranks", 1, "--slurm", "fast", "--site", tmp_path / "site.toml")
    assert result.exit_code == 1
    assert "profile = 'fast': allowed: standard" in result.output


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("launcher = 'pbs'", "launcher"),
        ("launcher = 'slurm'", "needs a table"),
        ("[slurm.profiles.'a b']", "allowed"),
        ("[slurm.profiles.a]\ntime = '3 kg'", "dimension"),
        ("[slurm.profiles.a]\npartitoin = 'x'", "partitoin"),
        ("[slurm]\ndefault = 'b'\n[slurm.profiles.a]", "allowed: a"),
    ],
)
def test_a_settings_file_that_is_wrong_is_refused_with_one_line(tmp_path: Path, text: str, wrong: str) -> None:
    (tmp_path / "site.toml").write_text(text)
    with pytest.raises(batch.SiteError, match=re.escape(wrong)) as raised:
        batch.read_site(tmp_path / "site.toml")
    assert "\n" not in str(raised.value)


def test_the_shipped_profile_and_script_belong_together() -> None:
    site = batch.read_site(ROOT / "deploy" / "site.toml")
    assert site.slurm is not None
    name, profile = batch.profile_of(site.slurm, "")
    assert batch.script(profile, "/opt/conoid/bin/python") == (ROOT / "deploy" / "job.sh").read_text()
    job = batch.new_job("run", 8, (name, profile), ["mpiexec"], 0.0)
    words = batch.sbatch_words(job, profile, Path("/runs/run"))
    assert {"--partition=compute", "--account=physics", "--time=720", "--ntasks=8", "--requeue"} <= set(words)
    assert "--cpus-per-task=1" in words
    assert words[-3:] == ["/runs/run/job.sh", "/runs/run", job.name]


def test_an_mpiexec_is_searched_only_where_the_profile_needs_one() -> None:
    def none() -> list[str]:
        raise AssertionError("the request was not sent")

    words = ["srun", "--mpi=pmi2", "--ntasks=4", "--cpus-per-task=2", "--cpu-bind=cores"]
    assert batch.starter(batch.Profile(mpi="srun"), 4, none, 2) == words
    assert batch.starter(batch.Profile(mpiexec="/opt/mpiexec -x"), 4, none) == ["/opt/mpiexec", "-x", "-n", "4"]
    assert batch.starter(batch.Profile(), 4, lambda: ["mpiexec"]) == ["mpiexec", "-n", "4"]


def test_a_rank_gets_a_core_for_each_of_its_threads() -> None:
    job = batch.new_job("run", 4, ("a", batch.Profile()), ["true"], 0.0, threads=16)
    assert {"--ntasks=4", "--cpus-per-task=16"} <= set(batch.sbatch_words(job, batch.Profile(), Path("/runs/run")))


def test_the_name_of_a_run_is_not_read_by_a_shell(tmp_path: Path) -> None:
    job = batch.new_job("x;id $(id) `id`", 1, ("a", batch.Profile()), [], 0.0)
    assert re.fullmatch(r"conoid-[A-Za-z0-9_.-]+", job.name)


@pytest.mark.parametrize("whole", [3, 2])
def test_following_ends_where_the_outcome_is(tmp_path: Path, whole: int) -> None:
    """The run has an outcome, and its journal has lost its last lines."""
    lines = [
        '{"type":"status","run":"a","seq":1,"state":"queued"}',
        '{"type":"status","run":"a","seq":2,"state":"running"}',
        '{"type":"finished","run":"a","seq":3,"state":"cancelled","digest":"","steps":3,"elapsed":1.0}',
    ][:whole]
    (tmp_path / layout.JOURNAL).write_text("\n".join(lines) + '\n{"type":"half')
    (tmp_path / layout.OUTCOME).write_text(
        '{"state": "cancelled", "cause": "cancelled", "message": "stopped on request"}'
    )
    received = list(FolderRun(tmp_path).messages())
    assert [message.seq for message in received] == [*range(1, whole + 1), 0]
    assert getattr(received[-1], "state", "") == State.CANCELLED


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Settings file of a Slurm whose commands are not in PATH; neither an option nor the environment names this
    file.
    """
    (tmp_path / "bin").mkdir()
    site = tmp_path / "site.toml"
    profiles = "[slurm.profiles.standard]\n[slurm.profiles.long]\n"
    place = commands(tmp_path, f"{ACCEPT}; echo $((100 + $(wc -l < calls)))")
    site.write_text(f'[slurm]\nbin = "{place}"\ndefault = "standard"\n{profiles}')
    monkeypatch.delenv("CONOID_SITE", raising=False)
    monkeypatch.chdir(tmp_path)
    return site


def test_a_folder_is_handed_over_for_one_case(elsewhere: Path) -> None:
    words = ["batch", "two_tets", "--ranks", 1, "--site", elsewhere]
    assert conoid(*words).exit_code == 0
    assert "job 101" in conoid(*words).stdout
    for more, wrong in (
        (["--set", "run.end_time=1us"], "another case, other ranks or threads"),
        (["--ranks", 2], "another case, other ranks or threads"),
        (["--slurm", "long"], "with the profile 'standard'"),
    ):
        other = conoid(*words, *more)
        assert other.exit_code == 1
        assert f"{wrong}; choose another folder with --out" in other.output
    assert "job 101" in conoid(*words, "--slurm", "standard").stdout


MESHED = """
name = "bar"
contact = "none"
run.end_time = "1 us"
[[parts]]
name = "bar"
material = "steel"
mesh = { shape = "file", path = "bar.inp", unit = "1 mm" }
"""
MESH = "*NODE\n1, 0, 0, 0\n2, 10, 0, 0\n3, 0, 10, 0\n4, 0, 0, 10\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n"


def test_a_job_has_its_own_copy_of_a_mesh_file(elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same command with another mesh file is another case."""
    here = elsewhere.parent
    monkeypatch.setenv("CONOID_CACHE_DIR", str(here / "cache"))
    (here / "bar.toml").write_text(MESHED)
    (here / "bar.inp").write_text(MESH)
    words = ["batch", "bar.toml", "--site", elsewhere]
    handed = conoid(*words)
    assert handed.exit_code == 0, handed.output
    digest = hashlib.sha256(MESH.encode()).hexdigest()
    folder = here / "runs" / "bar"
    assert (folder / layout.FILES / f"{digest}.inp").read_text() == MESH
    case = json.loads((folder / "case.json").read_bytes())
    assert case["parts"][0]["mesh"]["sha256"] == digest
    assert located("bar.inp", digest, folder).parent == folder / layout.FILES
    assert "job 101" in conoid(*words).stdout
    (here / "bar.inp").write_text(MESH.replace("0, 0, 10\n", "0, 0, 11\n"))
    assert "another case, other ranks or threads; choose another folder with --out" in conoid(*words).output


def evil(folder: Path, **changes: str) -> Path:
    """Another user has made the folder of the run. The record in the folder of another user names programs that would
    leave a file if they ran.
    """
    (folder / "bin").mkdir(parents=True)
    for name in ("squeue", "scancel", "sbatch", "scontrol", "sacct"):
        (folder / "bin" / name).write_text(f"#!/bin/sh\ntouch {folder}/owned\n")
        (folder / "bin" / name).chmod(0o755)
    record = batch.new_job("a", 1, ("standard", batch.Profile()), [str(folder / "bin" / "sbatch")], 0.0)
    forged = {**msgspec.to_builtins(record), "bin": str(folder / "bin"), "job": "7", **changes}
    (folder / layout.JOB).write_text(json.dumps(forged))
    (folder / layout.JOB_SCRIPT).write_text(f"#!/bin/sh\ntouch {folder}/owned\n")
    (folder / layout.JOURNAL).write_text('{"type":"status","run":"a","seq":1,"state":"queued"}\n')
    return folder


def test_a_folder_chooses_no_program(elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The job number in the record belongs to another Slurm job. The Slurm commands of the site return the name of the
    other job.
    """
    monkeypatch.setenv("CONOID_SITE", str(elsewhere))
    monkeypatch.setattr(following, "_ASK_EVERY", 0.0)
    monkeypatch.chdir(folder := evil(elsewhere.parent / "theirs"))
    printed = conoid("cancel", ".").stdout
    assert "Slurm has no job 7" in printed
    assert not (elsewhere.parent / "ended").exists()

    def stop(seconds: float) -> None:
        raise TimeoutError

    with pytest.raises(TimeoutError):
        list(FolderRun(folder, slurm_of(None).bin).messages(pause=stop))
    assert not (folder / "owned").exists()


@pytest.mark.parametrize(
    "changes", [{"job": "--user=me"}, {"job": "7 8"}, {"job": "7\n"}, {"name": "-u"}, {"name": "a,b"}, {"name": "a\n"}]
)
def test_a_text_of_a_record_is_no_option_of_a_command(changes: dict[str, str], elsewhere: Path) -> None:
    folder = evil(elsewhere.parent / "theirs", **changes)
    result = conoid("cancel", folder)
    (line,) = result.stderr.splitlines()
    assert result.exit_code == 1
    assert "the record of the job cannot be read" in line


def test_a_run_that_goes_on_is_started_by_a_command_of_this_machine(elsewhere: Path) -> None:
    """A repeated command submits a lost run again. The start command in the run's folder is ignored."""
    words = ["batch", "two_tets", "--ranks", 1, "--site", elsewhere, "--out", "run"]
    assert conoid(*words).exit_code == 0
    folder = elsewhere.parent / "run"
    record = json.loads((folder / layout.JOB).read_text())
    (folder / layout.JOB).write_text(json.dumps({**record, "command": ["/bin/evil"], "bin": "/evil"}))
    (folder / layout.JOB_SCRIPT).write_text("#!/bin/sh\n/bin/evil\n")
    assert conoid(*words).exit_code == 0
    kept = batch.read_job(folder)
    assert kept is not None
    assert kept.command == record["command"]
    assert "evil" not in kept.bin + (folder / layout.JOB_SCRIPT).read_text()


@pytest.mark.parametrize("name", [layout.JOB, layout.OUTCOME, layout.RESOLVED_CASE, layout.LOCK])
def test_a_pipe_in_a_folder_does_not_block_a_reader(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "_ASK_EVERY", 0.0)
    (tmp_path / layout.JOURNAL).write_text('{"type":"status","run":"a","seq":1,"state":"running"}\n')
    os.mkfifo(tmp_path / name)
    assert FolderRun(tmp_path).status().title == ""
    received = list(islice(FolderRun(tmp_path).messages(pause=lambda _: None), 2))
    assert getattr(received[-1], "state", "") == State.LOST


def test_a_request_to_stop_follows_no_link(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / layout.STOP_REQUEST).symlink_to(tmp_path / "made")
    with pytest.raises(OSError, match="symbolic links"):
        whole.touch(tmp_path / "run" / layout.STOP_REQUEST)
    assert not (tmp_path / "made").exists()


def test_a_folder_without_a_worker_is_neither_cancelled_nor_still_running(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A killed worker writes no last message. A request file of a killed worker would otherwise wait for the next
    worker, and a command that follows the run would not end.
    """
    monkeypatch.setattr(following, "_ASK_EVERY", 0.0)
    (tmp_path / layout.JOURNAL).write_text('{"type":"status","run":"a","seq":1,"state":"running"}\n')
    assert "no worker writes into this folder" in conoid("cancel", tmp_path).stdout
    assert not (tmp_path / layout.STOP_REQUEST).exists()
    running, lost = FolderRun(tmp_path).messages(pause=lambda _: None)
    assert (running.seq, getattr(lost, "state", ""), getattr(lost, "cause", "")) == (1, State.LOST, Cause.NODE)


def test_a_run_that_waits_for_its_worker_is_not_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "_ASK_EVERY", 0.0)
    (tmp_path / layout.JOURNAL).write_text('{"type":"status","run":"a","seq":1,"state":"queued"}\n')
    pauses = iter(range(3))

    def pause(_: float) -> None:
        if next(pauses, None) is None:
            (tmp_path / layout.OUTCOME).write_text('{"state": "succeeded"}')

    states = [getattr(message, "state", "") for message in FolderRun(tmp_path).messages(pause=pause)]
    assert states == [State.QUEUED, State.SUCCEEDED]
