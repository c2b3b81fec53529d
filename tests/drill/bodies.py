"""Faults of runs of the real worker: a mesh file of the run that is damaged before the start or before a restart, and
runs with bonds and with rigid bodies that are killed and restarted."""

import hashlib
import json
import os
import shlex
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

from conoid.cases.output import checkpoints, layout
from conoid.server.launch import processes
from conoid.server.runs import folder

from ..server.running import TOML
from . import judge
from .damage import ANY_FAILURE, IRREGULAR, OF_FILES, WAYS
from .judge import TRUE, Row
from .situations import SUCCEEDED, Truth
from .stand import Stand

MESH = b"*NODE\n1, 0, 0, 0\n2, 9, 0, 0\n3, 0, 9, 0\n4, 0, 0, 9\n*ELEMENT, TYPE=C3D4, ELSET=ALL\n1, 1, 2, 3, 4\n"
HASH = hashlib.sha256(MESH).hexdigest()
HEAD = """
name = "bodies"
[materials.metal]
density = "7800 kg/m^3"
elastic = { young = "200 GPa", poisson = 0.3 }
"""
BLOCK = """
[[parts]]
name = "{name}"
material = "metal"
{more}
[parts.mesh]
shape = "box"
low = ["0 mm", "0 mm", "{low} mm"]
high = ["2 mm", "2 mm", "{high} mm"]
element_size = "{size} mm"
generator = "structured"
"""
TORN = """
[[bond]]
parts = ["lower", "upper"]
kind = "tied"
strength = "20 MPa"
energy = "100 J/m^2"
"""
PARTS: dict[str, str] = {
    "a bonded case": BLOCK.format(name="lower", more="", low=0, high=2, size=1)
    + BLOCK.format(name="upper", more='velocity = [0, 0, "8 m/s"]', low=2, high=4, size=0.7)
    + TORN,
    "a rigid case": BLOCK.format(name="plate", more="", low=0, high=1, size=0.5)
    + BLOCK.format(name="ball", more='rigid = true\nvelocity = ["3 m/s", 0, "-20 m/s"]', low=1.02, high=2, size=0.5),
}
"""Two bodies that a bond joins until it breaks, and a rigid body that hits a plate again and again."""
LONG = '[run]\nend_time = "{end}"\nframes = 0\nsamples = 5\nsnapshots = 0\ncheckpoint_every = "{every}"\n'
NAMED = (
    HEAD
    + f"""
[[parts]]
name = "tet"
material = "metal"
mesh = {{ shape = "file", path = "tet.inp", unit = "1 mm", sha256 = "{HASH}" }}
"""
    + LONG.format(end="2 us", every="1 ms")
)
KINDS = (*(way for way in OF_FILES if way != "not permitted"), *IRREGULAR)
MESHLESS = ANY_FAILURE | {"failed/mesh"}


def submit(stand: Stand, text: str) -> str:
    """Submits a case as text; returns the run."""
    status, answer = stand.ask("POST", "/v1/runs", content=text, headers=TOML)
    assert status == 202, answer
    return str(answer["id"])


def damage(stand: Stand, run: str, way: str) -> None:
    """Damages the copy of the mesh file that the run has."""
    (path,) = (stand.runs / run / layout.FILES).iterdir()
    data = path.read_bytes()
    path.unlink()  # the file of the user has the same inode and must not change
    path.write_bytes(data)
    (WAYS | IRREGULAR)[way](path)


def files(stand: Stand) -> Iterator[Row]:
    """Damages the file of a waiting run, and the file of a finished run before its restart. A damaged file must end the
    run with a message; with a damaged file no run may succeed, and none may hang."""
    assert stand.ask("PUT", f"/v1/files/{HASH}", content=MESH)[0] in {200, 201}
    blocker = submit(stand, _long("a rigid case", "1 s") + f"ranks = {stand.slots}\n")
    waiting = {way: submit(stand, NAMED) for way in KINDS}
    for way, run in waiting.items():
        damage(stand, run, way)
    stand.cancel(blocker)
    yield from _judged(stand, "a mesh file of a waiting run", waiting, MESHLESS)
    ended = {way: submit(stand, NAMED) for way in KINDS}
    for run in ended.values():
        assert stand.reached(run) == "succeeded", stand.state(run)
    for way, run in ended.items():
        damage(stand, run, way)
    yield from _judged(stand, "a mesh file of a finished run", ended, SUCCEEDED)
    yield from _restarted(stand, ended)


