"""The embedded Zenoh router, and the runs to which each client may subscribe."""

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
import zenoh

from conoid.cases.messages import from_msgpack
from conoid.server.database.store import Token
from conoid.server.telemetry import Telemetry, TelemetryError

from .running import PATIENCE, MakeProcess

ANN, BOB = (Token(f"t{name}", name, "", frozenset({"read"}), 0.0) for name in ("ann", "bob"))


@contextmanager
def client(port: int, user: str = "", password: str = "") -> Iterator[zenoh.Session]:
    config = zenoh.Config()
    settings: dict[str, Any] = {
        "mode": "client", "connect/endpoints": [f"tcp/127.0.0.1:{port}"], "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False, "transport/shared_memory/enabled": False,
        "timestamping/enabled": True,
        "connect/retry": {"period_init_ms": 50, "period_max_ms": 200, "period_increase_factor": 1.5},
    }  # fmt: skip
    if user:
        settings["transport/auth/usrpwd"] = {"user": user, "password": password}
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config) as session:
        yield session


class Ear:
    """A subscription of a session to a key, with the messages that have arrived."""

    def __init__(self, session: zenoh.Session, key: str) -> None:
        self.received: list[tuple[str, bytes]] = []
        self._news = threading.Event()
        self._subscriber = session.declare_subscriber(key, self._take)

    def _take(self, sample: zenoh.Sample) -> None:
        self.received.append((str(sample.key_expr), sample.payload.to_bytes()))
        self._news.set()

    def hears(self, say: Callable[[], None], patience: float = PATIENCE) -> bool:
        """Calls ``say`` until a message arrives; returns False if no message arrives in time."""
        deadline = time.monotonic() + patience
        while time.monotonic() < deadline:
            say()
            if self._news.wait(0.05):
                return True
        return False


@pytest.fixture
def telemetry(tmp_path: Path) -> Iterator[Telemetry]:
    router = Telemetry(tmp_path, "127.0.0.1", 0, [ANN, BOB])
    yield router
    router.close()


def test_each_user_receives_messages_of_own_runs_only(telemetry: Telemetry) -> None:
    ann, bob = telemetry.reader("ann", ANN), telemetry.reader("bob", BOB)
    worker = telemetry.worker("ann", "r1")
    with (
        client(telemetry.port, ann.user, ann.password) as anns,
        client(telemetry.port, bob.user, bob.password) as bobs,
        client(telemetry.port, bob.user, bob.password) as forger,
        client(telemetry.port, worker.user, worker.password) as workers,
    ):
        hers, his = Ear(anns, "conoid/v1/ann/**"), Ear(bobs, "conoid/**")
        assert hers.hears(lambda: workers.put(f"{worker.prefix}/state", b"hello"))
        workers.put("conoid/v1/bob/r2/state", b"false")
        forger.put(f"{worker.prefix}/state", b"false")
        time.sleep(0.2)
        assert {payload for _, payload in hers.received} == {b"hello"}
        assert his.received == []


def test_the_history_and_the_life_sign_pass_the_rules(telemetry: Telemetry) -> None:
    from zenoh import ext

    ann, worker = telemetry.reader("ann", ANN), telemetry.worker("ann", "r1")
    with (
        client(telemetry.port, worker.user, worker.password) as workers,
        client(telemetry.port, ann.user, ann.password) as anns,
    ):
        token = workers.liveliness().declare_token(f"{worker.prefix}/alive")
        deadline = time.monotonic() + PATIENCE
        while not [reply for reply in anns.liveliness().get(f"{worker.prefix}/alive") if reply.ok]:
            assert time.monotonic() < deadline
        token.undeclare()  # type: ignore[no-untyped-call]
        publisher = ext.declare_advanced_publisher(workers, f"{worker.prefix}/counts", cache=ext.CacheConfig())
        publisher.put(b"early")
        # A Zenoh subscriber requests the history once. The declaration of the publisher's cache arrives over another
        # connection, perhaps after the request. Therefore the subscriber repeats the request until the history arrives.
        received, deadline = threading.Event(), time.monotonic() + PATIENCE
        while not received.is_set():
            assert time.monotonic() < deadline
            late = ext.declare_advanced_subscriber(
                anns, f"{worker.prefix}/counts", lambda _: received.set(), history=ext.HistoryConfig()
            )
            received.wait(1.0)
            late.undeclare()  # type: ignore[no-untyped-call]
        publisher.undeclare()  # type: ignore[no-untyped-call]


@pytest.mark.parametrize(("user", "password"), [("", ""), ("tann", "wrong"), ("nobody", "x"), ("worker.ann", "")])
def test_strangers_are_refused(telemetry: Telemetry, user: str, password: str) -> None:
    with pytest.raises(zenoh.ZError), client(telemetry.port, user, password):
        pass


