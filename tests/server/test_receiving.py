"""HTTP bodies with files over real connections: other requests are answered during the transfer, hostile bodies are
refused, memory is bounded.
"""

import hashlib
import random
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from .running import MakeProcess, Process, User, processes

MEGA = 1 << 20


@pytest.fixture(scope="module")
def up(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Process, User, User]]:
    """A server in a separate process, and the two users of the server."""
    with processes(tmp_path_factory.mktemp("files")) as make:
        yield started(make)


def started(make: MakeProcess) -> tuple[Process, User, User]:
    server = make("--no-zenoh")
    url = server.start()["url"]
    return server, server.user(url), server.user(url, "bob")


def parts_of(user: User) -> list[Path]:
    folder = user.runs / "uploads" / user.name
    return sorted(folder.iterdir()) if folder.exists() else []


def spoken(user: User, head: str, *bodies: bytes) -> bytes:
    """Sends a raw request and returns the bytes of the answer, until the server closes the connection or the answer
    is complete.
    """
    url = urlsplit(str(user.http.base_url))
    lines = f"{head}\r\nHost: x\r\nAuthorization: {user.http.headers['Authorization']}\r\n\r\n"
    with socket.create_connection((url.hostname, url.port), timeout=20) as line:
        line.sendall(lines.encode())
        answer = b""
        try:
            for body in bodies:
                line.sendall(body)
            while data := line.recv(65536):
                answer += data
                if answer.count(b"HTTP/1.1") > 1 or b"urn:conoid" in answer:
                    break
        except ConnectionError:
            pass
    return answer


def test_others_are_answered_while_a_body_arrives(up: tuple[Process, User, User]) -> None:
    """During the transfer, the server also answers other requests of the sender and receives a second file. After the
    requests of the sender the upload continues.
    """
    _, ann, bob = up
    data = random.Random(1).randbytes(3 * MEGA)
    sha256, asked, answered = hashlib.sha256(data).hexdigest(), threading.Event(), threading.Event()

    def body() -> Iterator[bytes]:
        yield data[: 2 * MEGA]
        asked.set()
        assert answered.wait(30)
        yield data[2 * MEGA :]

    answers: list[Any] = []
    headers = {"Content-Length": str(len(data))}
    sender = threading.Thread(
        target=lambda: answers.append(ann.http.put(f"/v1/files/{sha256}", content=body(), headers=headers))
    )
    sender.start()
    assert asked.wait(30)
    small = hashlib.sha256(b"small").hexdigest()
    assert bob.http.get("/v1/runs").status_code == 200
    assert ann.http.get("/v1/runs").status_code == 200
    assert ann.http.put(f"/v1/files/{small}", content=b"small").status_code == 201
    assert ann.http.put(f"/v1/files/{sha256}", content=b"x").json()["code"] == "in_progress"
    assert not answers
    answered.set()
    sender.join(30)
    assert answers[0].status_code == 201


def test_more_bytes_than_were_announced_are_no_part_of_the_file(up: tuple[Process, User, User]) -> None:
    _, ann, _ = up
    sha256 = hashlib.sha256(b"0123456789").hexdigest()
    answer = spoken(ann, f"PUT /v1/files/{sha256} HTTP/1.1\r\nContent-Length: 10", b"0123456789" + b"more" * 5000)
    assert answer.startswith(b"HTTP/1.1 201")
    assert b"HTTP/1.1 400" in answer
    (path,) = (path for path in parts_of(ann) if path.name == sha256)
    assert path.read_bytes() == b"0123456789"


@pytest.mark.parametrize(
    ("head", "code"),
    [
        ("Transfer-Encoding: chunked", b"length_required"),
        ("Content-Length: 1000000000000000", b"too_large"),
        ("Content-Length: 20000000\r\nContent-Encoding: gzip", b"unsupported_encoding"),
        ("Content-Length: 20000000\r\nContent-Range: bytes 0-19999998/20000000", b"bad_range"),
    ],
)
def test_a_body_without_end_is_refused_before_it_is_read(
    up: tuple[Process, User, User], head: str, code: bytes
) -> None:
    """The server reads at most as many bytes as of any other body that is answered before its end."""
    _, ann, _ = up
    before = parts_of(ann)
    answer = spoken(ann, f"PUT /v1/files/{'ab' * 32} HTTP/1.1\r\n{head}", b"10000\r\n")
    assert code in answer
    assert answer.count(b'"detail"') == 1
    assert parts_of(ann) == before


