"""A Zenoh router with a publisher inside it, and a case for a worker that computes nothing."""

import json
import socket
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zenoh

from conoid.cases.messages import AnyMessage, to_msgpack
from conoid.cases.output import keys
from conoid.client.remote.http import Router

OWNER = "ann"


@dataclass
class Broker:
    """A Zenoh router with one user, and a publisher inside the router."""

    session: zenoh.Session
    router: Router

    def publish(self, message: AnyMessage) -> None:
        """Sends a message over Zenoh in the form in which a worker sends it."""
        key = keys.message_key(keys.run_prefix(OWNER, message.run), message.channel)
        self.session.put(key, to_msgpack(message))


def free_port() -> int:
    """Returns a port of the loopback address on which no program listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


FAKE_WORKER = f"{sys.executable} {Path(__file__).with_name('fake_worker.py')}"


def case_file(folder: Path, ranks: int = 1, **plan: Any) -> Path:
    """Writes a small case; ``plan`` configures the fake worker."""
    path = folder / "bar.toml"
    path.write_text(f"""
name = "bar"
title = "A steel bar"
description = '{json.dumps(plan)}'
[[parts]]
name = "rod"
material = "steel_42crmo4"
mesh = {{ shape = "box", low = [0, 0, 0], high = [1e-3, 1e-3, 4e-3], element_size = 5e-4, generator = "structured" }}
velocity = [0, 0, 1]
[[probes]]
name = "left"
part = "rod"
field = "velocity_z"
[run]
end_time = "1 us"
ranks = {ranks}
""")
    return path
