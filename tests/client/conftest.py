"""A Zenoh router in this process, and a server of its own process whose worker computes nothing."""

import json
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import zenoh

from conoid.cases import keys
from conoid.cases.messages import AnyMessage, to_msgpack
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
    session.close()


@pytest.fixture
def quiet_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A home without configuration and an environment without a server."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    for name in ("CONOID_URL", "CONOID_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path
