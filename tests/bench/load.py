"""A server under load: the command is ``python -m tests.bench.load [SECONDS]``.

A thousand runs wait while a run with 64 ranks sends messages ten times per second and a snapshot every two seconds. 20
clients watch this run, ten over Zenoh and ten over SSE. During this time GET requests are sent 20 times per second. At
the end the server is killed and started again. Each client is a separate process; no physics is computed. The memory of
the server is printed every minute: a measurement of 3600 s shows whether the memory grows.
"""

import json
import math
import os
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx2

from conoid.client.remote.session import Session
from conoid.server.database.store import Store
from conoid.server.requests.tokens import create_token
from conoid.server.runs import folder
from conoid.server.runs.folder import Submission

from . import machine
from .gates import Gate, report
from .table import table

ROOT = Path(__file__).parents[2]
WORKER = f"{sys.executable} {Path(__file__).with_name('load_worker.py')}"
RANKS, QUEUED, WATCHERS, ASKS = 64, 1000, 20, 20.0
"""Number of ranks of the run; number of waiting runs; number of readers of the stream; number of GET requests per
second."""
_STARTS = 120.0
_CASE = {
    "name": "load",
    "parts": [{
        "name": "rod", "material": "steel",
        "mesh": {"shape": "box", "low": [0, 0, 0], "high": [1e-3, 1e-3, 4e-3], "element_size": 5e-4,
                 "generator": "structured"},
    }],
    "materials": {"steel": {"density": 7800.0, "elastic": {"young": 2e11, "poisson": 0.3}}},
}  # fmt: skip


@dataclass
class Seen:
    """Results of the measurement; times in s, memory in bytes."""

    answers: dict[str, list[float]] = field(default_factory=dict)
    stream: dict[str, list[float]] = field(default_factory=dict)
    cpu: float = 0.0
    """Mean number of cores that the server used."""
    memory: list[tuple[float, int]] = field(default_factory=list)
    restart: float = 0.0
    restart_cpu: float = 0.0
    queued: int = 0
    load: str = ""


def measure(seconds: float) -> Seen:
    """Measures one server under load for the given time."""
    seen = Seen()
    with TemporaryDirectory(prefix="conoid-load-") as place:
        runs = Path(place) / "runs"
        runs.mkdir()
        token = _fill(runs, seconds + 3 * _STARTS)
        with _served(runs) as (child, url), httpx2.Client(base_url=url, headers=_bearer(token), timeout=30.0) as http:
            run = _first(http)
            watchers = {kind: _watchers(url, token, run, kind, seconds) for kind in ("zenoh", "sse")}
            for watcher in watchers.values():
                assert watcher.stdout is not None
                watcher.stdout.readline()
            _ask(http, run, child.pid, seconds, seen)
            for kind, watcher in watchers.items():
                seen.stream[kind] = json.loads(watcher.communicate(timeout=120)[0])
            seen.queued = sum(line["state"] == "queued" for line in _all(http))
            child.kill()
            child.wait()
        began = time.monotonic()
        with _served(runs) as (child, url), httpx2.Client(base_url=url, headers=_bearer(token), timeout=30.0) as http:
            assert http.get(f"/v1/runs/{run}").status_code == 200
            seen.restart, seen.restart_cpu = time.monotonic() - began, _cpu(child.pid)
            seen.load = machine.load()
            http.post(f"/v1/runs/{run}:cancel")
    return seen


def _fill(runs: Path, seconds: float) -> str:
    """Creates the folders of all runs with the methods of a server; returns a token."""
    store = Store(f"sqlite:///{runs / 'server.sqlite'}")
    token = create_token(store, "ann", frozenset({"read", "submit"}))
    for n in range(QUEUED + 1):
        body = json.dumps({**_CASE, "description": json.dumps({"seconds": seconds})}).encode()
        run, now = folder.new_id()
        made = Submission(
            id=run, owner="ann", name="load", title="", ranks=1 if n else RANKS, submitted=now, case_file="case.json",
            body_sha256="", idempotency_key=None, wall_time=None, priority=0 if n else 1,
            estimate={"elements": 5, "core_seconds": 10.0, "memory_bytes": 1000},
        )  # fmt: skip
        folder.create(runs, made, body, b"{}")
        store.add(folder.first(made), None)
    store.close()
    return token


