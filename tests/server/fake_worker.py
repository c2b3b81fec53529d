"""A worker that computes nothing and has the interface of the real worker: command line, journal, outcome, signals,
exit codes.

The ``description`` of the case is JSON with ``steps``, ``pace`` (s per step), ``end`` (see the function), and ``wait``
(the worker pauses until this file exists). Rank 0 of the fake worker holds the lock of the folder until its end.
"""

import argparse
import fcntl
import json
import os
import signal
import sys
import time
import tomllib
from pathlib import Path

from conoid.cases import messages, outcome
from conoid.cases.output import layout
from conoid.cases.run import ExitCode

stop = False


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("case", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--run")
    parser.add_argument("--telemetry")
    parser.add_argument("--prefix")
    parser.add_argument("--ranks")
    parser.add_argument("--threads")
    parser.add_argument("--set")
    parser.add_argument("--interruptible", action="store_true")
    parser.add_argument("--restart", action="store_true")
    options = parser.parse_args()
    rank = int(os.environ.get("PMI_RANK", "0"))
    (options.out / layout.LOGS / f"rank-{rank}.log").write_text(f"rank {rank} greets\n")
    if rank:
        return 0
    with (options.out / layout.LOCK).open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return run(options)


def run(options: argparse.Namespace) -> int:
    text = options.case.read_text()
    case = tomllib.loads(text) if options.case.suffix == ".toml" else json.loads(text)
    plan = json.loads(case.get("description") or "{}")
    for number in (signal.SIGTERM, signal.SIGUSR1):
        signal.signal(number, signal.SIG_IGN if plan.get("end") == "deaf" else ask_to_stop)
    (options.out / "environment.json").write_text(json.dumps(dict(os.environ)))
    journal = options.out / layout.JOURNAL
    seq = messages.from_json(journal.read_bytes().splitlines()[-1]).seq

    def say(message: messages.AnyMessage) -> None:
        nonlocal seq
        seq += 1
        with journal.open("ab") as file:
            file.write(messages.to_json(message).replace(b'"seq":0', b'"seq":%d' % seq) + b"\n")

    name = options.run
    if plan.get("end") == "refuse":
        print("parts[0].mesh: the body is empty", file=sys.stderr)
        return ExitCode.BAD_INPUT
    say(messages.Status(run=name, wall=time.time(), state="running"))
    size: dict[str, int] = {"ranks": 1, "threads": int(options.threads), "elements": 5, "nodes": 8}
    say(messages.Started(run=name, wall=time.time(), end_time=1.0, setup=0.1, parts={"rod": 5}, **size))
    if "wait" in plan:
        while not Path(plan["wait"]).exists() and not stop:
            time.sleep(0.005)
    steps = plan.get("steps", 3)
    done = 0
    while done < steps and not stop:
        done += 1
        time.sleep(plan.get("pace", 0.0))
        say(progress(name, done, steps))
    return end(plan.get("end", "ok"), options, say, done)


def progress(name: str, step: int, steps: int) -> messages.Progress:
    energy = messages.Energy(
        kinetic=1.0, elastic=0.0, plastic=0.0, viscous=0.0, contact=0.0, external=0.0, initial=1.0, residual=0.0
    )
    return messages.Progress(
        run=name, wall=time.time(), step=step, t=step / steps, end_time=1.0, dt=1 / steps, limiter="tet 1", eta=0.0,
        energy=energy, updates_per_second=1e6,
    )  # fmt: skip


def end(how: str, options: argparse.Namespace, say: object, steps: int) -> int:
    assert callable(say)
    if how == "crash":
        raise RuntimeError("a tet has turned inside out")
    if how == "vanish":
        os._exit(0)
    if how == "full":
        print("OSError: [Errno 28] No space left on device", file=sys.stderr)
        return ExitCode.CRASHED
    if how == "gone":
        print("a file of the run is gone or cannot be written: history.csv", file=sys.stderr)
        print("Abort(5) on node 0 (rank 0 in comm 0): application called MPI_Abort(COMM_WORLD, 5)", file=sys.stderr)
        return ExitCode.STORAGE
    if how == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    if how == "torn":
        with (options.out / layout.JOURNAL).open("ab") as file:
            file.write(b'{"type":"progress","run":"half a li')
        os._exit(1)
    if how == "garbled":
        (options.out / layout.OUTCOME).write_text('{"state": "succ')
        return ExitCode.SUCCEEDED
    if how == "deaf":
        time.sleep(600)
    state = "cancelled" if stop else "succeeded"
    if stop and options.interruptible and not (options.out / layout.STOP_REQUEST).exists():
        return interrupted(options, steps)
    result = outcome.Outcome(state=state, cause="cancelled" if stop else None, steps=steps, time=1.0, digest="d" * 64)
    (options.out / layout.OUTCOME).write_bytes(outcome.to_json(result))
    say(messages.Finished(run=options.run, wall=time.time(), state=state, digest="d" * 64, steps=steps, elapsed=0.1))
    if how == "hang":
        time.sleep(600)
    return ExitCode.INTERRUPTED if stop else ExitCode.SUCCEEDED


def interrupted(options: argparse.Namespace, steps: int) -> int:
    """Writes a checkpoint and the preliminary outcome; the process that started the worker determines the cause of the
    interruption.
    """
    layout.checkpoint(options.out, steps).mkdir(parents=True, exist_ok=True)
    (options.out / layout.INTERRUPTED).write_bytes(outcome.to_json(outcome.Outcome(state="cancelled", steps=steps)))
    return ExitCode.INTERRUPTED


def ask_to_stop(_signal: int, _frame: object) -> None:
    global stop
    stop = True


if __name__ == "__main__":
    sys.exit(main())
