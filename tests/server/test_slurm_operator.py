"""Actions of an operator on a real Slurm while a server submits runs to this Slurm."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from conoid.cases.run import State

from . import real_slurm
from .real_slurm import Cluster
from .running import case_text, processes
from .slurm_site import SITE, Site, job_of, processes_of, sweep_of

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(real_slurm.missing()), reason=real_slurm.missing() or "a Slurm is here"),
]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with real_slurm.running(tmp_path_factory.mktemp("slurm")) as up:
        yield up


@pytest.fixture(params=["runs of a site", "50%j of \\n"])
def site(cluster: Cluster, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Site]:
    """A site whose folders have unusual names."""
    cluster.await_node()
    place = tmp_path / request.param
    place.mkdir()
    (place / "site.toml").write_text(SITE)
    with processes(place) as make:
        server = make("--site", str(place / "site.toml"), "--slots", "1000", "--no-zenoh", "--grace", "5")
        yield Site(cluster, server, server.user(server.start()["url"]))


def partition(_: Site) -> str:
    """Returns the partition in the profile that the runs use."""
    return "low"


@pytest.mark.parametrize("state", ["INACTIVE", "DRAIN"])
def test_a_run_that_waits_for_a_partition_shows_the_reason(site: Site, state: str) -> None:
    name = partition(site)
    site.cluster.command("scontrol", "update", f"PartitionName={name}", f"State={state}")
    try:
        run = site.submit(case_text(steps=3))
        deadline = time.monotonic() + 30.0
        while "takes no job now" not in (seen := site.ann.show(run))["reason"]:
            assert seen["state"] in {"accepted", "queued"}, seen
            assert time.monotonic() < deadline, seen
            time.sleep(0.2)
    finally:
        site.cluster.command("scontrol", "update", f"PartitionName={name}", "State=UP")
    assert site.ended(run, 90.0)["state"] == "succeeded"
    assert site.tail(run) != "no log", "in its folder, for any name of the folder"


def test_a_job_with_an_odd_name_hides_no_other_job(site: Site, tmp_path: Path) -> None:
    script = tmp_path / "odd.sh"
    script.write_text("#!/bin/sh\nsleep 20\n")
    odd = site.cluster.command("sbatch", "--parsable", "--job-name=a\nb|c", "--chdir", str(tmp_path), str(script))
    assert site.ended(site.submit(case_text(steps=3)), 60.0)["state"] == "succeeded"
    site.cluster.command("scancel", odd)


def test_a_task_that_is_cancelled_by_hand_while_it_waits_is_cancelled(site: Site, tmp_path: Path) -> None:
    runs = sweep_of(site, 4, ranks=real_slurm.CORES, wait=str(tmp_path / "go"))
    jobs = [job_of(site, run) for run in runs]
    site.reached(runs[0], 60.0, State.RUNNING)
    waits = [n for n, run in enumerate(runs) if site.ann.show(run)["state"] == "queued"]
    site.cluster.command("scancel", jobs[waits[-1]].job)
    ended = site.ended(runs[waits[-1]], 60.0)
    assert (ended["state"], ended["cause"]) == ("cancelled", "cancelled")
    (tmp_path / "go").touch()
    assert all(site.ended(run, 120.0)["state"] == "succeeded" for n, run in enumerate(runs) if n != waits[-1])
    assert job_of(site, runs[waits[-1]]).job == jobs[waits[-1]].job, "no second job"


def script_of(run: str) -> list[int]:
    """Returns the process of the job script of the run."""
    found = subprocess.run(
        ["pgrep", "-f", f"conoid.worker.run.job .*{run}"], capture_output=True, text=True, check=True
    )
    return [int(pid) for pid in found.stdout.split()]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_job_that_was_killed_by_hand_is_not_cancelled(site: Site, number: signal.Signals) -> None:
    """The job script gets SIGTERM; the ranks and the job script get SIGKILL."""
    run = site.submit(case_text(steps=100_000, pace=0.02))
    site.reached(run, 30.0, State.RUNNING)
    ranks, script = processes_of(run), script_of(run)
    assert ranks
    for pid in script if number is signal.SIGTERM else [*ranks, *script]:
        os.kill(pid, number)
    ended = site.ended(run, 120.0)
    assert ended["state"] in {"failed", "lost"}, ended
    assert ended["cause"] in {"preempted", "node", "service"}, ended
    assert len(site.jobs(run)) == 1


def test_a_run_whose_script_alone_was_killed_goes_on_from_its_checkpoint(site: Site) -> None:
    """Slurm ends the ranks of a job that an operator requeues or cancels, and the ranks leave a checkpoint. After that
    the job ends in the normal way.
    """
    run = site.submit(case_text(steps=100_000, pace=0.02))
    site.reached(run, 30.0, State.RUNNING)
    for pid in script_of(run):
        os.kill(pid, signal.SIGKILL)
    deadline = time.monotonic() + 120.0
    while not any("attempt 2" in event.get("message", "") for event in site.ann.events(run, after=4)):
        assert time.monotonic() < deadline, site.ann.show(run)
        time.sleep(0.5)
    site.reached(run, 60.0, State.RUNNING)
    site.ann.http.post(f"/v1/runs/{run}:cancel")
    ended = site.ended(run, 60.0)
    assert (ended["state"], ended["cause"]) == ("cancelled", "cancelled")
    assert len(site.jobs(run)) == 2


def test_a_crashed_point_is_reported_with_its_message(site: Site) -> None:
    ended = site.ended(sweep_of(site, 2, end="crash")[1], 60.0)
    assert ended["state"] == "failed"
    assert "its last words: " in ended["message"], ended
