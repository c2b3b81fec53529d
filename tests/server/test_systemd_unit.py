"""The shipped systemd unit: a run of two ranks inside the sandbox of the unit, the remaining exposure, and automatic
restarts.
"""

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx2
import pytest

from conoid.worker.kernels.store import cache_folder

from . import sandbox, syscalls
from .running import START, TOML, case_text

ROOT = Path(__file__).parents[2]
UNIT = ROOT / "deploy" / "conoid-server.service"
ANALYZE = shutil.which("systemd-analyze")
EXPOSURE = 2.0
"""Limit of the exposure that systemd-analyze reports; the exposure of the shipped unit is 1.6 with systemd 252."""
END = 240.0
"""Time limit of a run that compiles all kernels on a busy machine, s."""
SANDBOX = pytest.mark.skipif(
    os.geteuid() != 0 or syscalls.library() is None or ANALYZE is None,
    reason="needs root, libseccomp and systemd-analyze (Debian: apt-get install systemd)",
)


@dataclass
class Place:
    """A home folder of the service user, and the unit that runs in this folder."""

    state: Path

    def command(self, *words: str) -> list[str]:
        """Returns the command line that runs a command inside the unit's sandbox."""
        return [sys.executable, str(ROOT / "tests/server/sandbox.py"), str(UNIT), str(self.state), "--", *words]

    def fill_cache(self) -> None:
        """Copies the compiled kernels of this user, as if an earlier run had compiled them."""
        kept = cache_folder()
        shutil.copytree(kept, self.state / ".cache/conoid/kernels" / kept.name, dirs_exist_ok=True)
        self.own()

    def own(self) -> None:
        """Makes the user of the service the owner of all files."""
        user = sandbox.nobody()
        for place, folders, names in os.walk(self.state):
            for name in (".", *folders, *names):
                os.chown(os.path.join(place, name), user.pw_uid, user.pw_gid)


@pytest.fixture
def place(tmp_path: Path) -> Place:
    made = Place(tmp_path / "state")
    made.state.mkdir()
    made.own()
    return made


@pytest.fixture
def url(place: Place) -> Iterator[str]:
    """URL of a server that the ExecStart line of the unit has started at a free port."""
    start = sandbox.read(UNIT)["ExecStart"][0].split()
    child = subprocess.Popen(place.command(*start, "--port", "0", "--zenoh-port", "0", "--end-runs", "--grace", "1"))
    address = place.state / "runs/server.json"
    try:
        deadline = time.monotonic() + START
        while not address.exists():
            assert child.poll() is None, "the server ended at its start"
            assert time.monotonic() < deadline
            time.sleep(0.05)
        yield str(re.findall(r'"url": "(.*?)"', address.read_text())[0])
    finally:
        child.terminate()
        child.wait(20.0)


def token(place: Place) -> str:
    """Token for the user ann, made by the command of docs/howto/site.md."""
    serve = ["/opt/conoid/bin/python", "-m", "conoid.server", "--runs", "/var/lib/conoid/runs"]
    ended = subprocess.run(
        place.command(*serve, "token", "add", "ann"), check=True, capture_output=True, text=True
    ).stdout
    return ended.split()[-1]


def ended(url: str, place: Place, text: str) -> str:
    """Submits the case and returns the final state of the run."""
    headers = {"Authorization": f"Bearer {token(place)}"}
    with httpx2.Client(base_url=url, headers=headers, timeout=40.0) as http:
        run = http.post("/v1/runs", content=text, headers=TOML).json()["id"]
        deadline = time.monotonic() + END
        while True:
            seen = http.get(f"/v1/runs/{run}", params={"wait": 20}).json()
            if seen["state"] in {"succeeded", "failed", "lost", "timed_out"}:
                return f"{seen['state']} {seen['message']}".strip()
            assert time.monotonic() < deadline, seen


@SANDBOX
def test_a_run_of_two_ranks_succeeds_inside_the_units_sandbox(place: Place, url: str) -> None:
    place.fill_cache()
    assert ended(url, place, case_text(ranks=2, end_time="0.2 us")) == "succeeded"


@SANDBOX
@pytest.mark.slow
def test_the_sandbox_permits_compilation_and_gmsh(place: Place, url: str) -> None:
    text = case_text(ranks=2, end_time="0.2 us").replace("structured", "gmsh")
    assert ended(url, place, text) == "succeeded"
    assert list((place.state / ".cache/conoid/meshes").iterdir())


@SANDBOX
def test_the_sandbox_forbids_what_the_unit_forbids(place: Place) -> None:
    tried = """
import os, socket, sys
def fails(call, *words):
    try:
        call(*words)
    except OSError:
        return True
    return False
assert fails(socket.socket, socket.AF_PACKET, socket.SOCK_RAW)
assert fails(open, "/opt/conoid/new", "w")
assert fails(os.listdir, "/root")
assert fails(os.chown, "/var/lib/conoid/tmp", 0, 0)
assert fails(os.chmod, "/var/lib/conoid/tmp", 0o4700)
assert fails(os.sched_setscheduler, 0, os.SCHED_FIFO, os.sched_param(1))
assert not os.listdir("/tmp") and not os.path.exists("/dev/kmsg")
assert os.environ["TMPDIR"] == "/var/lib/conoid/tmp" and os.access(os.environ["TMPDIR"], os.W_OK)
socket.socket(socket.AF_NETLINK, socket.SOCK_RAW)
"""
    subprocess.run(place.command("/opt/conoid/bin/python", "-c", tried), check=True)


@pytest.mark.skipif(ANALYZE is None, reason="needs systemd-analyze (Debian: apt-get install systemd)")
def test_the_unit_leaves_little_open() -> None:
    words = [str(ANALYZE), "security", "--no-pager", "--offline=true", f"--threshold={10 * EXPOSURE:g}", str(UNIT)]
    subprocess.run(words, check=True, capture_output=True)


def test_the_unit_starts_the_server_again_for_as_long_as_it_takes() -> None:
    service = sandbox.read(UNIT)
    assert service["Restart"] == ["on-failure"]
    assert service["RestartSec"] == ["5s"]
    assert "\nStartLimitIntervalSec=0\n" in UNIT.read_text().partition("[Service]")[0]
