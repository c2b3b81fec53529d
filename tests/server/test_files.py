"""A run's files over HTTP: ranges, digests, and nothing from outside the run's folder."""

import asyncio
import base64
import hashlib
import os
from pathlib import Path

import pytest
from starlette.requests import Request
from starlette.types import Message

from conoid.server.download import Downloads
from conoid.server.lanes import Lanes

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
def run(server: Running) -> str:
    made = server.ann.submit(ranks=2)
    server.ann.wait_for(made)
    return made


@pytest.fixture
def folder(server: Running, run: str) -> Path:
    return server.service.settings.runs / run


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
    ("asked", "status", "part", "told"),
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
    server: Running, run: str, folder: Path, asked: str, status: int, part: slice | None, told: str | None
) -> None:
    content = os.urandom(1000)
    (folder / "frames").mkdir()
    (folder / "frames" / "000000.vtkhdf").write_bytes(content)
    answer = server.ann.http.get(f"/v1/runs/{run}/files/frames/000000.vtkhdf", headers={"Range": asked})
    assert answer.status_code == status
    assert answer.headers.get("content-range") == told
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
        answer = await Downloads(Lanes(1, 1, PATIENCE)).respond(request, folder, "history.csv", ended=False)
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
    assert server.ann.http.get(f"/v1/runs/{run}/logs/0", params={"follow": True}).text == "rank 0 says hello\n"
