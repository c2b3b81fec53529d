"""A worker that computes nothing: it tells the story of a short run, in its journal and over Zenoh, and leaves files.

What it does stands in the case's ``description`` as JSON: ``steps``, ``pace`` (s a step), ``lose`` (every so many-th
message is not sent over Zenoh), ``fail`` (a cause).
"""

import argparse
import json
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

import zenoh

from conoid.cases import keys, layout, messages, outcome
from conoid.cases.load import read_data

stop = False


class Voice:
    """Journal first, then Zenoh; numbers go on from the last line of the journal."""

    def __init__(self, options: argparse.Namespace, lose: int) -> None:
        self.run, self.prefix, self.lose = options.run, options.prefix, lose
        self.journal = options.out / layout.JOURNAL
        self.seq = messages.from_json(self.journal.read_bytes().splitlines()[-1]).seq
        self.session = open_zenoh(options.telemetry) if options.telemetry else None

    def say(self, kind: type[messages.Message], **values: Any) -> None:
        self.seq += 1
        message: Any = kind(run=self.run, seq=self.seq, wall=time.time(), **values)
        with self.journal.open("ab") as file:
            file.write(messages.to_json(message) + b"\n")
        if self.session is not None and not (self.lose and self.seq % self.lose == 0):
            self.session.put(keys.message_key(self.prefix, message.channel), messages.to_msgpack(message))


def open_zenoh(endpoint: str) -> zenoh.Session:
    config = zenoh.Config()
    settings: dict[str, object] = {
        "mode": "client", "connect/endpoints": [endpoint], "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
    }  # fmt: skip
    if "CONOID_ZENOH_USER" in os.environ:
        settings["transport/auth/usrpwd/user"] = os.environ["CONOID_ZENOH_USER"]
        settings["transport/auth/usrpwd/password"] = os.environ["CONOID_ZENOH_PASSWORD"]
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("case", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--run")
    parser.add_argument("--telemetry")
    parser.add_argument("--prefix")
    options = parser.parse_args()
    if os.environ.get("PMI_RANK", "0") != "0":
        return 0
    signal.signal(signal.SIGTERM, ask_to_stop)
    plan = json.loads(read_data(options.case).get("description") or "{}")
    voice = Voice(options, plan.get("lose", 0))
    voice.say(messages.Status, state="running")
    voice.say(messages.Started, ranks=2, elements=5, nodes=8, end_time=1.0, setup=0.1, parts={"rod": 5})
    steps = plan.get("steps", 5)
    for step in range(1, steps + 1):
        if stop:
            break
        time.sleep(plan.get("pace", 0.0))
        tell_step(voice, step, steps)
    state, cause = (
        ("cancelled", "cancelled") if stop else ("failed", plan["fail"]) if "fail" in plan else ("succeeded", None)
    )
    leave(options.out, state, cause, step)
    voice.say(messages.Finished, state=state, digest="d" * 64, steps=step, elapsed=0.1)
    if voice.session is not None:
        voice.session.close()  # type: ignore[no-untyped-call]
    return {"succeeded": 0, "cancelled": 4, "failed": 3}[state]


def tell_step(voice: Voice, step: int, steps: int) -> None:
    energy = messages.Energy(
        kinetic=1.0, elastic=0.0, plastic=0.0, viscous=0.0, contact=0.0, external=0.0, initial=1.0, residual=0.0
    )
    voice.say(
        messages.Progress, step=step, t=step / steps, end_time=1.0, dt=1 / steps, limiter="tet 1", eta=0.0,
        energy=energy, updates_per_second=1e6,
    )  # fmt: skip
    voice.say(messages.Load, phases={"elements": [0.1, 0.2], "exchange": [0.1, 0.0]}, imbalance=1.33)


def leave(folder: Path, state: str, cause: str | None, steps: int) -> None:
    check = outcome.Check(name="extent of rod", value=1.01, expected=1.0, tolerance=0.1, passed=True, unit="m")
    missed = outcome.Check(name="contact time", value=3.0, expected=1.0, tolerance=0.1, passed=False, unit="s")
    ended = outcome.Outcome(
        state=state, cause=cause, message=f"the {cause} of the tale" if cause else "", steps=steps, time=1.0, ranks=2,
        digest="d" * 64, elements=5, nodes=8, reference=[check, missed],
    )  # fmt: skip
    (folder / layout.HISTORY).write_text("step,t [s]\n1,0.5\n2,1.0\n")
    (folder / layout.OUTCOME).write_bytes(outcome.to_json(ended))


def ask_to_stop(_signal: int, _frame: object) -> None:
    global stop
    stop = True


if __name__ == "__main__":
    sys.exit(main())
