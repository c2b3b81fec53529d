"""What telemetry costs a run: without it, to a live router, to one that freezes and to one that dies at the first step.

Whole runs of the worker, in turns: CPU time of the solver's thread, and wall time, which holds everything. And single
messages, which a neighbour on the machine cannot hide: how long the solver waits to hand one over.
"""

import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from conoid.cases import layout, messages
from conoid.cases.outcome import Outcome, from_json
from conoid.worker.output.telemetry import Telemetry

from .table import Cell, table

WAYS = ("off", "live", "frozen", "killed")
_ROOT = Path(__file__).parents[2]
_PREFIX = "conoid/v1/bench/run"
_SIGNALS = {"frozen": signal.SIGSTOP, "killed": signal.SIGKILL}
_PATIENCE = 120.0


@dataclass(frozen=True)
class Cost:
    """Seconds of the step loop of each run, in order, and the digests that came out."""

    way: str
    cpu: list[float]
    wall: list[float]
    steps: int
    digests: list[str]

    def against(self, other: "Cost") -> tuple[float, float]:
        """Median over the turns of CPU and wall time over those of ``other`` in the same turn."""
        return _ratio(self.cpu, other.cpu), _ratio(self.wall, other.wall)


def _ratio(mine: Sequence[float], theirs: Sequence[float]) -> float:
    return statistics.median(a / b for a, b in zip(mine, theirs, strict=True))


def measure(rounds: int, end_time: str = "80 us") -> list[Cost]:
    """``rounds`` runs each way, of a Taylor bar of 1,620 tets: with so few the messages weigh most."""
    runs: dict[str, list[Outcome]] = {way: [] for way in WAYS}
    for turn in range(rounds):
        for way in WAYS if turn % 2 == 0 else reversed(WAYS):
            runs[way].append(_run(way, end_time))
    return [_cost(way, done) for way, done in runs.items()]


def _cost(way: str, done: Sequence[Outcome]) -> Cost:
    cpu, wall = [o.cpu for o in done], [o.elapsed - o.setup for o in done]
    return Cost(way, cpu, wall, done[0].steps, sorted({o.digest for o in done}))


def _run(way: str, end_time: str) -> Outcome:
    with tempfile.TemporaryDirectory(prefix="conoid-bench-") as out:
        folder = Path(out)
        command = [sys.executable, "-m", "conoid.worker", "taylor_copper", "--out", out]
        for override in ("parts[0].mesh.element_size=1.07 mm", f"run.end_time={end_time}", "run.frames=0"):
            command += ["--set", override]
        router = None
        if way != "off":
            router, endpoint = _router()
            command += ["--telemetry", endpoint, "--prefix", _PREFIX]
        worker = subprocess.Popen(command)
        try:
            if router is not None and way != "live":
                _await_first_step(folder, worker)
                router.send_signal(_SIGNALS[way])
            worker.wait(_PATIENCE)
        finally:
            for process in (worker, router):
                if process is not None:
                    process.kill()
                    process.communicate()
        return from_json((folder / layout.OUTCOME).read_bytes())


def _await_first_step(folder: Path, worker: "subprocess.Popen[bytes]") -> None:
    journal = folder / layout.JOURNAL
    deadline = time.monotonic() + _PATIENCE
    while time.monotonic() < deadline and worker.poll() is None:
        lines = journal.read_bytes().splitlines(keepends=True) if journal.exists() else []
        if any(isinstance(messages.from_json(line), messages.Started) for line in lines if line.endswith(b"\n")):
            return
        time.sleep(0.01)
    raise RuntimeError(f"the worker took no step: {os.listdir(folder)}")


def _router() -> tuple["subprocess.Popen[bytes]", str]:
    """A router that listens, and its endpoint."""
    port = _free_port()
    router = subprocess.Popen(
        [sys.executable, "-m", "tests.bench.router", str(port)], cwd=_ROOT, stdout=subprocess.PIPE
    )
    assert router.stdout is not None
    router.stdout.readline()
    return router, f"tcp/127.0.0.1:{port}"


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@dataclass(frozen=True)
class Message:
    """us a message: the longest and the median wait of the solver's thread, and the CPU time of all other threads."""

    way: str
    median: float
    longest: float
    beside: float


def hand_over(count: int = 500, pause: float = 0.002) -> list[Message]:
    """Hands over ``count`` messages, one every ``pause`` s; the worker sends some eight a second."""
    return [_hand_over(way, count, pause) for way in WAYS if way != "off"]


def _hand_over(way: str, count: int, pause: float) -> Message:
    router, endpoint = _router()
    telemetry = Telemetry(endpoint, _PREFIX)
    try:
        time.sleep(1.0)
        if way != "live":
            router.send_signal(_SIGNALS[way])
        process, thread, waits = time.process_time(), time.thread_time(), []
        for number in range(count):
            message = messages.Log(run="run", seq=number, level="info", text="x" * 200)
            begin = time.perf_counter()
            telemetry.tell(message)
            waits.append(time.perf_counter() - begin)
            time.sleep(pause)
        beside = time.process_time() - process - (time.thread_time() - thread)
    finally:
        router.kill()
        router.communicate()
        telemetry.close()
    return Message(way, statistics.median(waits) * 1e6, max(waits) * 1e6, beside / count * 1e6)


def message_table(handed: Sequence[Message]) -> str:
    """us a message, each way."""
    rows: list[list[Cell]] = [[m.way, *(f"{us:.0f}" for us in (m.median, m.longest, m.beside))] for m in handed]
    return table(["router", "solver waits, us a message, median", "longest", "other threads, CPU us a message"], rows)


def report(costs: Sequence[Cost]) -> str:
    """us a step each way, and the median ratio to the runs without telemetry."""
    rows: list[list[Cell]] = []
    for cost in costs:
        cpu, wall = cost.against(costs[0])
        step = 1e6 / cost.steps
        rows.append([
            cost.way, f"{min(cost.cpu) * step:.1f} ({statistics.median(cost.cpu) * step:.1f})",
            f"{min(cost.wall) * step:.1f} ({statistics.median(cost.wall) * step:.1f})",
            f"{100 * (min(cost.cpu) / min(costs[0].cpu) - 1):+.2f} ({100 * (cpu - 1):+.2f})",
            f"{100 * (min(cost.wall) / min(costs[0].wall) - 1):+.2f} ({100 * (wall - 1):+.2f})",
            " ".join(digest[:12] for digest in cost.digests),
        ])  # fmt: skip
    head = [
        "router",
        "CPU us a step, best (median)",
        "wall us a step",
        "CPU against off, %",
        "wall against off, %",
        "digest",
    ]
    return table(head, rows) + f"\n\n{len(costs[0].cpu)} runs each way, in turns, {costs[0].steps:,} steps each.\n"
