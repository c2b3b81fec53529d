"""Answers of an arbitrary server: the client prints an error in one line, in a bounded time, and writes no file outside
of the folder.
"""

import itertools
import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from typer.testing import CliRunner

from conoid.client.cli import app
from conoid.client.errors import AnswerError, ClientError, UsageError
from conoid.client.local.safe_paths import inside
from conoid.client.remote import http, replies
from conoid.client.remote.config import address
from conoid.client.remote.http import Http
from conoid.client.run import Run

from .hostile import Answer, Hostile, answering, head, hostile, run_info

COMMANDS = [
    ("show", "a"), ("ls",), ("get", "a"), ("watch", "a"), ("cancel", "a"), ("sweep-table", "a"), ("show", "last"),
]  # fmt: skip
OTHERS = [
    ("restart", "a"), ("submit", "demo"), ("sweep-cancel", "last"), ("compare", "a", "a"), ("view", "a"),
    ("report", "a"), ("figures", "energy", "a", "x.png"), ("sweep", "demo", "--set", "run.ranks=1,2"),
]  # fmt: skip
ODD: dict[str, Answer] = {
    "a page": answering(b"<html>Welcome</html>", kind="text/html"),
    "a page of a proxy": answering(b"<html>Bad gateway</html>", 502, "text/html"),
    "bytes": answering(bytes(range(256)), 500, "application/octet-stream"),
    "a number": answering(5),
    "a list": answering([]),
    "nothing": answering(b""),
    "no content": answering(b"", 204),
    "another shape": answering({"runs": 5, "id": [], "state": {}, "events": "x", "files": {"a": 1}, "sweeps": None}),
    "a depth": answering(b"[" * 100_000),
    "a depth of a refusal": answering(b"[" * 100_000, 400),
    "a state of a newer server": answering(run_info(state="paused")),
    "an id that is a path": answering(run_info(id="../x")),
    "errors that are a number": answering({"detail": ["x"], "errors": 7, "hint": {"a": 1}}, 422),
    "errors of odd kinds": answering({"errors": [{"key": 5, "value": None}, 3]}, 422),
    "a refusal without end": answering({"detail": "x\n" * 1_000_000}, 409),
    "elsewhere": lambda: [head(302, 0, more="Location: http://other.test/\x1b[31m\r\n")],
    "not packed": lambda: [head(200, 4, more="Content-Encoding: gzip\r\n"), b"abcd"],
    "no HTTP": lambda: [b"SSH-2.0-OpenSSH_9.6\r\n"],
    "broken off": lambda: [head(200, 100), b"{"],
    "silence": lambda: [],
    "half a head": lambda: [b"HTTP/1.1 200 OK\r\nContent-Le"],
    "a head without end": lambda: itertools.chain([b"HTTP/1.1 200 OK\r\nA: "], itertools.repeat(b"x" * 65536)),
    "heads without end": lambda: itertools.chain([b"HTTP/1.1 200 OK\r\n"], itertools.repeat(b"A: b\r\n" * 10_000)),
}


@pytest.fixture
def server(quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hostile]:
    monkeypatch.setattr(time, "sleep", lambda seconds: None)
    with hostile() as made:
        yield made


class Every(dict[str, Answer]):
    """A server that gives the same answer at every path."""

    def __init__(self, answer: Answer) -> None:
        self.answer = answer

    def get(self, path: str, default: Any = None) -> Answer:
        return self.answer


@pytest.mark.parametrize("name", ODD)
def test_an_odd_answer_is_one_line_of_every_command(name: str, server: Hostile) -> None:
    server.answers = Every(ODD[name])
    for words in [*COMMANDS, *(OTHERS if name == "another shape" else ())]:
        if name in {"a state of a newer server", "an id that is a path"} and words[0] in {"sweep", "get"}:
            continue
        result = CliRunner().invoke(app, [*words, "--url", server.url])
        assert isinstance(result.exception, SystemExit), (words, repr(result.exception))
        assert result.exit_code in {1, 2}, words
        lines = result.stderr.splitlines()
        assert len(lines) == 1 or name == "errors of odd kinds", (words, lines)
        assert all(line.startswith("conoid: ") and len(line) < 3000 for line in lines), (words, lines)