def test_a_token_that_comes_later_and_one_that_goes(telemetry: Telemetry) -> None:
    new = Token("tnew", "eve", "", frozenset({"read"}), 0.0)
    reader = telemetry.reader("eve", new)
    with client(telemetry.port, reader.user, reader.password):
        pass
    telemetry.follow([ANN, BOB])
    with pytest.raises(zenoh.ZError), client(telemetry.port, reader.user, reader.password):
        pass


def test_a_subscriber_receives_messages_after_the_router_was_reopened(telemetry: Telemetry) -> None:
    ann, worker = telemetry.reader("ann", ANN), telemetry.worker("ann", "r1")
    with (
        client(telemetry.port, ann.user, ann.password) as anns,
        client(telemetry.port, worker.user, worker.password) as workers,
    ):
        telemetry.follow([ANN])
        assert Ear(anns, "conoid/v1/ann/**").hears(lambda: workers.put(f"{worker.prefix}/state", b"x"))


def test_passwords_stay_in_one_place(telemetry: Telemetry, tmp_path: Path) -> None:
    assert sorted(path.name for path in tmp_path.iterdir()) == ["server.secret"]
    assert (tmp_path / "server.secret").stat().st_mode & 0o777 == 0o600
    same = Telemetry(tmp_path, "127.0.0.1", 0, [ANN])
    assert same.reader("ann", ANN) == type(same.reader("ann", ANN))(
        same.port, "conoid/v1/ann", "tann", telemetry.reader("ann", ANN).password
    )
    same.close()


def test_a_port_that_is_taken(telemetry: Telemetry, tmp_path: Path) -> None:
    with pytest.raises(TelemetryError, match=rf"port {telemetry.port}: address already in use"):
        Telemetry(tmp_path, "127.0.0.1", telemetry.port, [])


def test_the_server_publishes_its_own_states(process: MakeProcess, tmp_path: Path) -> None:
    server = process("--zenoh-port", "0")
    ann = server.user(server.start()["url"])
    zenoh_ = ann.http.get("/v1/me").json()["zenoh"]
    port = int(zenoh_["endpoint"].rpartition(":")[2])
    with client(port, zenoh_["user"], zenoh_["password"]) as session:
        ear = Ear(session, f"{zenoh_['prefix']}/**")
        run = ann.submit()
        ann.wait_for(run)
        received = [from_msgpack(payload) for _, payload in ear.received]
        states = [(message.seq, getattr(message, "state", "")) for message in received]
        assert states == [(2, "queued"), (3, "starting"), (ann.events(run)[-1]["seq"], "succeeded")]
        assert {key for key, _ in ear.received} == {f"conoid/v1/ann/{run}/state"}
    elsewhere = {"Host": "conoid.example.org"}
    assert ann.http.get("/v1/me", headers=elsewhere).json()["zenoh"] is None, "it listens on loopback only"
    seen = json.loads((tmp_path / "runs" / run / "environment.json").read_text())
    with client(port, seen["CONOID_ZENOH_USER"], seen["CONOID_ZENOH_PASSWORD"]):
        pass


def test_a_token_made_while_the_server_runs(process: MakeProcess) -> None:
    server = process("--zenoh-port", "0")
    url = server.start()["url"]
    for name in ("ann", "bob"):
        access = server.user(url, name).http.get("/v1/me").json()["zenoh"]
        with client(int(access["endpoint"].rpartition(":")[2]), access["user"], access["password"]):
            pass


def test_without_tokens_anybody_on_this_machine_may_listen(tmp_path: Path) -> None:
    router = Telemetry(tmp_path, "127.0.0.1", 0, None)
    access = router.worker("local", "r1")
    assert (access.user, access.password) == ("", "")
    with client(router.port) as session:
        assert Ear(session, "**").hears(lambda: session.put("conoid/v1/local/r1/state", b"x"))
    router.close()


def test_idle_connections_do_not_close_the_port(telemetry: Telemetry) -> None:
    """Neither open connections nor connections that replace closed connections block the port."""
    ann, worker = telemetry.reader("ann", ANN), telemetry.worker("ann", "r1")
    with ExitStack() as stack:
        for _ in range(150):
            stack.enter_context(socket.create_connection(("127.0.0.1", telemetry.port)))
        began = time.monotonic()
        with (
            client(telemetry.port, worker.user, worker.password) as workers,
            client(telemetry.port, ann.user, ann.password) as anns,
        ):
            assert Ear(anns, "conoid/v1/ann/**").hears(lambda: workers.put(f"{worker.prefix}/state", b"hello"))
        assert time.monotonic() - began < 5.0
