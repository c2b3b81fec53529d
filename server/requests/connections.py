"""Protection against slow clients: time limits for the headers of requests and for answers that are not read, and a
largest number of connections.
"""

import asyncio
import resource
import socket
from collections import Counter
from itertools import islice
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

BODY = 1 << 20
"""Largest size of a request body, bytes (module ``limits``)."""
HEADER = 10.0
"""Time in s within which the header of a request must arrive (chosen value). The time begins with the first byte of the
header, or with the connection."""
_PIECES, _PAUSE = 4, 0.5
"""Number of pieces of a header that are parsed when they arrive, and time in s between two parses of later pieces
(chosen values). A normal client sends its header in one piece. A parse takes 0.1 ms of the event loop."""
READ = 30.0
"""Time in s within which a client must read a part of an answer that is ready to be sent (chosen value). A client that
does not read for longer, such as a sleeping laptop, can repeat its request."""
_SHARE, _MOST = 4, 8192
"""Number of file descriptors per connection, and largest number of connections (chosen values). The other descriptors
are for files."""
_FILES = 65_536
"""Number of file descriptors that the server requests from the operating system (chosen value); it does not need so
many."""
_SOME = 64
"""Number of idle connections, the oldest ones, among which the server selects the one to close; this takes 0.1 ms
(chosen value)."""
_ACCEPTED = 4
"""Number of connections that asyncio accepts in one turn of the event loop; this takes 0.5 ms (chosen value)."""
_FULL = b"HTTP/1.1 503 Service Unavailable\r\nRetry-After: 5\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"


def raise_limit() -> int:
    """Raises the limit of file descriptors as far as the system allows; returns the largest number of connections that
    this permits.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _FILES if hard == resource.RLIM_INFINITY else min(_FILES, hard)
    if soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    return min(_MOST, max(soft, wanted) // _SHARE)


class Connection(H11Protocol):
    """An HTTP connection. The server closes it if the header of a request is late, if the client does not read its
    answer, or if it is idle and a new connection needs its place.
    """

    most = _MOST
    """Largest number of open connections."""
    idle: dict["Connection", None] = {}  # noqa: RUF012
    """Connections without a complete request, oldest first."""
    owner = ""
    """User of the token of the last request; without a token, the network address of the client."""
    _overdue: asyncio.TimerHandle | None = None
    _unread: asyncio.TimerHandle | None = None
    _pieces = 0
    """Number of pieces in which the present header has arrived."""
    _useless = 0
    """Number of bytes of a request body that have arrived after its answer."""
    _left = 0
    """Number of bytes that waited to be sent when they were last checked."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Closes an idle connection when the limit of connections is reached."""
        super().connection_made(transport)
        self.app_state = {**self.app_state, "connection": self}
        self.idle[self] = None
        self._set_timer()
        if len(self.connections) > self.most:
            self._make_room()

    def _make_room(self) -> None:
        """Closes one of the oldest idle connections: one without a token, otherwise one of the user with the most
        connections.
        """
        some = list(islice(self.idle, _SOME))
        counts = Counter(one.who for one in some)
        oldest = max(some, key=lambda one: (one is not self, not one.owner, counts[one.who]))
        del self.idle[
            oldest
        ]  # at once, because each of several connections accepted in one turn of the loop must close another one
        if oldest is self:
            self.transport.write(_FULL)
            self.transport.close()
        else:
            oldest.transport.abort()

    @property
    def who(self) -> str:
        """Returns the user of the connection; without a user, the network address of the client."""
        return self.owner or (self.client[0] if self.client else "")

    def connection_lost(self, exc: Exception | None) -> None:
        """Removes the connection from the number of open connections."""
        self.idle.pop(self, None)
        self._unset_timer()
        self._look_no_more()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Handles received bytes. The time limit of a header begins with its first byte; later bytes do not extend it.
        A header that arrives in many pieces is parsed at intervals. After the answer, the server reads at most ``BODY``
        more bytes of the request body.
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
        """Marks the connection as idle after the request is complete. The server may close an idle connection to make
        room for a new one.
        """
        super().on_response_complete()
        if not self.transport.is_closing():
            self.idle[self] = None

    def pause_writing(self) -> None:
        """Starts the time limit for reading the answer; asyncio calls this method when the client reads more slowly
        than the server sends.
        """
        super().pause_writing()
        self._left = self.transport.get_write_buffer_size()
        self._unread = self.loop.call_later(READ, self._look)

    def resume_writing(self) -> None:
        """Ends the time limit for reading the answer; asyncio calls this method when the client has read enough."""
        super().resume_writing()
        self._look_no_more()

    def _look(self) -> None:
        """Closes a connection whose client has read nothing since the previous check."""
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
    """Returns the options of uvicorn."""
    Connection.most = raise_limit()
    return {"http": Connection, "backlog": _ACCEPTED}


def queue(listener: socket.socket) -> None:
    """Sets the backlog of the socket to the largest number of open connections; the default of uvicorn would be
    ``_ACCEPTED``.
    """
    listener.listen(_MOST)