def drip(first: bytes, pause: float = 0.02) -> Answer:
    def pieces() -> Iterator[bytes]:
        yield first
        for _ in range(3000):
            hold.wait(pause)
            yield b"x"

    hold = threading.Event()
    return pieces


def endless(first: bytes, piece: bytes) -> Answer:
    return lambda: itertools.chain([first], itertools.repeat(piece))


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (endless(head(200, None), b"[" * 65536), "is longer than 1.05 MB"),
        (endless(head(500, None), b"x" * 65536), "is longer than 1.05 MB"),
        (endless(head(200, 1 << 60), b"[" * 65536), "is longer than 1.05 MB"),
        (drip(b"HTTP/1.1 200 OK\r\nA: "), "did not answer completely within"),
        (drip(head(200, 3000)), "is too slow"),
        (drip(head(200, None)), "is too slow"),
    ],
)
def test_an_answer_without_end_is_given_up(
    answer: Answer, words: str, server: Hostile, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replies, "LONGEST", 1 << 20)
    monkeypatch.setattr(http, "_ANSWER", 0.5)
    monkeypatch.setattr(http, "_SPARE", -29.5)
    server.answers = Every(answer)
    with Http(server.url) as asked, pytest.raises(AnswerError, match=words):
        asked.me()
    assert len(server.asked) == 1, "it is not asked for again"


def test_a_stream_without_end_is_given_up(server: Hostile) -> None:
    server.answers = Every(endless(head(200, None, "text/event-stream"), b"data: " + b"x" * 65536))
    with Http(server.url) as asked, pytest.raises(ClientError, match="byte limit"):
        list(asked.stream("/v1/runs/a/stream"))


def test_an_invalid_message_is_one_line(server: Hostile) -> None:
    server.answers["/s"] = answering(b"data: [1, 2]\n\n", kind="text/event-stream")
    with Http(server.url) as asked, pytest.raises(AnswerError, match="cannot be read"):
        list(asked.stream("/s"))
    server.answers["/v1/runs/a/events"] = answering({"events": [[1]], "last": 1, "more": False})
    with Http(server.url) as asked, pytest.raises(AnswerError, match="cannot be read"):
        Run(asked, "a").events()


def test_a_file_that_no_disk_holds_is_not_begun(server: Hostile, tmp_path: Path) -> None:
    server.answers["/f"] = endless(head(200, 1 << 60), b"x" * 65536)
    with Http(server.url) as asked, pytest.raises(ClientError, match="are free"):
        asked.download("/f", tmp_path / "f")
    assert not (tmp_path / "f").exists()


def test_a_file_without_a_length_has_one_all_the_same(
    server: Hostile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replies, "LONGEST", 1 << 20)
    server.answers["/f"] = endless(head(200, None), b"x" * 65536)
    with Http(server.url) as asked, pytest.raises(AnswerError, match="is longer than"):
        asked.download("/f", tmp_path / "f")
    assert not list(tmp_path.glob("*f*"))


# Names ----------------------------------------------------------------------------------------------------------------