@contextmanager
def _served(runs: Path) -> Iterator[tuple["subprocess.Popen[bytes]", str]]:
    """Yields a server on the folder as soon as the server answers."""
    address = runs / "server.json"
    address.unlink(missing_ok=True)
    words = [sys.executable, "-m", "conoid.server", "--runs", str(runs), "--port", "0", "--zenoh-port", "0"]
    words += ["--slots", str(RANKS), "--worker", WORKER, "--mpiexec", WORKER]
    child = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, cwd=ROOT)
    try:
        deadline = time.monotonic() + _STARTS
        while not address.exists():
            assert child.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.01)
        yield child, json.loads(address.read_text())["url"]
    finally:
        if child.poll() is None:
            child.send_signal(signal.SIGTERM)
            child.wait(60)


def _bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


def _first(http: httpx2.Client) -> str:
    """Returns the run that uses the cores."""
    deadline = time.monotonic() + _STARTS
    while True:
        found = http.get("/v1/runs", params={"state": "running,starting"}).json()["runs"]
        if found and found[0]["state"] == "running":
            return str(found[0]["id"])
        assert time.monotonic() < deadline
        time.sleep(0.2)


def _all(http: httpx2.Client) -> Iterator[dict[str, str]]:
    query: dict[str, str] = {"limit": "500"}
    while True:
        page = http.get("/v1/runs", params=query).json()
        yield from page["runs"]
        if page["next"] is None:
            return
        query["cursor"] = page["next"]


def _watchers(url: str, token: str, run: str, kind: str, seconds: float) -> "subprocess.Popen[bytes]":
    words = [sys.executable, "-m", "tests.bench.load", "watch", url, token, run, kind, str(seconds)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, cwd=ROOT)


