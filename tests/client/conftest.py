"""A Zenoh router in this process, and a server of its own process whose worker computes nothing."""

import json
import socket
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import zenoh

from conoid.cases import keys
from conoid.cases.messages import AnyMessage, to_msgpack
from conoid.client.local import LocalServer
from conoid.client.session import Router

OWNER = "ann"


@dataclass
class Broker:
    """A router with one user, and a publisher inside it."""

    session: zenoh.Session
    router: Router

    def publish(self, message: AnyMessage) -> None:
        """Sends a message as a worker does."""
        key = keys.message_key(keys.run_prefix(OWNER, message.run), message.channel)
        self.session.put(key, to_msgpack(message))


def free_port() -> int:
    """A port on the loopback address that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@pytest.fixture(scope="module")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Broker]:
    users = tmp_path_factory.mktemp("zenoh") / "users"
    users.write_text("ann:secret\n")
    port = free_port()
    config = zenoh.Config()
    for key, value in {
        "mode": "router",
        "listen/endpoints": [f"tcp/127.0.0.1:{port}"],
        "scouting/multicast/enabled": False,
        "scouting/delay": 0,
        "transport/shared_memory/enabled": False,
        "transport/auth/usrpwd": {"user": "server", "password": "x", "dictionary_file": str(users)},
    }.items():
        config.insert_json5(key, json.dumps(value))
    session = zenoh.open(config)
    yield Broker(session, Router(endpoint=f"tcp/127.0.0.1:{port}", user="ann", password="secret"))
    session.close()  # type: ignore[no-untyped-call]


@pytest.fixture
def quiet_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, no configuration, and an environment without a server."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    for name in ("CONOID_URL", "CONOID_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


FAKE_WORKER = f"{sys.executable} {Path(__file__).with_name('fake_worker.py')}"


def case_file(folder: Path, ranks: int = 1, **plan: Any) -> Path:
    """A small case; ``plan`` is for the fake worker."""
    path = folder / "bar.toml"
    path.write_text(f"""
name = "bar"
title = "A steel bar"
description = '{json.dumps(plan)}'
[[parts]]
name = "rod"
material = "steel_42crmo4"
mesh = {{ shape = "box", low = [0, 0, 0], high = [1e-3, 1e-3, 4e-3], element_size = 5e-4, generator = "structured" }}
[run]
end_time = "1 us"
ranks = {ranks}
""")
    return path


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalServer]:
    """A real server in a process of its own; its workers are fake."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CONOID_WORKER", FAKE_WORKER)
        with LocalServer(tmp_path_factory.mktemp("server") / "runs", slots=4) as running:
            yield running
