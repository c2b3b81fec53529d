"""Runs as jobs of a real Slurm, which the tests start. The tests make faults with real commands of Slurm."""

import json
import os
import shlex
import signal
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from conoid.cases.messages import AnyMessage, Finished, Progress
from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.client import connect
from conoid.client.remote.link import Link
from conoid.server.settings import WORKER

from ..parallel.launching import command, ended
from . import real_slurm
from .real_slurm import Cluster
from .running import TOML, case_text, processes
from .slurm_site import SITE, Site, job_of, processes_of, sweep_and_body, sweep_of

pytestmark = pytest.mark.skipif(bool(real_slurm.missing()), reason=real_slurm.missing() or "Slurm is there")

BREAKING = Path(__file__).parents[1] / "parallel" / "breaking.toml"
_DONE_WITH = 3.0
"""Time after which a node has finished with a requeued Slurm job, s."""
DIGEST = tomllib.loads(BREAKING.with_name("digests.toml").read_text(encoding="utf-8"))["breaking"]
"""Digest of the breaking case, which is the same on any number of ranks."""
LONG = "12 us"
"""End time with which the breaking case takes some ten seconds, long enough for an interruption."""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with real_slurm.running(tmp_path_factory.mktemp("slurm")) as up:
        yield up


@pytest.fixture
def site(cluster: Cluster, tmp_path: Path) -> Iterator[Site]:
    cluster.await_node()
    (tmp_path / "site.toml").write_text(SITE)
    with processes(tmp_path) as make:
        server = make("--site", str(tmp_path / "site.toml"), "--slots", "1000", "--no-zenoh", "--grace", "5")
        yield Site(cluster, server, server.user(server.start()["url"]))


@pytest.fixture
def solver(cluster: Cluster, tmp_path: Path) -> Iterator[Site]:
    """The Slurm site with the real worker."""
    cluster.await_node()
    (tmp_path / "site.toml").write_text(SITE)
    with processes(tmp_path) as make:
        options = ("--slots", "1000", "--zenoh-port", "0", "--worker", shlex.join(WORKER))
        server = make("--site", str(tmp_path / "site.toml"), *options)
        yield Site(cluster, server, server.user(server.start()["url"]))


def test_a_run_waits_with_a_reason_runs_and_is_cancelled(site: Site, tmp_path: Path) -> None:
    large = site.submit(case_text(ranks=2 * real_slurm.CORES))
    long = site.submit(case_text(steps=100_000, pace=0.02))
    assert site.reached(long, 30.0, State.RUNNING)["started"] > 0
    waiting = site.ann.show(large)
    assert waiting["state"] == "queued"
    assert "is pending" in waiting["reason"]
    for run in (large, long):
        site.ann.http.post(f"/v1/runs/{run}:cancel")
        ended = site.ended(run)
        assert (ended["state"], ended["cause"]) == ("cancelled", "cancelled")
    assert [state for _, state in site.jobs(large)] == ["CANCELLED"]
    assert site.ann.states(long)[-1] == "cancelled"
    record = json.loads((site.server.runs / long / layout.JOB).read_text())
    assert record["accounting"]["NodeList"] == site.cluster.host


def test_a_job_requests_a_core_for_each_thread_of_each_rank(site: Site) -> None:
    run = site.submit(case_text(ranks=2, threads=3))
    job = site.cluster.command("scontrol", "show", "job", job_of(site, run).job)
    assert {"NumTasks=2", "CPUs/Task=3"} <= set(job.split())
    site.ann.http.post(f"/v1/runs/{run}:cancel")
    site.ended(run)


def test_a_job_that_slurm_refuses_fails_at_once_with_its_words(site: Site) -> None:
    ended = site.ended(site.submit(case_text(), "wrong"))
    assert (ended["state"], ended["cause"]) == ("failed", "launch")
    assert "Invalid partition name" in ended["message"]


@pytest.mark.slow
def test_scancel_by_hand_is_a_cancel(site: Site) -> None:
    run = site.submit(case_text(steps=100_000, pace=0.02))
    site.reached(run, 30.0, State.RUNNING)
    site.cluster.command("scancel", site.jobs(run)[0][0])
    ended = site.ended(run)
    assert (ended["state"], ended["cause"]) == ("cancelled", "cancelled")