def _ask(http: httpx2.Client, run: str, pid: int, seconds: float, seen: Seen) -> None:
    """Sends GET requests of all kinds at their scheduled times, and measures CPU time and memory of the server."""
    began, cpu = time.monotonic(), _cpu(pid)
    kinds = {
        "a run": f"/v1/runs/{run}",
        "20 runs": "/v1/runs?limit=20",
        "who asks": "/v1/me",
        "events": f"/v1/runs/{run}/events?limit=10",
        "snapshots": f"/v1/runs/{run}/snapshots",
    }
    count = 0
    while (now := time.monotonic() - began) < seconds:
        name = list(kinds)[count % len(kinds)]
        begin = time.perf_counter()
        assert http.get(kinds[name]).status_code == 200
        seen.answers.setdefault(name, []).append(time.perf_counter() - begin)
        if count % round(ASKS) == 0:
            seen.memory.append((now, _memory(pid)))
            if (count // round(ASKS)) % 60 == 0:
                print(f"{now / 60:.0f} min: {seen.memory[-1][1] / 1e6:.1f} MB", file=sys.stderr, flush=True)
        count += 1
        time.sleep(max(0.0, began + count / ASKS - time.monotonic()))
    seen.cpu = (_cpu(pid) - cpu) / (time.monotonic() - began)


def _cpu(pid: int) -> float:
    """Returns the CPU time of all threads of the server, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _memory(pid: int) -> int:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def watch(url: str, token: str, run: str, kind: str, seconds: float) -> None:
    """Runs half of the clients: prints a line when all of these clients follow the run, and later the delay of each
    message, s.
    """
    late: list[float] = []
    with Session(url, token) as session:
        info = session.run(run).status()
        last = session.get(dict[str, Any], f"/v1/runs/{run}/history")["last"]
        follow = _by_zenoh if kind == "zenoh" else _by_sse
        ready = threading.Barrier(WATCHERS // 2 + 1)
        threads = [
            threading.Thread(
                target=follow, args=(Session(url, token), info.id, last, seconds, late, ready), daemon=True
            )
            for _ in range(WATCHERS // 2)
        ]
        for thread in threads:
            thread.start()
        ready.wait(_STARTS)
        print("ready", flush=True)
        for thread in threads:
            thread.join(seconds + 30.0)
    print(json.dumps([round(value, 5) for value in late]), flush=True)


def _by_zenoh(
    session: Session, run: str, last: int, seconds: float, late: list[float], ready: threading.Barrier
) -> None:
    link = session.run(run).link()
    ready.wait(_STARTS)
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if (message := link.get(1.0)) is not None:
            late.append(time.time() - message.wall)
    link.close()


def _by_sse(session: Session, run: str, last: int, seconds: float, late: list[float], ready: threading.Barrier) -> None:
    """Messages that were sent before the subscription are not counted."""
    began, deadline = 0.0, math.inf
    for message in session.stream(f"/v1/runs/{run}/stream", last):
        if not began:
            ready.wait(_STARTS)
            began, deadline = time.time(), time.monotonic() + seconds
        elif message.wall > began:
            late.append(time.time() - message.wall)
        if time.monotonic() > deadline:
            return


def _at(values: Sequence[float], share: float) -> float:
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def _growth(seen: Seen) -> str:
    """Returns the growth of the memory in the second half of the measurement, from a fitted straight line."""
    half = seen.memory[len(seen.memory) // 2 :]
    slope = statistics.linear_regression(*zip(*half, strict=True)).slope if len(half) > 1 else 0.0
    return f"in the end {slope * 60 / 1e6:+.2f} MB a minute"


def tables(seen: Seen) -> str:
    """Returns the tables of the results."""
    every = [value for values in seen.answers.values() for value in values]
    streams = [value for values in seen.stream.values() for value in values]
    rows = {**seen.answers, "all GETs": every, **{f"stream, {k}": v for k, v in seen.stream.items()}}
    lines = [
        (name, len(v), 1e3 * statistics.median(v), 1e3 * _at(v, 0.99), 1e3 * max(v)) for name, v in rows.items() if v
    ]
    first, last = seen.memory[len(seen.memory) // 10][1], seen.memory[-1][1]
    shown = [
        Gate("GET p99", "at most 50 ms", f"{1e3 * _at(every, 0.99):.1f} ms", _at(every, 0.99) <= 0.05),
        Gate("stream p50", "at most 100 ms", f"{1e3 * _at(streams, 0.5):.1f} ms", _at(streams, 0.5) <= 0.1),
        Gate("server", "below one core", f"{seen.cpu:.2f} cores", seen.cpu < 1.0),
        Gate(
            "restart with runs that wait",
            "answers within 2 s",
            f"{seen.restart:.2f} s ({seen.restart_cpu:.2f} s of a core)",
            seen.restart <= 2.0,
        ),
        Gate("memory", "flat", f"{first / 1e6:.1f} to {last / 1e6:.1f} MB, {_growth(seen)}", last <= 1.05 * first),
    ]
    head = ("what", "number", "median, ms", "p99, ms", "worst, ms")
    words = f"{seen.queued} runs wait, {WATCHERS} watchers, {RANKS} ranks; {seen.memory[-1][0]:.0f} s; load {seen.load}"
    return f"{words}\n\n{table(head, lines)}\n\n{report(shown)}"


if __name__ == "__main__":
    if sys.argv[1:2] == ["watch"]:
        watch(sys.argv[2], sys.argv[3], sys.argv[4], sys.argv[5], float(sys.argv[6]))
    else:
        print(tables(measure(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)))
