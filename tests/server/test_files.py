"""Files of a run over HTTP: ranges, digests, and no access to files outside the run's folder."""

import asyncio
import base64
import hashlib
import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from starlette.requests import Request
from starlette.types import Message

from conoid.cases.run import State
from conoid.server.answers import stream
from conoid.server.answers.download import Downloads
from conoid.server.requests.thread_pool import ThreadPool

from .running import PATIENCE, Running

OUTSIDE = [
    "../server.secret",
    "%2e%2e/server.secret",
    "..%2fserver.secret",
    "log/../../server.secret",
    "log/%2e%2e/%2e%2e/server.secret",
    "/etc/passwd",
    "%2fetc%2fpasswd",
    "log//rank-0.log",
    "%2e/case.toml",
    "log",
    "log/",
    "",
    "link",
    "links/passwd",
    "inner",
    ".hidden",
    "pipe",
    "case.toml%00.json",
    "x" * 5000,
]


@pytest.fixture
def server(ended: tuple[Running, str]) -> Running:
    return ended[0]


@pytest.fixture
def run(ended: tuple[Running, str], folder: Path) -> str:
    return ended[1]


@pytest.fixture
def folder(ended: tuple[Running, str], tmp_path: Path) -> Iterator[Path]:
    """The folder of the run. The content of the file in the folder is restored after the test."""
    server, run = ended
    path = server.service.settings.runs / run
    kept = shutil.copytree(path, tmp_path / "kept")
    yield path
    shutil.rmtree(path)
    shutil.copytree(kept, path)


def test_the_listing(server: Running, run: str, folder: Path) -> None:
    (folder / ".hidden").touch()
    (folder / "link").symlink_to("/etc/passwd")
    files = server.ann.http.get(f"/v1/runs/{run}/files").json()["files"]
    names = [file["path"] for file in files]
    assert {"case.toml", "case.resolved.json", "journal.jsonl", "outcome.json", "log/rank-0.log"} <= set(names)
    assert names == sorted(names)
    assert not {".hidden", "link"} & set(names)
    for file in files:
        content = server.ann.http.get(file["url"])
        assert content.content == (folder / file["path"]).read_bytes()
        assert len(content.content) == file["size"]