@pytest.mark.slow
def test_a_server_that_dies_finds_its_jobs_again(site: Site, tmp_path: Path) -> None:
    large = site.submit(case_text(ranks=2 * real_slurm.CORES))
    runs = [site.submit(case_text(wait=str(tmp_path / "go"))) for _ in range(3)]
    site.reached(runs[0], 30.0, State.RUNNING)
    site.again()
    (tmp_path / "go").touch()
    for run in runs:
        assert site.ended(run)["state"] == "succeeded"
        assert len(site.jobs(run)) == 1
        assert site.ann.states(run).count("running") == 1
    site.ann.http.post(f"/v1/runs/{large}:cancel")
    assert site.ended(large)["state"] == "cancelled"


@pytest.mark.slow
def test_a_controller_that_is_away_is_no_state_of_a_run(site: Site, tmp_path: Path) -> None:
    run = site.submit(case_text(wait=str(tmp_path / "go")))
    site.reached(run, 30.0, State.RUNNING)
    site.cluster.kill()
    try:
        deadline = time.monotonic() + 60.0
        while "unknown" not in (seen := site.ann.show(run))["reason"]:
            assert time.monotonic() < deadline
            time.sleep(0.2)
        assert seen["state"] == "running"
        (tmp_path / "go").touch()
        assert site.ended(run)["state"] == "succeeded", "the folder has the end of the run, for any answer"
    finally:
        site.cluster.start()
        site.cluster.await_node()


def test_no_setting_can_add_words_to_a_profile(site: Site) -> None:
    for name in ("standard --wrap=id", "../standard", "other"):
        answer = site.ann.http.post("/v1/runs", params={"profile": name}, content=case_text(), headers=TOML)
        assert answer.status_code == 400
        assert "standard, pmi2" in answer.json()["detail"]
    named = case_text(extra='profile = "other"')
    assert site.ann.http.post("/v1/runs", content=named, headers=TOML).status_code == 400
    run = site.submit(case_text(extra='profile = "wrong"'), "")
    assert "Invalid partition name" in site.ended(run)["message"], "the case has chosen"


# The drill ------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_twelve_runs_at_a_time(site: Site) -> None:
    runs = [site.submit(case_text(steps=20, pace=0.05)) for _ in range(12)]
    for run in runs:
        assert site.ended(run, 120.0)["state"] == "succeeded"
        assert len(site.jobs(run)) == 1


@pytest.mark.slow
def test_a_sweep_is_one_array_with_a_job_for_each_run(site: Site, tmp_path: Path) -> None:
    """Twelve runs are submitted by one sbatch. One run of the sweep is cancelled, and the server is killed during the
    sweep. When the sweep is repeated, only the cancelled run gets another job.
    """
    sweep, body = sweep_and_body(site, 12, wait=str(tmp_path / "go"))
    runs = [point["run"]["id"] for point in sweep["points"]]
    jobs = [job_of(site, run) for run in runs]
    assert len({job.name for job in jobs}) == 1
    assert len({job.job.partition("_")[0] for job in jobs}) == 1, "one number"
    assert sorted(job.task for job in jobs if job.task is not None) == list(range(12))
    site.reached(runs[0], 60.0, State.RUNNING)
    site.ann.http.post(f"/v1/runs/{runs[11]}:cancel")
    assert site.ended(runs[11])["state"] == "cancelled"
    site.again()
    (tmp_path / "go").touch()
    for run in runs[:11]:
        assert site.ended(run, 120.0)["state"] == "succeeded", site.tail(run)
        assert site.ann.states(run).count("running") == 1
    found = site.cluster.jobs(jobs[0].name)
    states = sorted(state for _, state in found)
    assert states[-11:] == ["COMPLETED"] * 11
    assert states[:-11] in ([], ["CANCELLED"]), "the controller may have forgotten the cancelled job"
    kind = {"Content-Type": "application/json"}
    repeated = [site.ann.http.post(f"{sweep['url']}:again", content=body, headers=kind) for _ in range(2)]
    assert [answer.status_code for answer in repeated] == [202, 202], repeated[0].text
    *others, last = [point["run"]["id"] for point in repeated[1].json()["points"]]
    assert (others, last in runs) == (runs[:11], False)
    assert site.ended(last, 120.0)["state"] == "succeeded", site.tail(last)
    assert len(site.cluster.jobs(job_of(site, last).name)) == 1


