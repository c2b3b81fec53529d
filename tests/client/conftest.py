"""A Zenoh router in this process, and a server in a separate process whose worker computes nothing."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import zenoh

from conoid.client.drawing import renderer
from conoid.client.drawing.picture import Picture
from conoid.client.local.own_server import LocalServer
from conoid.client.remote.http import Router

from .drawing_process import Ended, studio
from .fakes import FAKE_WORKER, Broker, free_port


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


@pytest.fixture(scope="session")
def one_child() -> Iterator[Callable[[Picture], Ended]]:
    """Child process that draws pictures; it starts when the first picture is drawn."""
    with studio() as draw:
        yield draw


@pytest.fixture
def warm(one_child: Callable[[Picture], Ended], monkeypatch: pytest.MonkeyPatch) -> None:
    """Draws all pictures of the tests in one child process, instead of one process for each picture."""
    monkeypatch.setattr(renderer, "child", one_child)


@pytest.fixture
def quiet_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A test environment: an empty working folder, no configuration file, and no address of a server."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    for name in ("CONOID_URL", "CONOID_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalServer]:
    """A real server in a separate process with the fake worker."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CONOID_WORKER", FAKE_WORKER)
        with LocalServer(tmp_path_factory.mktemp("server") / "runs", slots=4) as running:
            yield running
