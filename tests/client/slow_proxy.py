"""A proxy between a client and a server, in the process of the test. The proxy can be slow, and breaks connections on
request.
"""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from urllib.parse import urlsplit

_PIECE = 1 << 16


@dataclass
class Line:
    """Settings of the proxy, and counters of the sent bytes."""

    server: int
    """Port of the server; it may change while the proxy runs."""
    breaks: list[int] = field(default_factory=list)
    """Numbers of bytes to the server after which the first, the second and further connections are cut."""
    rate: float = 0.0
    """Largest rate to the server in bytes per second; 0: no limit."""
    url: str = ""
    broken: int = 0
    carried: int = 0
    """Number of bytes sent to the server."""

    def carry(self, near: socket.socket) -> None:
        """Forwards the bytes of one connection until the connection ends."""
        try:
            far = socket.create_connection(("127.0.0.1", self.server), timeout=10)
        except OSError:
            near.close()
            return
        threading.Thread(target=_pass_on, args=(far, near), daemon=True).start()
        with suppress(OSError):
            while data := near.recv(_PIECE):
                if self.breaks and self.carried + len(data) >= self.breaks[0]:
                    far.sendall(data[: self.breaks[0] - self.carried])
                    self.carried = self.breaks.pop(0)
                    self.broken += 1
                    break
                far.sendall(data)
                self.carried += len(data)
                if self.rate:
                    time.sleep(len(data) / self.rate)
        for end in (near, far):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()


def _pass_on(source: socket.socket, target: socket.socket) -> None:
    with suppress(OSError):
        while data := source.recv(_PIECE):
            target.sendall(data)
    with suppress(OSError):
        target.shutdown(socket.SHUT_WR)


@contextmanager
def line_to(url: str, *breaks: int, rate: float = 0.0) -> Iterator[Line]:
    """Starts a proxy in front of the server at ``url``."""
    made = Line(urlsplit(url).port or 0, list(breaks), rate)
    with socket.create_server(("127.0.0.1", 0), backlog=64) as door:
        made.url = f"http://127.0.0.1:{door.getsockname()[1]}"

        def accept() -> None:
            with suppress(OSError):
                while True:
                    threading.Thread(target=made.carry, args=(door.accept()[0],), daemon=True).start()

        threading.Thread(target=accept, daemon=True).start()
        yield made
        door.shutdown(socket.SHUT_RDWR)
