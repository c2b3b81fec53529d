"""Servers for tests, in this process or in a separate process. The worker of these servers computes nothing."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from conoid.server.app import build_app, opened
from conoid.server.requests.tokens import create_token
from conoid.server.settings import Caps, Settings

from .chromium import Browser
from .node import Ask, asking
from .running import FAKE, MakeProcess, Running, User, processes
from .visitor import Site


def settings_in(place: Path) -> Settings:
    """Returns the settings of a server whose runs are below ``place``."""
    return Settings(
        runs=place / "runs", port=0, zenoh_port=None, slots=2, worker=FAKE, grace=0.5, caps=Caps(free_disk=0)
    )


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return settings_in(tmp_path)


@pytest.fixture
def server(settings: Settings) -> Iterator[Running]:
    with running(settings) as made:
        yield made


@pytest.fixture(scope="module")
def ended(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Running, str]]:
    """A server and a finished run of two ranks, shared by tests that only read files, or that restore the files that
    they change.
    """
    with running(settings_in(tmp_path_factory.mktemp("ended"))) as made:
        run = made.ann.submit(ranks=2)
        made.ann.wait_for(run)
        yield made, run


@contextmanager
def running(settings: Settings) -> Iterator[Running]:
    """A server in this process. All workers of the server have ended after the test."""
    with opened(settings) as service, TestClient(build_app(service), base_url="http://127.0.0.1") as client:
        users = []
        for name in ("ann", "bob"):
            token = create_token(service.store, name, frozenset({"read", "submit", "metrics"}))
            users.append(User(_like(client, token), name, settings.runs))
        yield Running(service, users[0], users[1], User(client, "nobody", settings.runs))
        service.supervisor.end_all()
        assert not service.supervisor._watches, "a worker outlived its test"


def _like(client: TestClient, token: str) -> TestClient:
    """Returns a client of the server with a token, inside the same event loop."""
    other = TestClient(client.app, base_url="http://127.0.0.1", headers={"Authorization": f"Bearer {token}"})
    other.portal = client.portal
    return other


@pytest.fixture
def process(tmp_path: Path) -> Iterator[MakeProcess]:
    with processes(tmp_path) as make:
        yield make


@pytest.fixture(scope="module")
def ask(tmp_path_factory: pytest.TempPathFactory) -> Ask:
    """Function that evaluates expressions with modules of the page in node."""
    return asking(tmp_path_factory.mktemp("web"))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server without runs in a separate process. A test file that needs runs on the server defines a fixture with the
    name of this fixture.
    """
    made = Site(tmp_path_factory.mktemp("site") / "runs")
    yield made
    made.process.terminate()
    made.process.wait(60)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A Chromium with an empty profile."""
    with Browser(tmp_path_factory.mktemp("profile")) as running:
        yield running
