"""Connections of people who never finish what they say, or never read: each has its time, and all have their number."""

import asyncio
import resource
import socket
from collections import Counter
from itertools import islice
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

BODY = 1 << 20
"""Bytes of the largest body (``limits``)."""
HEADER = 10.0
"""s in which a request's header must arrive, from its first byte or from the opening of its connection. Chosen."""
_PIECES, _PAUSE = 4, 0.5
"""Pieces of a header that are read as they arrive; s between two further ones. Chosen: a client sends its header in one
piece, and each piece that is read takes 0.1 ms of the event loop.
"""
READ = 30.0
"""s in which a client must read something of an answer that waits to be sent. Chosen: a laptop sleeps longer, and asks
again."""
_SHARE, _MOST = 4, 8192
"""One descriptor in so many may be a connection; the most connections at all. Chosen: the others are files."""
_FILES = 65_536
"""Descriptors that the server asks for. Chosen: more than it can use."""
_SOME = 64
"""Idle connections among which the one is chosen that makes room. Chosen: 0.1 ms."""
_ACCEPTED = 4
"""Connections that asyncio accepts in one turn of the event loop. Chosen: 0.5 ms."""
_FULL = b"HTTP/1.1 503 Service Unavailable\r\nRetry-After: 5\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"


def raise_limit() -> int:
    """Takes as many descriptors as the system gives; returns how many connections are let in at a time."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _FILES if hard == resource.RLIM_INFINITY else min(_FILES, hard)
    if soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    return min(_MOST, max(soft, wanted) // _SHARE)


class Connection(H11Protocol):
    """A connection that is closed when a header does not arrive in time, when nobody reads its answers, or when it is
    idle while others need its place.
    """

    most = _MOST
    """Connections at a time."""
    idle: dict["Connection", None] = {}  # noqa: RUF012
    """Those without a whole request, the oldest first."""
    owner = ""
    """Whose token the last request has shown."""
    _overdue: asyncio.TimerHandle | None = None
    _unread: asyncio.TimerHandle | None = None
    _pieces = 0
    """Of the header that has not arrived."""
    _useless = 0
    """Bytes of bodies that were answered before their end."""
    _left = 0
    """Bytes that waited to be sent at the last look."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Makes room when there is none."""
        super().connection_made(transport)
        self.app_state = {**self.app_state, "connection": self}
        self.idle[self] = None
        self._set_timer()
        if len(self.connections) > self.most:
            self._make_room()

    def _make_room(self) -> None:
        """Of the oldest idle connections one goes that shows no token, else one of the user who has most of them."""
        some = list(islice(self.idle, _SOME))
        crowd = Counter(one.who for one in some)
        oldest = max(some, key=lambda one: (one is not self, not one.owner, crowd[one.who]))
        del self.idle[oldest]  # at once: of a crowd that comes in one turn of the loop each makes room for one more
        if oldest is self:
            self.transport.write(_FULL)
            self.transport.close()
        else:
            oldest.transport.abort()

    @property
    def who(self) -> str:
        """A user, or an address."""
        return self.owner or (self.client[0] if self.client else "")

    def connection_lost(self, exc: Exception | None) -> None:
        """Frees its place."""
        self.idle.pop(self, None)
        self._unset_timer()
        self._look_no_more()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """The time of a header begins with its first byte, and more bytes do not make it longer; one that comes in many
        pieces is read slowly. Of a body that was answered before its end no more is read than a body may have.
        """
        if self.conn.our_state is h11.DONE and self.conn.their_state is h11.SEND_BODY:
            self._useless += len(data)
            if self._useless > BODY:
                self.transport.close()
                return
        super().data_received(data)
        if self.cycle is not None and not self.cycle.response_complete:
            self.idle.pop(self, None)
            self._unset_timer()
            self._pieces = 0
        else:
            self._wait_for_header()

    def _wait_for_header(self) -> None:
        if self._overdue is None:
            self._set_timer()
        self._pieces += self.conn.their_state is h11.IDLE
        if self._pieces > _PIECES and not self.transport.is_closing():
            self.transport.pause_reading()
            self.loop.call_later(_PAUSE, self._read_on)

    def _read_on(self) -> None:
        if not self.transport.is_closing():
            self.transport.resume_reading()

    def on_response_complete(self) -> None:
        """The connection may be used again, or closed for another one."""
        super().on_response_complete()
        if not self.transport.is_closing():
            self.idle[self] = None

    def pause_writing(self) -> None:
        """The client does not read as fast as is sent."""
        super().pause_writing()
        self._left = self.transport.get_write_buffer_size()
        self._unread = self.loop.call_later(READ, self._look)

    def resume_writing(self) -> None:
        """It has read."""
        super().resume_writing()
        self._look_no_more()

    def _look(self) -> None:
        """Closes a connection of which nothing has been read since the last look."""
        left = self.transport.get_write_buffer_size()
        if left >= self._left:
            self.transport.abort()
        else:
            self._left, self._unread = left, self.loop.call_later(READ, self._look)

    def _look_no_more(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
        self._unread = None

    def _set_timer(self) -> None:
        self._overdue = self.loop.call_later(HEADER, self.transport.abort)

    def _unset_timer(self) -> None:
        if self._overdue is not None:
            self._overdue.cancel()
        self._overdue = None


def options() -> dict[str, Any]:
    """What uvicorn is told."""
    Connection.most = raise_limit()
    return {"http": Connection, "backlog": _ACCEPTED}


def queue(listener: socket.socket) -> None:
    """The system keeps as many connections that are not accepted as may be open. uvicorn has given it ``_ACCEPTED``."""
    listener.listen(_MOST)
