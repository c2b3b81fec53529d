"""Clients that open connections and send nothing, floods of the log, and tokens that are revoked during an answer."""

import logging
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import httpx2
import pytest
from uvicorn.protocols.http.h11_impl import H11Protocol

from conoid.cases.run import State
from conoid.server.app import opened
from conoid.server.requests import auth, connections
from conoid.server.requests.connections import Connection
from conoid.server.requests.log_filter import FloodFilter
from conoid.server.requests.tokens import create_token
from conoid.server.serve import ADDRESS_FILE, _listening, _Server
from conoid.server.settings import Settings

from .running import PATIENCE, User

HALF = b"GET /healthz HTTP/1.1\r\nHost: x\r\nX-Long: "


@pytest.fixture
def ann(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> Iterator[User]:
    """A user of a server over real connections; the server accepts 20 connections at a time."""
    monkeypatch.setattr(connections, "HEADER", 1.0)
    monkeypatch.setattr(connections, "raise_limit", lambda: 20)
    with opened(settings) as service, _listening(settings) as listener:
        server = _Server(service)
        thread = threading.Thread(target=server.run, args=([listener],))
        thread.start()
        while not server.started:
            assert thread.is_alive()
            time.sleep(0.01)
        token = create_token(service.store, "ann", frozenset({"read", "submit"}))
        url = f"http://127.0.0.1:{listener.getsockname()[1]}"
        headers = {"Authorization": f"Bearer {token}"}
        with httpx2.Client(base_url=url, headers=headers, timeout=PATIENCE) as client:
            yield User(client, token, settings.runs)
        service.supervisor.end_all()
        server.should_exit = True
        thread.join(PATIENCE)


def knock(user: User) -> socket.socket:
    """Sends half of a request."""
    made = socket.create_connection((user.http.base_url.host, user.http.base_url.port))
    made.sendall(HALF)
    return made


def test_few_connections_are_accepted_in_a_turn_of_the_loop_and_as_many_wait_as_may_be_open(settings: Settings) -> None:
    assert connections.options()["backlog"] <= 4
    with opened(settings) as service, _listening(settings) as listener:
        server = _Server(service)
        thread = threading.Thread(target=server.run, args=([listener],))
        thread.start()
        try:
            deadline = time.monotonic() + PATIENCE
            while not (settings.runs / ADDRESS_FILE).exists() and time.monotonic() < deadline:
                time.sleep(0.01)
            longest = struct.unpack_from("=8xIIIIII", listener.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 104))[5]
        finally:
            server.should_exit = True
            thread.join(PATIENCE)
    assert longest == min(connections._MOST, int(Path("/proc/sys/net/core/somaxconn").read_text()))


def test_a_header_that_comes_a_byte_at_a_time_is_read_in_few_pieces(ann: User, monkeypatch: pytest.MonkeyPatch) -> None:
    pieces: list[int] = []
    read = H11Protocol.data_received

    def noted(self: H11Protocol, data: bytes) -> None:
        pieces.append(len(data))
        read(self, data)

    monkeypatch.setattr(H11Protocol, "data_received", noted)
    monkeypatch.setattr(connections, "HEADER", PATIENCE)
    began = time.monotonic()
    with knock(ann) as one:
        one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for byte in b"x" * 300 + b"\r\nConnection: close\r\n\r\n":
            one.sendall(bytes([byte]))
            time.sleep(0.001)
        assert one.makefile("rb").readline() == b"HTTP/1.1 200 OK\r\n"
    assert len(pieces) <= 4 + 1 + (time.monotonic() - began) / 0.5


def test_incomplete_requests_do_not_exclude_other_users(ann: User) -> None:
    knocks = [knock(ann) for _ in range(400)]
    for _ in range(5):
        with httpx2.Client(base_url=ann.http.base_url, timeout=5.0) as other:
            assert other.get("/healthz").status_code == 200
    assert len(Connection.idle) <= 21
    for one in knocks:
        one.close()


def test_a_header_has_its_time(ann: User) -> None:
    with knock(ann) as one:
        one.settimeout(PATIENCE)
        began = time.monotonic()
        for _ in range(3):
            one.sendall(b"x")
            time.sleep(0.1)
        with suppress(ConnectionResetError):
            assert one.recv(1) == b""
        assert time.monotonic() - began < 10.0


def test_a_connection_is_used_again(ann: User) -> None:
    for _ in range(3):
        assert ann.http.get("/v1/me").status_code == 200
    deadline = time.monotonic() + PATIENCE
    while len(Connection.idle) != 1:
        assert time.monotonic() < deadline, Connection.idle


