"""Faults by an operator: irregular files, a second server on the same runs, a server killed while it accepts a
sweep."""

import json
import os
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from pathlib import Path

from conoid.cases.output import layout

from ..server.running import case_text
from . import damage
from .damage import CASE, Damage
from .judge import TRUE, Row
from .stand import START, Stand
from .strike import Strike
from .strikes import nothing

POINTS = 30
REFUSED = 2
"""Exit code of a server with wrong arguments."""
ASKS = """
import json, sys, httpx2
url, headers, body = sys.argv[1:]
httpx2.post(url.rstrip("/") + "/v1/sweeps", content=body, headers=json.loads(headers), timeout=60)
"""
"""Program of a client that submits a sweep, run in a separate process."""
Rows = Callable[[Stand], Iterator[Row]]


# Files that are none --------------------------------------------------------------------------------------------------


def irregular() -> Iterator[Damage]:
    """Yields irregular files in place of each file, for each state of the run, while the server is running or
    stopped.
    """
    files = {
        "runs": (layout.SUBMISSION, layout.JOURNAL, layout.WORKER, CASE),
        "waits": (layout.SUBMISSION, layout.JOURNAL, CASE),
        "has ended": (layout.SUBMISSION, layout.JOURNAL, layout.OUTCOME),
    }
    for doing, names in files.items():
        for name, way, down in product(names, damage.IRREGULAR, (False, True)):
            yield Damage(name, way, doing, down)


# A second server ------------------------------------------------------------------------------------------------------


def refused(stand: Stand, runs: Path, database: str = "") -> None:
    """Starts a second server on ``runs``: this server must end at once, with one line."""
    command = [sys.executable, "-m", "conoid.server", "--runs", str(runs), "--port", "0", "--no-zenoh"]
    environment = {**os.environ, "CONOID_DATABASE": database}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=START, check=False)
    assert done.returncode == REFUSED, (done.returncode, done.stderr)
    assert done.stderr.count("\n") == 1, done.stderr


def copied(stand: Stand) -> None:
    """Starts a second server on a copy of the folder."""
    copy = stand.root / "copy"
    shutil.copytree(stand.runs, copy, ignore_dangling_symlinks=True)
    refused(stand, copy)
    shutil.rmtree(copy)


def shared(stand: Stand) -> None:
    """Starts a second server on another folder, with the same database."""
    other = stand.root / "other"
    other.mkdir()
    refused(stand, other, f"sqlite:///{stand.runs / 'server.sqlite'}")
    shutil.rmtree(other)


def strikes() -> Iterator[Strike]:
    """Yields the faults with a second server, which do not affect the first server."""
    yield Strike("a copy of the folder served beside it", "operator", copied, nothing, waits=START)
    yield Strike("another folder served with the same database", "operator", shared, nothing, waits=START)


# Sweeps ---------------------------------------------------------------------------------------------------------------


def sweeps(stand: Stand) -> Iterator[Row]:
    """Kills the server while it accepts a sweep, after increasing times, with and without an idempotency key."""
    for key, pause in product(("key", ""), (0.02, 0.1, 0.2, 0.4, 0.7)):
        yield _swept(stand, f"{key}{time.monotonic_ns()}" if key else "", pause)


def _swept(stand: Stand, key: str, pause: float) -> Row:
    before = {run["id"] for run in _runs(stand)}
    points = [{"run.end_time": f"{n + 1} us"} for n in range(POINTS)]
    body = {"case": tomllib.loads(case_text(steps=1)), "points": points}
    headers = {"Content-Type": "application/json", **({"Idempotency-Key": key} if key else {})}
    assert stand.http is not None
    headers["Authorization"] = stand.http.headers["Authorization"]
    words = [str(stand.http.base_url), json.dumps(headers), json.dumps(body)]
    with subprocess.Popen([sys.executable, "-c", ASKS, *words], stderr=subprocess.DEVNULL) as client:
        deadline = time.monotonic() + stand.patience
        while not _begun(stand, len(before)) and client.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(pause)
        stand.again()
    since = time.monotonic()
    made = _settled(stand, before)
    states = {run["state"] for run in made}
    right = {"succeeded"} if len(made) == POINTS and "succeeded" in states else {"cancelled"}
    wrong = TRUE if states <= right else f"lie: {len(made)} of {POINTS} runs, {sorted(states)}"
    title = f"the server killed {pause:g} s after the first run of a sweep, {'a key' if key else 'no key'}"
    return Row(title, "sweep", f"{len(made)} runs, {'/'.join(sorted(states))}", time.monotonic() - since, wrong)


def _begun(stand: Stand, before: int) -> bool:
    return sum(path.is_dir() and len(path.name) == 22 for path in stand.runs.iterdir()) > before


def _runs(stand: Stand) -> list[dict[str, str]]:
    found: list[dict[str, str]] = stand.ask("GET", "/v1/runs?limit=500")[1]["runs"]
    return found


def _settled(stand: Stand, before: set[str]) -> list[dict[str, str]]:
    """Returns the runs of the sweep when all runs have ended, or when no further run has ended within the patience of
    the stand. The runs of the sweep start one after the other."""
    ended, deadline = -1, 0.0
    while True:
        made = [run for run in _runs(stand) if run["id"] not in before]
        over = sum(run["state"] in {"succeeded", "cancelled"} for run in made)
        if over > ended:
            ended, deadline = over, time.monotonic() + stand.patience
        if over == len(made) or time.monotonic() > deadline:
            return made
        time.sleep(0.2)


def groups(size: int = 12) -> dict[str, tuple[str, Rows]]:
    """Returns the groups of faults by name, each with its kind of stand."""
    made: dict[str, tuple[str, Rows]] = {"the server killed in a sweep": ("plain", sweeps)}
    for n, batch in enumerate(damage.batches(irregular(), size)):
        kind = "narrow" if batch[0].doing == "waits" else "wide"
        when = "no server" if batch[0].down else "a server"
        made[f"no file {n + 1}: {batch[0].doing}, {when}"] = (kind, partial(damage.rows, some=batch))
    return made
