"""A cluster and a server that submits its runs to the cluster, for tests with a real Slurm."""

import json
import signal
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.cases.site.batch import Job, read_job

from .real_slurm import Cluster
from .running import TOML, Process, User, case_text

SITE = """
launcher = "slurm"
[slurm]
poll = 0.3
[slurm.profiles.standard]
partition = "low"
lines = ["export HYDRA_IFACE=lo"]
[slurm.profiles.pmi2]
partition = "low"
mpi = "srun"
[slurm.profiles.grace]
partition = "grace"
[slurm.profiles.gone]
partition = "gone"
[slurm.profiles.wrong]
partition = "nowhere"
[slurm.profiles.brief]
partition = "low"
time = "2 min"
notice = "60 s"
"""


@dataclass
class Site:
    """A cluster, a server that submits its runs to the cluster, and a user of the server."""

    cluster: Cluster
    server: Process
    ann: User

    def submit(self, text: str, profile: str = "standard") -> str:
        """Submits a run and returns the id of the run."""
        answer = self.ann.http.post("/v1/runs", params={"profile": profile}, content=text, headers=TOML)
        assert answer.status_code == 202, answer.text
        return str(answer.json()["id"])

    def ended(self, run: str, seconds: float = 60.0) -> dict[str, Any]:
        """Waits for the end of the run and returns the run."""
        return self.reached(run, seconds, *(state for state in State if state.final))

    def reached(self, run: str, seconds: float, *states: State) -> dict[str, Any]:
        """Waits until the run is in one of the given states and returns the run."""
        deadline = time.monotonic() + seconds
        while (seen := self.ann.show(run))["state"] not in states:
            assert time.monotonic() < deadline, f"{seen['state']} ({seen['reason']}), not {states}: {self.tail(run)}"
            time.sleep(0.1)
        return seen

    def tail(self, run: str) -> str:
        """Returns the last lines of the launcher's log."""
        log = self.server.runs / run / layout.LOGS / layout.LAUNCHER_LOG
        return log.read_text()[-2000:] if log.exists() else "no log"

    def jobs(self, run: str) -> list[tuple[str, str]]:
        """Returns the number and the state of all Slurm jobs of the run."""
        return self.cluster.jobs(f"conoid-{run}-")

    def again(self, number: signal.Signals = signal.SIGKILL) -> None:
        """Ends the server and starts another server."""
        self.server.end(number)
        self.ann = self.server.user(self.server.start()["url"])


def sweep_of(site: Site, number: int, **plan: Any) -> list[str]:
    """Submits a sweep and returns the runs of the sweep in the order of its points."""
    return [point["run"]["id"] for point in sweep_and_body(site, number, **plan)[0]["points"]]


def sweep_and_body(site: Site, number: int, **plan: Any) -> tuple[dict[str, Any], str]:
    """Submits a sweep and returns the answer and the request."""
    points = [{"run.end_time": f"{1 + n} us"} for n in range(number)]
    body = json.dumps({"case": tomllib.loads(case_text(**plan)), "points": points})
    answer = site.ann.http.post("/v1/sweeps", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 202, answer.text
    return answer.json(), body


def job_of(site: Site, run: str) -> Job:
    """Waits until Slurm has given the run a job number; returns the record of the Slurm job."""
    deadline = time.monotonic() + 30.0
    while (found := read_job(site.server.runs / run)) is None or not found.job:
        assert time.monotonic() < deadline
        time.sleep(0.1)
    return found


def processes_of(run: str) -> list[int]:
    """Returns the processes of a run's ranks, for the solver or for the fake worker."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                words = (entry / "cmdline").read_bytes().split(b"\0")
            except OSError:
                continue
            worker = b"mpi4py" in words or any(word.endswith(b"fake_worker.py") for word in words[:2])
            if worker and run.encode() in words and words[0].endswith(b"python"):
                found.append(int(entry.name))
    return found