@pytest.mark.parametrize("path", ["stream", "logs/0?follow=true"])
def test_a_revoked_user_receives_no_messages(
    ann: User, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, path: str
) -> None:
    monkeypatch.setattr(auth, "RECHECK", 0.3)
    run = ann.submit(wait=str(tmp_path / "go"), steps=10_000, pace=0.02)
    ann.wait_for(run, State.RUNNING)
    (tmp_path / "go").touch()
    with ann.http.stream("GET", f"/v1/runs/{run}/{path}") as answer:
        lines = answer.iter_raw()
        next(lines)
        revoke(ann)
        began = time.monotonic()
        for _ in lines:
            assert time.monotonic() - began < 5.0, "the stream goes on"
    assert time.monotonic() - began < 5.0


def test_a_stream_ends_on_request(ann: User, tmp_path: Path) -> None:
    run = ann.submit(wait=str(tmp_path / "go"))
    ann.wait_for(run, State.RUNNING)
    began = time.monotonic()
    assert ann.http.get(f"/v1/runs/{run}/stream?seconds=0.3").status_code == 200
    assert ann.http.get(f"/v1/runs/{run}/logs/0?follow=true&seconds=0.3").status_code == 200
    assert time.monotonic() - began < 5.0


def revoke(user: User) -> None:
    """Revokes the token in the database, as the operator does."""
    from conoid.server.database.store import Store

    store = Store(f"sqlite:///{user.runs / 'server.sqlite'}")
    assert store.revoke(user.name.split("_")[1])
    store.close()


def test_a_flood_of_one_line_is_short_in_the_log(monkeypatch: pytest.MonkeyPatch) -> None:
    quiet, now = FloodFilter(), [1000.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])

    def say() -> logging.LogRecord | None:
        record = logging.LogRecord("a", logging.ERROR, "file.py", 7, "run %s", ("x",), None)
        return record if quiet.filter(record) else None

    assert sum(say() is not None for _ in range(10_000)) == 20
    now[0] += 61.0
    last = say()
    assert last is not None
    assert last.getMessage() == "run x (and 9980 more like this)"


def test_a_body_that_was_refused_is_not_read_to_its_end(ann: User) -> None:
    """The header of the request announces a body of 1 GB."""
    place = ann.http.base_url.host, ann.http.base_url.port
    head = f"POST /v1/runs HTTP/1.1\r\nHost: x\r\nAuthorization: {ann.http.headers['Authorization']}\r\n"
    with socket.create_connection(place, timeout=PATIENCE) as one:
        one.sendall(f"{head}Content-Type: application/toml\r\nContent-Length: {1 << 30}\r\n\r\n".encode())
        assert one.recv(1 << 16).startswith(b"HTTP/1.1 413")
        sent = 0
        with suppress(ConnectionError):
            while sent < 1 << 28:
                sent += one.send(b"#" * (1 << 16))
    assert sent < 1 << 25


def test_an_answer_without_a_reader_is_cut_off(ann: User, monkeypatch: pytest.MonkeyPatch) -> None:
    real, gone = Connection._look, threading.Event()

    def look(self: Connection) -> None:
        real(self)
        if self.transport.is_closing():
            gone.set()

    monkeypatch.setattr(connections, "READ", 0.3)
    monkeypatch.setattr(Connection, "_look", look)
    run = ann.submit()
    ann.wait_for(run)
    (ann.runs / run / "large.bin").write_bytes(bytes(1 << 25))
    place = ann.http.base_url.host, ann.http.base_url.port
    head = f"GET /v1/runs/{run}/files/large.bin HTTP/1.1\r\nHost: x\r\n"
    with socket.create_connection(place, timeout=PATIENCE) as one:
        one.sendall(f"{head}Authorization: {ann.http.headers['Authorization']}\r\n\r\n".encode())
        assert gone.wait(PATIENCE)
        received = 0
        with suppress(ConnectionError):
            while chunk := one.recv(1 << 20):
                received += len(chunk)
    assert received < 1 << 25


def test_many_idle_connections_of_one_user_do_not_exclude_others(ann: User) -> None:
    """The server accepts 20 connections at a time."""
    place = ann.http.base_url.host, ann.http.base_url.port
    request = f"GET /v1/me HTTP/1.1\r\nHost: x\r\nAuthorization: {ann.http.headers['Authorization']}\r\n\r\n".encode()
    idle = [socket.create_connection(place, timeout=PATIENCE) for _ in range(30)]
    for one in idle:
        with suppress(ConnectionError):
            one.sendall(request)
            one.recv(1 << 16)
    for _ in range(5):
        with httpx2.Client(base_url=ann.http.base_url, timeout=5.0) as other:
            assert other.get("/healthz").status_code == 200
    for one in idle:
        one.close()