@pytest.mark.slow
def test_a_controller_killed_while_arrays_are_handed_over_makes_one_job_a_run(site: Site) -> None:
    runs = []
    for number in range(4):
        runs += sweep_of(site, 3, steps=2)
        time.sleep(0.4 + 0.3 * number)
        site.cluster.kill()
        time.sleep(0.3)
        site.cluster.start()
    site.cluster.await_node()
    for run in runs:
        assert site.ended(run, 240.0)["state"] == "succeeded", site.tail(run)
        assert site.ann.states(run).count("running") == 1, site.ann.states(run)


@pytest.mark.slow
def test_a_controller_killed_while_jobs_are_handed_over_makes_one_of_each(site: Site) -> None:
    """Twenty times the controller is killed, each time at another time before or after sbatch, and starts again."""
    runs = []
    for number in range(20):
        runs.append(site.submit(case_text(steps=2)))
        time.sleep(0.05 * number)
        site.cluster.kill()
        time.sleep(0.3)
        site.cluster.start()
    site.cluster.await_node()
    attempts = []
    for run in runs:
        ended = site.ended(run, 240.0)
        assert ended["state"] == "succeeded", (ended, site.tail(run))
        states = site.ann.states(run)
        assert states.count("running") == 1, states
        live = [state for _, state in site.jobs(run) if state not in {"CANCELLED"}]
        attempts.append(len(live))
    print("jobs of each run:", attempts)
    assert set(attempts) == {1}


@pytest.mark.slow
def test_a_server_killed_while_it_hands_jobs_over_makes_one_of_each(site: Site) -> None:
    runs = []
    for number in range(10):
        runs.append(site.submit(case_text(steps=2)))
        time.sleep(0.06 * number)
        site.again()
    for run in runs:
        assert site.ended(run, 120.0)["state"] == "succeeded"
        assert len(site.jobs(run)) == 1


@pytest.mark.slow
def test_a_controller_that_hangs_makes_no_second_job(site: Site) -> None:
    runs = []
    for _ in range(2):
        site.cluster.pause(signal.SIGSTOP)
        runs.append(site.submit(case_text(steps=2)))
        time.sleep(35.0)
        site.cluster.pause(signal.SIGCONT)
        assert site.ended(runs[-1], 120.0)["state"] == "succeeded"
        assert len([job for job in site.jobs(runs[-1]) if job[1] == "COMPLETED"]) == 1
        assert site.ann.states(runs[-1]).count("running") == 1


@pytest.mark.slow
@pytest.mark.parametrize(("profile", "ranks", "threads"), [("standard", 2, 1), ("pmi2", 2, 1), ("pmi2", 1, 2)])
def test_ranks_and_threads_by_both_launchers(solver: Site, profile: str, ranks: int, threads: int) -> None:
    run = solver.submit(with_ranks(ranks, threads=threads), profile)
    ended = solver.ended(run, 300.0)
    assert ended["state"] == "succeeded", (ended["message"], solver.tail(run))
    taken = ended["outcome"]
    assert (taken["ranks"], taken["threads"], taken["digest"][:16]) == (ranks, threads, DIGEST)


class Recorder:
    """A subscription that stores the messages that have arrived."""

    def __init__(self, link: Link) -> None:
        self.name, self.trouble, self._link = link.name, "", link
        self.arrived: list[AnyMessage] = []

    def get(self, timeout: float) -> AnyMessage | None:
        message = self._link.get(timeout)
        if message is not None:
            self.arrived.append(message)
        return message

    def close(self) -> None:
        self._link.close()