def test_digest_and_etag(server: Running, run: str, folder: Path) -> None:
    place = f"/v1/runs/{run}/files/outcome.json"
    answer = server.ann.http.get(place)
    digest = hashlib.sha256((folder / "outcome.json").read_bytes()).digest()
    assert answer.headers["repr-digest"] == f"sha-256=:{base64.b64encode(digest).decode()}:"
    assert answer.headers["content-type"] == "application/json"
    again = server.ann.http.get(place, headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    head = server.ann.http.head(place)
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["content-length"] == str(len(answer.content))
    assert head.headers["repr-digest"] == answer.headers["repr-digest"]
    (folder / "outcome.json").write_bytes(b"{}")
    changed = server.ann.http.get(place, headers={"If-None-Match": answer.headers["etag"]})
    assert (changed.status_code, changed.content) == (200, b"{}")


@pytest.mark.parametrize(
    ("asked", "status", "part", "content_range"),
    [
        ("bytes=0-3", 206, slice(0, 4), "bytes 0-3/1000"),
        ("bytes=990-", 206, slice(990, None), "bytes 990-999/1000"),
        ("bytes=-10", 206, slice(990, None), "bytes 990-999/1000"),
        ("bytes=-5000", 206, slice(0, None), "bytes 0-999/1000"),
        ("bytes=0-5000", 206, slice(0, None), "bytes 0-999/1000"),
        ("bytes=0-1,5-6", 200, slice(0, None), None),
        ("bytes=-", 200, slice(0, None), None),
        ("lines=1-2", 200, slice(0, None), None),
        ("bytes=1000-", 416, None, "bytes */1000"),
        ("bytes=5-4", 416, None, "bytes */1000"),
        ("bytes=-0", 416, None, "bytes */1000"),
    ],
)
def test_ranges(
    server: Running, run: str, folder: Path, asked: str, status: int, part: slice | None, content_range: str | None
) -> None:
    content = os.urandom(1000)
    (folder / "frames").mkdir()
    (folder / "frames" / "000000.vtkhdf").write_bytes(content)
    answer = server.ann.http.get(f"/v1/runs/{run}/files/frames/000000.vtkhdf", headers={"Range": asked})
    assert answer.status_code == status
    assert answer.headers.get("content-range") == content_range
    if part is not None:
        assert answer.content == content[part]
        assert answer.headers["content-length"] == str(len(content[part]))


def test_a_download_goes_on_only_in_the_same_file(server: Running, run: str, folder: Path) -> None:
    place = f"/v1/runs/{run}/files/history.csv"
    (folder / "history.csv").write_bytes(b"0123456789")
    tag = server.ann.http.get(place).headers["etag"]
    headers = {"Range": "bytes=5-", "If-Range": tag}
    assert server.ann.http.get(place, headers=headers).content == b"56789"
    (folder / "history.csv").write_bytes(b"abcdefghij")
    changed = server.ann.http.get(place, headers=headers)
    assert (changed.status_code, changed.content) == (200, b"abcdefghij")


def test_nothing_from_outside(server: Running, run: str, folder: Path) -> None:
    (folder.parent / "server.secret").write_text("secret")
    (folder / "link").symlink_to("/etc/passwd")
    (folder / "links").symlink_to("/etc")
    (folder / "inner").symlink_to("case.toml")
    (folder / ".hidden").write_text("secret")
    os.mkfifo(folder / "pipe")
    for path in OUTSIDE:
        answer = server.ann.http.get(f"/v1/runs/{run}/files/{path}")
        assert answer.status_code == 404, path
        assert answer.json()["code"] == "not_found"


def test_a_file_that_grows_is_sent_up_to_its_size(folder: Path) -> None:
    path = folder / "history.csv"
    path.write_bytes(b"before")
    sent = []

    async def send(message: Message) -> None:
        sent.append(message.get("body", b""))

    async def receive() -> Message:
        await asyncio.sleep(PATIENCE)
        return {"type": "http.disconnect"}

    async def asked() -> str:
        request = Request({"type": "http", "method": "GET", "headers": []})
        answer = await Downloads(ThreadPool(1, 1, PATIENCE)).respond(request, folder, "history.csv", ended=False)
        with path.open("ab") as file:
            file.write(b" and after")
        await answer({"type": "http"}, receive, send)
        return answer.headers["content-length"]

    assert asyncio.run(asked()) == "6"
    assert b"".join(sent) == b"before"


def test_logs(server: Running, run: str) -> None:
    log = server.ann.http.get(f"/v1/runs/{run}/logs/1", headers={"Range": "bytes=0-5"})
    assert (log.status_code, log.text) == (206, "rank 1")
    assert server.ann.http.get(f"/v1/runs/{run}/logs/launcher").status_code == 200
    assert server.ann.http.get(f"/v1/runs/{run}/logs/2").status_code == 404
    assert server.ann.http.get(f"/v1/runs/{run}/logs/2", params={"follow": True}).status_code == 404
    assert server.ann.http.get(f"/v1/runs/{run}/logs/%2e%2e").status_code == 400
    assert server.ann.http.get(f"/v1/runs/{run}/logs/x").status_code == 400
    assert server.ann.http.get(f"/v1/runs/{run}/logs/0", params={"follow": True}).text == "rank 0 greets\n"


ODD = [
    b"a b", b"50%", b"%41", b"a<b>", b"a#b", b"a?b=c", b"back\\slash", b"line\nfeed", b'quote"', b"not-\xff-utf-8",
    "\u00e4\u0416\u4e2d".encode(), b"'a;b&c+d", b"~!*()", b"\x01\x1b[31m", "\u202egnp.exe".encode(), b"\xc0\xaf",
]  # fmt: skip


@pytest.mark.parametrize("name", ODD)
def test_a_file_of_any_name_is_listed_and_fetched(server: Running, run: str, folder: Path, name: bytes) -> None:
    inner = os.fsencode(folder) + b"/frames/" + name
    os.makedirs(inner)
    for path in (inner + b"/" + name, os.fsencode(folder) + b"/" + name):
        with open(path, "wb") as file:
            file.write(path)
    answer = server.ann.http.get(f"/v1/runs/{run}/files")
    assert answer.status_code == 200
    files = answer.json()["files"]
    seen = [server.ann.http.get(file["url"]).content for file in files]
    assert inner + b"/" + name in seen
    assert os.fsencode(folder) + b"/" + name in seen
    assert len({file["path"] for file in files}) == len(files)


def test_names_that_differ_in_what_is_no_text_are_two_files(server: Running, run: str, folder: Path) -> None:
    for name in (b"\xff", b"\xfe"):
        with open(os.fsencode(folder) + b"/" + name, "wb") as file:
            file.write(name)
    assert server.ann.http.get(f"/v1/runs/{run}/files/%ff").content == b"\xff"
    assert server.ann.http.get(f"/v1/runs/{run}/files/%FE").content == b"\xfe"
    assert server.ann.http.get(f"/v1/runs/{run}/files/%FD").status_code == 404


@pytest.mark.parametrize("odd", ["%00", "%ff", "%2f0", "%2e%2e", "..%2f..", "%5c", "%0a", "x" * 5000, "%f0%9f" * 900])
def test_no_odd_address_is_a_fault_of_the_server(server: Running, run: str, odd: str) -> None:
    for path in (
        f"/v1/runs/{odd}", f"/v1/runs/{run}{odd}", f"/v1/runs/{run}/logs/{odd}", f"/v1/runs/{run}/logs/0{odd}",
        f"/v1/runs/{run}/files/{odd}", f"/v1/runs/{run}/files/case.toml{odd}", f"/v1/runs/{run}/snapshots/{odd}",
        f"/v1/cases/{odd}", f"/v1/cases/demo{odd}", f"/v1/sweeps/{odd}", f"/v1/sweeps/{odd}/table", f"/{odd}",
    ):  # fmt: skip
        for method in ("GET", "HEAD"):
            assert server.ann.http.request(method, path).status_code in {400, 404}, path


def test_head_is_answered_wherever_get_is(server: Running, run: str) -> None:
    for path in (
        f"/v1/runs/{run}", f"/v1/runs/{run}/files", f"/v1/runs/{run}/files/case.toml", f"/v1/runs/{run}/events",
        f"/v1/runs/{run}/history", f"/v1/runs/{run}/logs/0", f"/v1/runs/{run}/logs/0?follow=true", "/v1/runs", "/v1/me",
        f"/v1/runs/{run}/snapshots", f"/v1/runs/{run}/stream", "/v1/cases", "/v1/cases/demo", "/v1/sweeps", "/healthz",
        "/readyz", "/metrics", "/openapi.json", "/v1/case.schema.json",
    ):  # fmt: skip
        head, got = server.ann.http.head(path), server.ann.http.get(path)
        assert (head.status_code, head.content) == (got.status_code, b""), path
        assert head.headers.get("content-type") == got.headers.get("content-type"), path
        if path not in {"/v1/me", "/metrics", f"/v1/runs/{run}/history"}:
            assert head.headers.get("content-length") == got.headers.get("content-length"), path


def test_head_of_what_has_no_end_ends_at_once(server: Running, tmp_path: Path) -> None:
    run = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(run, State.RUNNING)
    began = time.monotonic()
    for path in (f"/v1/runs/{run}/logs/0?follow=true", f"/v1/runs/{run}/stream"):
        assert server.ann.http.head(path).status_code == 200
    assert time.monotonic() - began < 5.0
    (tmp_path / "go").touch()


def test_a_followed_log_sends_keep_alive_bytes(
    server: Running, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The stream sends bytes with value 0 as a sign of life. A followed log does not contain bytes with the value 0."""
    monkeypatch.setattr(stream, "KEEP_ALIVE", 0.2)
    run = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(run, State.RUNNING)
    with (server.ann.runs / run / "log" / "rank-0.log").open("ab") as file:
        file.write(b"a\0b\n")
    answer = server.ann.http.get(f"/v1/runs/{run}/logs/0", params={"follow": True, "seconds": 1.5})
    assert answer.content.count(b"\0") >= 2
    assert answer.content.replace(b"\0", b"") == b"rank 0 greets\nab\n"
    (tmp_path / "go").touch()
