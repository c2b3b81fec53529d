"""Connections of people who never finish what they say: each has its time, and all together have their number."""

import asyncio
import resource
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

HEADER = 10.0
"""s in which a request's header must arrive, from its first byte or from the opening of its connection. Chosen."""
_SHARE, _MOST = 4, 8192
"""One descriptor in so many may be a connection; the most connections at all. Chosen: the others are files."""
_FILES = 65_536
"""Descriptors that the server asks for. Chosen: more than it can use."""


def raise_limit() -> int:
    """Takes as many descriptors as the system gives; returns how many connections are let in at a time."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _FILES if hard == resource.RLIM_INFINITY else min(_FILES, hard)
    if soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    return min(_MOST, max(soft, wanted) // _SHARE)


class Connection(H11Protocol):
    """A connection that is closed when a header does not arrive in time, or is idle while others need its place."""

    most = _MOST
    """Connections at a time."""
    idle: dict["Connection", None] = {}  # noqa: RUF012
    """Those without a whole request, the oldest first."""
    _overdue: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Makes room when there is none."""
        super().connection_made(transport)
        self.idle[self] = None
        self._set_timer()
        if len(self.connections) > self.most:
            oldest = next(iter(self.idle))
            del self.idle[oldest]  # at once: of a crowd that comes in one turn of the loop each makes room for one more
            oldest.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Frees its place."""
        self.idle.pop(self, None)
        self._unset_timer()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """The time of a header begins with its first byte, and more bytes do not make it longer."""
        super().data_received(data)
        if self.cycle is not None and not self.cycle.response_complete:
            self.idle.pop(self, None)
            self._unset_timer()
        elif self._overdue is None:
            self._set_timer()

    def on_response_complete(self) -> None:
        """The connection may be used again, or closed for another one."""
        super().on_response_complete()
        if not self.transport.is_closing():
            self.idle[self] = None

    def _set_timer(self) -> None:
        self._overdue = self.loop.call_later(HEADER, self.transport.abort)

    def _unset_timer(self) -> None:
        if self._overdue is not None:
            self._overdue.cancel()
        self._overdue = None


def options() -> dict[str, Any]:
    """What uvicorn is told."""
    Connection.most = raise_limit()
    return {"http": Connection, "backlog": _MOST}