@pytest.mark.slow
def test_a_run_is_watched_live_over_zenoh(solver: Site) -> None:
    """Rank 0 of the run publishes with credentials from a hidden file, which only the owner can read."""
    run = solver.submit(with_ranks(2, LONG), "pmi2")
    token = str(solver.ann.http.headers["Authorization"]).removeprefix("Bearer ")
    with connect(str(solver.ann.http.base_url), token) as session:
        link = Recorder(session.run(run).link())
        assert link.name == "Zenoh"
        received = list(session.run(run).messages(link=link))
    assert sum(isinstance(message, Progress) for message in link.arrived) > 5
    assert any(isinstance(message, Finished) for message in received)
    assert [message.seq for message in received] == list(range(1, received[-1].seq + 1)), "nothing is lost on the way"
    assert solver.ended(run)["state"] == "succeeded"
    folder = solver.server.runs / run
    assert (folder / layout.ACCESS).stat().st_mode & 0o777 == 0o600
    assert json.loads((folder / layout.ACCESS).read_text())["password"] not in (folder / layout.JOB).read_text()
    listed = [entry["path"] for entry in solver.ann.http.get(f"/v1/runs/{run}/files").json()["files"]]
    assert layout.JOB in listed
    assert layout.ACCESS not in listed


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Digest of the long case on one rank without Slurm."""
    place = tmp_path_factory.mktemp("alone")
    (place / "case.toml").write_text(with_ranks(1, LONG))
    ended(command(1, str(place / "case.toml"), "--out", str(place / "out")))
    digest: str = json.loads((place / "out" / layout.OUTCOME).read_text())["digest"]
    assert digest
    return digest


@pytest.mark.slow
@pytest.mark.parametrize(("profile", "jobs"), [("standard", 1), ("pmi2", 1), ("grace", 1), ("gone", 2)])
def test_a_preempted_run_goes_on_to_the_same_digest(solver: Site, profile: str, jobs: int, uninterrupted: str) -> None:
    """Slurm requeues the run, the job requeues the run within a grace period, or the job ends without another attempt.
    After each end of the job another job continues the run.
    """
    run = solver.submit(with_ranks(2, LONG), profile)
    await_progress(solver, run)
    solver.cluster.command("sbatch", "-p", "high", "-n", str(real_slurm.CORES), "-o", "/dev/null", "--wrap", "sleep 5")
    solver.reached(run, 60.0, State.QUEUED)
    hurry(solver, run)
    last = solver.ended(run, 250.0)
    assert (last["state"], last["outcome"]["digest"]) == ("succeeded", uninterrupted), solver.tail(run)
    assert len(solver.jobs(run)) == jobs
    states = solver.ann.states(run)
    assert states.count("running") == 2
    assert "cancelled" not in states


def hurry(solver: Site, run: str) -> None:
    """Releases a requeued Slurm job.

    Slurm lets a requeued job wait for two minutes; the test skips the wait. The node must have finished with the old
    job, because Slurm mistakes a job that starts in the second in which the old job ended for the old job.
    """
    since = dict[str, float]()
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline and solver.ann.show(run)["state"] == "queued":
        for job, state in solver.jobs(run):
            if state == "PENDING" and time.monotonic() > since.setdefault(job, time.monotonic()) + _DONE_WITH:
                solver.cluster.command("scontrol", "update", f"jobid={job}", "StartTime=now")
                return
        time.sleep(0.2)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_run_that_reaches_the_time_limit_goes_on_to_the_same_digest(solver: Site, uninterrupted: str) -> None:
    """The ranks are stopped until Slurm has sent the job the signal before its time limit."""
    run = solver.submit(with_ranks(2, LONG), "brief")
    await_progress(solver, run)
    stopped = processes_of(run)
    for pid in stopped:
        os.kill(pid, signal.SIGSTOP)
    time.sleep(70.0)
    for pid in stopped:
        os.kill(pid, signal.SIGCONT)
    solver.reached(run, 60.0, State.QUEUED)
    hurry(solver, run)
    last = solver.ended(run, 400.0)
    assert (last["state"], last["outcome"]["digest"]) == ("succeeded", uninterrupted), solver.tail(run)
    assert solver.ann.states(run).count("running") >= 2
    assert len(solver.jobs(run)) == 1


def with_ranks(ranks: int, end_time: str = "1.5 us", threads: int = 1) -> str:
    """Returns the breaking case with the given numbers of ranks and threads, and another end time."""
    text = BREAKING.read_text()
    assert '[run]\nend_time = "1.5 us"\n' in text
    return text.replace(
        '[run]\nend_time = "1.5 us"\n', f'[run]\nranks = {ranks}\nthreads = {threads}\nend_time = "{end_time}"\n'
    )


def await_progress(solver: Site, run: str) -> None:
    """Waits until the run has computed some steps."""
    solver.reached(run, 300.0, State.RUNNING)
    deadline = time.monotonic() + 100.0
    while not (solver.ann.show(run)["progress"] or {}).get("step"):
        assert time.monotonic() < deadline
        time.sleep(0.02)
