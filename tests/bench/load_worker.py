"""A worker that computes no physics, and sends the messages of 64 ranks: reports ten times per second, a snapshot every
two seconds.

The program is also its own launcher: called as ``mpiexec -n N COMMAND`` it executes the command once.
"""

import argparse
import hashlib
import json
import os
import random
import signal
import sys
import time
from pathlib import Path

from conoid.cases import messages, outcome
from conoid.cases.output import layout
from conoid.worker.output.journal import Journal
from conoid.worker.output.telemetry import Telemetry

RATE = 10.0
"""Number of reports per second."""
SNAPSHOT = 2.0
"""Time between two snapshots, s."""
BLOB = 1_000_000
"""Size of a snapshot, bytes."""
PHASES = ("elements", "contact", "fracture", "exchange", "output")


def main(words: list[str]) -> int:
    """Executes the command after ``-n N``, or runs as a worker."""
    if words[0] == "-n":
        os.execv(words[2], words[2:])
    parser = argparse.ArgumentParser()
    parser.add_argument("case", type=Path)
    parser.add_argument("--out", type=Path)
    for name in ("--run", "--telemetry", "--prefix"):
        parser.add_argument(name)
    for name in ("--ranks", "--threads"):
        parser.add_argument(name, type=int)
    options = parser.parse_args(words)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(4))
    telemetry = Telemetry(options.telemetry, options.prefix) if options.telemetry else None
    journal = Journal(options.out, options.run, telemetry)
    journal.write(messages.Status, state="running")
    until = json.loads(json.loads(options.case.read_text()).get("description") or "{}").get("seconds", 0.0)
    _talk(journal, options.out, options.ranks, until)
    ended = outcome.Outcome(state="succeeded", steps=1)
    (options.out / layout.OUTCOME).write_bytes(outcome.to_json(ended))
    journal.write(messages.Finished, 1, 1.0, state="succeeded", digest="", steps=1, elapsed=until)
    journal.close()
    return 0


def _talk(journal: Journal, folder: Path, ranks: int, seconds: float) -> None:
    """Sends the messages at their scheduled times, for the given number of seconds."""
    began = time.monotonic()
    (folder / layout.SNAPSHOTS).mkdir(exist_ok=True)
    step, shots, dice = 0, 0, random.Random(1)
    while (now := time.monotonic() - began) < seconds:
        step += 1
        _say(journal, step, now, ranks, dice)
        if now >= shots * SNAPSHOT:
            _show(journal, folder, step, now, shots)
            shots += 1
        time.sleep(max(0.0, began + step / RATE - time.monotonic()))


def _say(journal: Journal, step: int, now: float, ranks: int, dice: random.Random) -> None:
    energy = messages.Energy(
        kinetic=1.0, elastic=0.0, plastic=0.0, viscous=0.0, contact=0.0, external=0.0, initial=1.0, residual=1e-9
    )
    journal.write(
        messages.Progress, step, now, end_time=1e9, dt=1e-9, limiter="tet 1", eta=1.0, energy=energy,
        updates_per_second=1e6,
    )  # fmt: skip
    phases = {name: [dice.random() for _ in range(ranks)] for name in PHASES}
    journal.write(messages.Load, step, now, phases=phases, imbalance=1.1, steps=1, messages=[7] * ranks)


def _show(journal: Journal, folder: Path, step: int, now: float, n: int) -> None:
    blob = os.urandom(BLOB)
    path = layout.snapshot(folder, n)
    path.write_bytes(blob)
    journal.write(
        messages.Snapshot, step, now, blob=blob, n=n, path=str(path.relative_to(folder)), bytes=BLOB, triangles=50_000,
        fragments=100, sha256=hashlib.sha256(blob).hexdigest(),
    )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