OUTSIDE = [
    "../x", "a/../../x", "/etc/passwd", "//host/x", "..", ".", "", "./", "a/..", "a\\..\\..\\x", "\\\\host\\x", "C:\\x",
    "c:x", "a\0b", "\0", "x" * 300, "a/" + "x" * 256, "\ud800", "../" * 50 + "x", "out/secret", "out/a/b", "./../x",
]  # fmt: skip


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_name_from_a_server_is_below_the_folder_or_refused(name: str, server: Hostile, quiet_home: Path) -> None:
    elsewhere = quiet_home / "elsewhere"
    elsewhere.mkdir()
    into = quiet_home / "into"
    into.mkdir()
    (into / "out").symlink_to(elsewhere)
    with pytest.raises(ClientError) as raised:
        inside(into, name)
    assert len(str(raised.value)) < 300
    server.answers = Every(answering(b"evil"))
    listed = json.dumps({"files": [{"path": name, "size": 4}]}).encode()
    server.answers = {"/v1/runs/a": answering(run_info()), "/v1/runs/a/files": answering(listed)}
    before = everything(quiet_home)
    result = CliRunner().invoke(app, ["get", "a", "--out", "into", "--url", server.url])
    assert isinstance(result.exception, SystemExit), repr(result.exception)
    assert len(result.stderr.splitlines()) == 1
    assert everything(quiet_home) == before


def everything(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))


@pytest.mark.parametrize("name", ["a b%20#?.txt", "übung", "-x", "ab:c", "x" * 250, "frames/a\nb", ".hidden", "a\\b"])
def test_an_odd_name_is_fetched_as_it_is(name: str, server: Hostile, quiet_home: Path) -> None:
    listed = {"files": [{"path": name, "size": 2}]}
    server.answers = {"/v1/runs/a": answering(run_info()), "/v1/runs/a/files": answering(listed)}
    server.answers[f"/v1/runs/a/files/{quote(name)}"] = answering(b"ok", kind="text/plain")
    result = CliRunner().invoke(app, ["get", "a", "--out", "into", "--url", server.url])
    assert result.exit_code == 0, result.output
    assert (Path("into") / name).read_bytes() == b"ok"


def test_a_link_in_the_folder_is_replaced_not_followed(server: Hostile, quiet_home: Path) -> None:
    (quiet_home / "mine").write_text("mine")
    (quiet_home / "into").mkdir()
    (quiet_home / "into" / "a").symlink_to(quiet_home / "mine")
    server.answers = {
        "/v1/runs/a": answering(run_info()),
        "/v1/runs/a/files": answering({"files": [{"path": "a", "size": 1}]}),
    }
    server.answers["/v1/runs/a/files/a"] = answering(b"theirs", kind="text/plain")
    assert CliRunner().invoke(app, ["get", "a", "--out", "into", "--url", server.url]).exit_code == 0
    assert (quiet_home / "mine").read_text() == "mine"


# Addresses ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "url",
    [
        "http://x/#a", "http://x#", "http://x?", "http://x/?a=b", "http://ann:secret@x", "http://x\\@y", "http://x y",
        "http://", "x", "ftp://x", "http://x:0", "http://x:99999", "http://[::1", "http://\x1b", "http://ü", "#",
        "http:x",
    ],
)  # fmt: skip
def test_an_invalid_address_is_refused_in_one_line(url: str, quiet_home: Path) -> None:
    with pytest.raises(UsageError) as raised:
        address(url)
    assert "secret" not in str(raised.value)
    result = CliRunner().invoke(app, ["ls"], env={"CONOID_URL": url})
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
    assert "secret" not in result.output


@pytest.mark.parametrize(
    ("url", "used"),
    [
        ("http://[::1]:8750/", "http://[::1]:8750"), ("https://host.test/conoid/", "https://host.test/conoid"),
        ("http://127.0.0.1:8750", "http://127.0.0.1:8750"),
    ],
)  # fmt: skip
def test_an_address_may_have_a_path(url: str, used: str) -> None:
    assert address(url) == used


def test_requests_are_below_the_path_of_the_address(server: Hostile) -> None:
    server.answers["/conoid/v1/table"] = answering({"runs": [], "cases": [], "pending": 0, "next": None})
    result = CliRunner().invoke(app, ["runs", "--url", f"{server.url}/conoid/"])
    assert result.stdout == "no runs\n"