def test_a_body_that_breaks_off_leaves_what_has_come(up: tuple[Process, User, User]) -> None:
    """Another connection sends the remaining bytes of the file."""
    _, ann, _ = up
    data = random.Random(2).randbytes(MEGA)
    sha256 = hashlib.sha256(data).hexdigest()
    url = urlsplit(str(ann.http.base_url))
    with socket.create_connection((url.hostname, url.port)) as line:
        head = f"PUT /v1/files/{sha256} HTTP/1.1\r\nHost: x\r\nContent-Length: {MEGA}\r\n"
        line.sendall(f"{head}Authorization: {ann.http.headers['Authorization']}\r\n\r\n".encode() + data[:700_000])
        time.sleep(0.2)
    deadline = time.monotonic() + 20
    while (there := ann.http.get(f"/v1/files/{sha256}").json()).get("offset") != 700_000:
        assert time.monotonic() < deadline, there
    rest = ann.http.put(
        f"/v1/files/{sha256}", content=data[700_000:], headers={"Content-Range": f"bytes 700000-{MEGA - 1}/{MEGA}"}
    )
    assert rest.status_code == 201


def test_a_new_connection_replaces_a_stalled_one(up: tuple[Process, User, User]) -> None:
    """A broken connection cannot be distinguished from a slow connection for five seconds."""
    _, ann, _ = up
    data = random.Random(3).randbytes(MEGA)
    sha256 = hashlib.sha256(data).hexdigest()
    url = urlsplit(str(ann.http.base_url))
    with socket.create_connection((url.hostname, url.port)) as line:
        head = f"PUT /v1/files/{sha256} HTTP/1.1\r\nHost: x\r\nContent-Length: {MEGA}\r\n"
        line.sendall(f"{head}Authorization: {ann.http.headers['Authorization']}\r\n\r\n".encode() + data[: MEGA // 2])
        first = time.monotonic()
        codes = []
        while True:
            there = ann.http.get(f"/v1/files/{sha256}").json().get("offset", 0)
            span = {"Content-Range": f"bytes {there}-{MEGA - 1}/{MEGA}"}
            answer = ann.http.put(f"/v1/files/{sha256}", content=data[there:], headers=span)
            codes.append(answer.json().get("code", ""))
            if answer.status_code == 201:
                break
            assert time.monotonic() < first + 20
            time.sleep(0.2)
        line.settimeout(10)
        assert b"HTTP/1.1 409" in line.recv(65536)
    assert time.monotonic() - first > 4.0
    assert set(codes[:-1]) <= {"in_progress", "wrong_offset"}
    assert codes[0] == "in_progress"


def peak(server: Process) -> int:
    """Returns the largest memory of a server so far, bytes."""
    assert server.child is not None
    text = Path(f"/proc/{server.child.pid}/status").read_text()
    return 1024 * int(next(line for line in text.splitlines() if line.startswith("VmHWM")).split()[1])


@pytest.mark.parametrize("size", [20 * MEGA, pytest.param(200 * MEGA, marks=pytest.mark.slow)])
def test_the_memory_of_the_server_does_not_grow_with_a_file(
    up: tuple[Process, User, User], tmp_path: Path, size: int
) -> None:
    """The file is sent in one PUT; every GET of another user is answered during this PUT."""
    server, ann, bob = up
    path, digest, made = tmp_path / "large", hashlib.sha256(), random.Random(size)
    with path.open("wb") as file:
        for _ in range(size // MEGA):
            block = made.randbytes(MEGA)
            file.write(block)
            digest.update(block)
    before, worst, over = peak(server), 0.0, threading.Event()
    answers: list[Any] = []

    def send() -> None:
        with path.open("rb") as file:
            answers.append(ann.http.put(f"/v1/files/{digest.hexdigest()}", content=file))
        over.set()

    threading.Thread(target=send).start()
    while not over.is_set():
        began = time.monotonic()
        assert bob.http.get("/v1/runs").status_code == 200
        worst = max(worst, time.monotonic() - began)
    assert answers[0].status_code == 201
    grown = peak(server) - before
    print(f"{size / 1e6:.0f} MB: the server grew by {grown / 1e6:.1f} MB, the slowest GET took {1e3 * worst:.0f} ms")
    assert grown < 15e6
