"""A server that answers with arbitrary bytes, and texts that must not be printed unchanged in a terminal."""

import json
import socket
import socketserver
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeAlias

Answer: TypeAlias = Callable[[], Iterable[bytes]]
"""Function that yields the pieces of an HTTP answer, including its head, in the order of sending."""

EVIL = (
    "\x1b]0;owned\x07\x1b[2J\x1b[31m\x9b31m\x08\x7f\u202egnp\u2066\u2069\u200e\u200f\u061c\u200b\u200d\ufeff\u2028"
    "\u2029\x85\x00\u2060\U000e0041 [red]red[/red] [/] :smile: {0} %s"
)
"""Text with escape sequences that rename a window, clear it or reverse text, characters without width, markup of rich,
and names of emoji."""
OBEYED = set("\x1b\x07\x9b\x08\x7f\u202e\u2066\u2069\u200e\u200f\u061c\u200b\u200d\ufeff\u2028\u2029\x85\x00\u2060") | {
    "\U000e0041"
}
"""Characters of ``EVIL`` that no command may print unescaped."""


def head(status: int, length: int | None, kind: str = "application/json", more: str = "") -> bytes:
    """Returns the head of an HTTP answer of ``length`` bytes; with None the answer ends when the connection is
    closed.
    """
    size = "" if length is None else f"Content-Length: {length}\r\n"
    return f"HTTP/1.1 {status} X\r\nContent-Type: {kind}\r\n{size}{more}Connection: close\r\n\r\n".encode()


def answering(data: Any, status: int = 200, kind: str = "application/json") -> Answer:
    """Returns a complete HTTP answer; plain data is sent as JSON."""
    body = data if isinstance(data, bytes) else json.dumps(data).encode()
    return lambda: [head(status, len(body), kind), body]


def run_info(**changes: Any) -> dict[str, Any]:
    """Returns the status of a run as a server sends it."""
    fields: dict[str, Any] = {
        "id": "a", "owner": "ann", "name": "bar", "state": "running", "ranks": 2, "submitted": 1.7e9, "started": 1.7e9,
    }  # fmt: skip
    return {**fields, **changes}


class Hostile(socketserver.ThreadingTCPServer):
    """A server with ``answers`` by path without the query; any other path gets status 404."""

    daemon_threads = True
    block_on_close = False

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.answers: dict[str, Answer] = {}
        self.asked: list[str] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"


class _Handler(socketserver.BaseRequestHandler):
    server: Hostile

    def handle(self) -> None:
        with suppress(OSError):
            asked = _head_of(self.request).split(b" ")
            path = asked[1].decode() if len(asked) > 1 else ""
            self.server.asked.append(path)
            answer = self.server.answers.get(path.partition("?")[0], answering({"detail": "there is none"}, 404))
            for piece in answer():
                self.request.sendall(piece)


def _head_of(connection: socket.socket) -> bytes:
    data = b""
    while b"\r\n\r\n" not in data and (more := connection.recv(65536)):
        data += more
    return data


@contextmanager
def hostile() -> Iterator[Hostile]:
    """Runs a hostile server while the ``with`` block runs."""
    with Hostile() as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