def _judged(stand: Stand, what: str, runs: dict[str, str], states: frozenset[str]) -> Iterator[Row]:
    truths = [Truth(run, states) for run in runs.values()]
    for way, truth, (seen, seconds) in zip(runs, truths, judge.settled(stand, truths, time.monotonic()), strict=True):
        yield Row(f"{what}: {way}", "bodies", seen, seconds, judge.verdict(stand, truth, seen, seconds))


def _restarted(stand: Stand, ended: dict[str, str]) -> Iterator[Row]:
    """Restarts runs whose file is damaged: the request is refused with a reason, or the new run fails with one."""
    for way, run in ended.items():
        since, (status, answer) = time.monotonic(), stand.ask("POST", f"/v1/runs/{run}:restart")
        title = f"a mesh file before a restart: {way}"
        if status == 202:
            yield from _judged(stand, "a mesh file before a restart", {way: str(answer["id"])}, MESHLESS)
            continue
        reason = json.dumps(answer)
        right = 400 <= status < 500 and len(reason) > 20
        verdict = TRUE if right else f"lie: answered {status} {reason[:100]}"
        yield Row(title, "bodies", f"refused with {status}", time.monotonic() - since, verdict)


def checkpointed(path: Path) -> bool:
    """Returns True if a folder of a run has a complete checkpoint."""
    for place in checkpoints.found(path):
        with suppress(OSError, checkpoints.DamagedError):
            checkpoints.manifest_of(place)
            return True
    return False


def killed(stand: Stand, what: str) -> Iterator[Row]:
    """Kills a run after its first checkpoint, restarts it, and compares the answer with that of a whole run."""
    whole = submit(stand, _long(what, "300 us"))
    run = submit(stand, _long(what, "300 us"))
    deadline = time.monotonic() + stand.patience
    while not checkpointed(stand.runs / run) and time.monotonic() < deadline:
        time.sleep(0.01)
    for pid in processes.of_run(run):
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    since = time.monotonic()
    lost = judge.settle(stand, Truth(run, frozenset({"lost/node"})), since)[0]
    status, answer = stand.ask("POST", f"/v1/runs/{run}:restart", params={"ranks": 2})
    if status != 202:
        yield Row(f"{what}: killed and restarted", "bodies", lost, 0.0, f"lie: the restart answered {status}")
        return
    truths = [Truth(str(answer["id"]), SUCCEEDED), Truth(whole, SUCCEEDED)]
    (seen, seconds), _ = judge.settled(stand, truths, since)
    verdict = next((bad for one in truths if (bad := judge.verdict(stand, one, seen, seconds)) != TRUE), TRUE)
    digests = {getattr(folder.outcome(stand.runs / one.run), "digest", "") for one in truths}
    if verdict == TRUE and (len(digests) > 1 or lost != "lost/node"):
        verdict = f"lie: {lost}, then digests {' and '.join(sorted(digests))}"
    yield Row(f"{what}: killed and restarted on 2 ranks", "bodies", f"{lost}, then {seen}", seconds, verdict)


def _long(what: str, end: str) -> str:
    return HEAD + PARTS[what] + LONG.format(end=end, every="50 ms")


def groups() -> dict[str, tuple[str, Callable[[Stand], Iterator[Row]]]]:
    """Returns the groups by name, each with its kind of stand."""
    made: dict[str, tuple[str, Callable[[Stand], Iterator[Row]]]] = {"bodies: mesh files": ("solver", files)}
    return made | {f"bodies: {what} killed": ("solver", partial(killed, what=what)) for what in PARTS}


def stand(root: Path) -> Stand:
    """Returns a stand whose workers are real."""
    worker = shlex.join([sys.executable, "-m", "mpi4py", "-m", "conoid.worker"])
    return Stand(root, options=("--worker", worker), slots=3, patience=180.0)
