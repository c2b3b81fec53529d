"""Cost of telemetry of a run for three states of the router: working, frozen, killed.

The study measures the cost per step with and without telemetry (``switch``), and the time for which the solver waits at
a single message. The digest of a run must be the same for each state of the router.
"""

import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from conoid.cases import messages
from conoid.cases.outcome import from_json
from conoid.cases.output import layout
from conoid.worker.output.telemetry import Telemetry

from . import router, switch
from .switch import Pairs
from .table import Cell, table

WAYS = ("live", "frozen", "killed")
_PREFIX = "conoid/v1/bench/run"
_SIGNALS = {"frozen": signal.SIGSTOP, "killed": signal.SIGKILL}
_PATIENCE = 120.0


def _harm(process: router.Router, way: str) -> Callable[[], None]:
    """Applies ``way`` to a router: freezes it, kills it, or does nothing."""

    def harm() -> None:
        if way in _SIGNALS:
            process.send_signal(_SIGNALS[way])

    return harm


def measure(pairs: int) -> list[Pairs]:
    """Measures the cost per step for each state of the router, from ``pairs`` pairs of blocks."""
    found = []
    for way in WAYS:
        with router.started() as (process, endpoint):
            found.append(switch.measure(way, endpoint, _PREFIX, pairs, _harm(process, way)))
    return found


def digests(end_time: str = "5 us") -> dict[str, str]:
    """Returns the digests of a short Taylor bar without telemetry and for each state of the router."""
    return {way: _digest(way, end_time) for way in ("off", *WAYS)}


def _digest(way: str, end_time: str) -> str:
    with tempfile.TemporaryDirectory(prefix="conoid-bench-") as out, ExitStack() as stack:
        command = [sys.executable, "-m", "conoid.worker", "taylor_copper", "--out", out]
        for override in (f"run.end_time={end_time}", "run.frames=0", "reference=[]"):
            command += ["--set", override]
        harm = None
        if way != "off":
            process, endpoint = stack.enter_context(router.started())
            command += ["--telemetry", endpoint, "--prefix", _PREFIX]
            harm = _harm(process, way)
        worker = stack.enter_context(subprocess.Popen(command))
        stack.callback(worker.kill)
        if harm is not None:
            _await_first_step(Path(out), worker)
            harm()
        worker.wait(_PATIENCE)
        return from_json((Path(out) / layout.OUTCOME).read_bytes()).digest


def _await_first_step(folder: Path, worker: "subprocess.Popen[bytes]") -> None:
    journal = folder / layout.JOURNAL
    deadline = time.monotonic() + _PATIENCE
    while time.monotonic() < deadline and worker.poll() is None:
        lines = journal.read_bytes().splitlines(keepends=True) if journal.exists() else []
        if any(isinstance(messages.from_json(line), messages.Started) for line in lines if line.endswith(b"\n")):
            return
        time.sleep(0.01)
    raise RuntimeError(f"the worker took no step: {os.listdir(folder)}")


@dataclass(frozen=True)
class Message:
    """Times per message, us: longest and median wait of the solver thread, and CPU time of all other threads."""

    way: str
    median: float
    longest: float
    beside: float


def hand_over(count: int = 500, pause: float = 0.002) -> list[Message]:
    """Sends ``count`` messages, one message every ``pause`` s; the worker sends about eight messages per second."""
    return [_hand_over(way, count, pause) for way in WAYS]


def _hand_over(way: str, count: int, pause: float) -> Message:
    with router.started() as (process, endpoint):
        telemetry = Telemetry(endpoint, _PREFIX)
        time.sleep(1.0)
        _harm(process, way)()
        begin, thread = time.process_time(), time.thread_time()
        waits = [_wait(telemetry, number, pause) for number in range(count)]
        beside = time.process_time() - begin - (time.thread_time() - thread)
    telemetry.close()
    return Message(way, statistics.median(waits) * 1e6, max(waits) * 1e6, beside / count * 1e6)


def _wait(telemetry: Telemetry, number: int, pause: float) -> float:
    """Returns the time to send one message, s; pauses after the message."""
    message = messages.Log(run="run", seq=number, level="info", text="x" * 200)
    begin = time.perf_counter()
    telemetry.tell(message)
    wait = time.perf_counter() - begin
    time.sleep(pause)
    return wait


def message_table(handed: Sequence[Message]) -> str:
    """Returns a table of the times per message, us, for each state of the router."""
    rows: list[list[Cell]] = [[m.way, *(f"{us:.0f}" for us in (m.median, m.longest, m.beside))] for m in handed]
    return table(["router", "solver waits, us a message, median", "longest", "other threads, CPU us a message"], rows)


def report(costs: Sequence[Pairs], answers: dict[str, str]) -> str:
    """Returns a table of the times per step with and without telemetry, us, and the median ratio of a pair with its
    interval."""
    rows = [[c.way, *_medians(c, "cpu"), _change(c, "cpu"), _change(c, "wall"), *_medians(c, "beside")] for c in costs]
    head = [
        "router", "CPU us a step, with", "without", "change, %", "change of wall time, %", "other threads, with",
        "without",
    ]  # fmt: skip
    pairs = len(costs[0].blocks) // 2
    how = f"{pairs} pairs of blocks each way; medians, in brackets where that of all pairs lies at 95 % (sign test)."
    digests = ", ".join(f"{way} {digest[:12]}" for way, digest in answers.items())
    return f"{table(head, rows)}\n\n{how}\n\nDigest of a short Taylor bar: {digests}."


def _medians(cost: Pairs, what: str) -> list[str]:
    return [f"{1e6 * cost.median(live, what):.2f}" for live in (True, False)]


def _change(cost: Pairs, what: str) -> str:
    middle, low, high = (100 * (ratio - 1) for ratio in cost.ratio(what))
    return f"{middle:+.2f} ({low:+.2f} to {high:+.2f})"
