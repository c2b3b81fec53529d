"""A worker that computes nothing. The fake worker reports the messages of a short run, in its journal and over Zenoh,
and writes files.

The case's ``description`` is JSON with these keys: ``steps``; ``pace``, s per step; ``lose``, every n-th message is not
sent over Zenoh; ``fail``, a cause; ``snapshots``, number of first steps with a snapshot each; ``warn``, a warning of
the log and of the outcome; ``flaw``, a file: while the file exists, velocities above 300 m/s fail. The probe of the
fake run has the residual velocity of Recht and Ipson with a limit velocity of 250 m/s.
"""

import argparse
import hashlib
import json
import os
import signal
import sys
import time
from array import array
from pathlib import Path
from typing import Any

import zenoh

from conoid.cases import messages, outcome
from conoid.cases.load import read_data
from conoid.cases.output import keys, layout, snapshot

stop = False


class Voice:
    """Writes messages to the journal first, then sends them over Zenoh. The numbers of the messages continue from the
    last line of the journal.
    """

    def __init__(self, options: argparse.Namespace, lose: int) -> None:
        self.run, self.prefix, self.lose = options.run, options.prefix, lose
        self.journal = options.out / layout.JOURNAL
        self.seq = messages.from_json(self.journal.read_bytes().splitlines()[-1]).seq
        self.blob = b""
        self.session = open_zenoh(options.telemetry) if options.telemetry else None

    def say(self, kind: type[messages.Message], **values: Any) -> None:
        self.seq += 1
        message: Any = kind(run=self.run, seq=self.seq, wall=time.time(), **values)
        with self.journal.open("ab") as file:
            file.write(messages.to_json(message) + b"\n")
        if self.session is not None and not (self.lose and self.seq % self.lose == 0):
            sent = messages.with_blob(message, self.blob) if isinstance(message, messages.Snapshot) else message
            self.session.put(keys.message_key(self.prefix, message.channel), messages.to_msgpack(sent))

    def show(self, n: int, folder: Path) -> None:
        """Writes a snapshot of one triangle and reports the snapshot."""
        self.blob = triangle(n)
        path = layout.snapshot(folder, n)
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(self.blob)
        self.say(
            messages.Snapshot, n=n, path=str(path.relative_to(folder)), bytes=len(self.blob), triangles=1, fragments=1,
            sha256=hashlib.sha256(self.blob).hexdigest(), step=n, t=0.1 * n,
        )  # fmt: skip


def triangle(n: int) -> bytes:
    """Returns a snapshot of one fragment."""
    header = snapshot.Header(
        n=n, step=n, t=0.1 * n, box=((0.0, 0.0, 0.0), (1.0, 2.0, 0.0)), ranks=1, parts=["rod"], tets=5,
        surface_triangles=1, fragments_total=1, fragments_listed=1,
        fields={"speed": snapshot.Field(unit="m/s", low=0.0, high=51.0)},
    )  # fmt: skip
    return snapshot.pack(header, {
        "positions": snapshot.Column("uint16", (3, 3), array("H", [0, 0, 0, 65535, 0, 0, 0, 65535, 0]).tobytes()),
        "triangles": snapshot.Column("uint32", (1, 3), array("I", [0, 1, 2]).tobytes()),
        "field:speed": snapshot.Column("uint8", (1,), b"\5"),
        "fragment_mass": snapshot.Column("float64", (1,), array("d", [0.5]).tobytes()),
    })  # fmt: skip


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
    parser.add_argument("--ranks")
    parser.add_argument("--threads")
    parser.add_argument("--set")
    parser.add_argument("--interruptible", action="store_true")
    options = parser.parse_args()
    if os.environ.get("PMI_RANK", "0") != "0":
        return 0
    signal.signal(signal.SIGTERM, ask_to_stop)
    case = read_data(options.case)
    plan = json.loads(case.get("description") or "{}")
    speed = speed_of(case)
    if speed > 300.0 and Path(plan.get("flaw", "/none")).exists():
        plan["fail"] = "physics"
    voice = Voice(options, plan.get("lose", 0))
    voice.say(messages.Status, state="running")
    voice.say(messages.Started, ranks=2, elements=5, nodes=8, end_time=1.0, setup=0.1, parts={"rod": 5})
    warnings = [plan["warn"]] if "warn" in plan else []
    for text in warnings:
        voice.say(messages.Log, level="warning", text=text)
    steps = plan.get("steps", 5)
    for step in range(1, steps + 1):
        if stop:
            break
        time.sleep(plan.get("pace", 0.0))
        tell_step(voice, step, steps)
        if step <= plan.get("snapshots", 0):
            voice.show(step - 1, options.out)
    state, cause = (
        ("cancelled", "cancelled") if stop else ("failed", plan["fail"]) if "fail" in plan else ("succeeded", None)
    )
    leave(options.out, state, cause, step, warnings, speed)
    voice.say(messages.Finished, state=state, digest="d" * 64, steps=step, elapsed=0.1)
    if voice.session is not None:
        voice.session.close()  # type: ignore[no-untyped-call]
    return {"succeeded": 0, "cancelled": 4, "failed": 3}[state]


def speed_of(case: dict[str, Any]) -> float:
    """Returns the velocity of the first part along z, m/s."""
    velocity = case["parts"][0].get("velocity", [0.0, 0.0, 0.0])
    return abs(float(str(velocity[2]).split()[0]))


def tell_step(voice: Voice, step: int, steps: int) -> None:
    energy = messages.Energy(
        kinetic=1.0, elastic=0.0, plastic=0.0, viscous=0.0, contact=0.0, external=0.0, initial=1.0, residual=0.0
    )
    voice.say(
        messages.Progress, step=step, t=step / steps, end_time=1.0, dt=1 / steps, limiter="tet 1", eta=0.0,
        energy=energy, updates_per_second=1e6,
    )  # fmt: skip
    voice.say(messages.Load, phases={"elements": [0.1, 0.2], "exchange": [0.1, 0.0]}, imbalance=1.33)


def leave(folder: Path, state: str, cause: str | None, steps: int, warnings: list[str], speed: float) -> None:
    check = outcome.Check(name="extent of rod", value=1.01, expected=1.0, tolerance=0.1, passed=True, unit="m")
    missed = outcome.Check(name="contact time", value=3.0, expected=1.0, tolerance=0.1, passed=False, unit="s")
    ended = outcome.Outcome(
        state=state, cause=cause, message=f"the {cause} of the tale" if cause else "", steps=steps, time=1.0, ranks=2,
        digest="d" * 64, elements=5, nodes=8, reference=[check, missed], warnings=warnings, cpu=0.5,
        probes=[outcome.Measured(name="left", value=max(speed**2 - 250.0**2, 0.0) ** 0.5, unit="m/s")],
    )  # fmt: skip
    (folder / layout.HISTORY).write_text("step,t [s]\n1,0.5\n2,1.0\n")
    (folder / layout.OUTCOME).write_bytes(outcome.to_json(ended))


def ask_to_stop(_signal: int, _frame: object) -> None:
    global stop
    stop = True


if __name__ == "__main__":
    sys.exit(main())
