"""Upload of files: the bytes that the server lacks are sent in pieces, and the upload continues after a broken
connection.
"""

import time
from collections.abc import Callable
from io import FileIO

import msgspec

from conoid.cases.figures import size
from conoid.cases.reading import whole

from ..errors import ClientError, MissingError, ServiceError, UnreachableError
from ..local.local_files import LocalFile
from .http import Http

_LARGEST, _SMALLEST = 1 << 20, 1 << 14
"""Smallest and largest size of a piece, bytes (chosen values: a proxy accepts requests of 1 MiB; at 1 kB/s a piece of
16 KiB arrives within the time limit)."""
_FIRST = 1 << 17
"""Size of the first piece, bytes, used before the speed of the connection is known (chosen value)."""
_WANTED = 2.0
"""Intended time for sending a piece, s; after a slower piece the next pieces are smaller (chosen value: a broken
connection loses at most one piece)."""
_PATIENCE = 60.0
"""Time without progress, s, after which the upload is given up (chosen value: a server restarts in less time)."""
_PAUSE = 0.5
"""Pause, s, after a broken connection before the client asks the server how many bytes have arrived."""
_LAST = 120.0
"""Time limit, s, for the answer to the last piece: the server then reads the whole file again and writes it to disk."""
_PASSING = frozenset({408, 500, 502, 503, 504})
"""HTTP statuses after which the same piece may be sent again."""


class SentFile(msgspec.Struct, kw_only=True, frozen=True):
    """State of an upload on the server. ``offset``: number of bytes that have arrived; ``whole``: True if the file
    is complete and verified.
    """

    offset: int
    whole: bool


def send(http: Http, file: LocalFile, say: Callable[[str], None] = lambda text: None) -> None:
    """Sends a file. On return the server has the file with the hash that was computed before. ``say`` is called with
    the progress. Raises ClientError if the file has changed, ServiceError, UnreachableError.
    """
    sent = _status(http, file)
    if sent is not None and sent.whole:
        return
    with whole.opened(file.path) as opened:
        file.check(opened.fileno())
        _Sending(http, file, opened, say).go_on(sent.offset if sent is not None else 0)


def _status(http: Http, file: LocalFile) -> SentFile | None:
    try:
        return http.get(SentFile, _place(file))
    except MissingError:
        return None


def _place(file: LocalFile) -> str:
    return f"/v1/files/{file.sha256}"


class _Sending:
    """The upload of one file."""

    def __init__(self, http: Http, file: LocalFile, opened: FileIO, say: Callable[[str], None]) -> None:
        self._http, self._file, self._opened, self._say = http, file, opened, say
        self._piece, self._again = min(_FIRST, _LARGEST), True

    def go_on(self, offset: int) -> None:
        """Sends piece after piece from the byte ``offset``. Waits and continues if the connection breaks or if
        another client sends the same file.
        """
        moved = time.monotonic()
        while True:
            self._say(f"sending {self._file.path.name}, {size(offset)} of {size(self._file.size)}")
            try:
                sent = self._sent(offset)
                if sent.whole:
                    return
            except (ServiceError, UnreachableError) as error:
                if not self._passes(error) or time.monotonic() - moved > _PATIENCE:
                    raise
                self._piece = max(_SMALLEST, self._piece // 2)
                time.sleep(_PAUSE)
                there = self._offset(offset)
            else:
                there = sent.offset
            if there is None:
                return
            if there > offset:
                moved = time.monotonic()
            offset = there

    def _sent(self, offset: int) -> SentFile:
        """Sends one piece, and adapts the size of the next piece to the time that this piece took."""
        self._opened.seek(offset)
        data = self._opened.read(min(self._piece, self._file.size - offset)) or b""
        end = offset + len(data)
        if end < self._file.size and not data:
            raise self._file.changed()
        span = f"{offset}-{end - 1}" if data else "*"
        headers = {"Content-Range": f"bytes {span}/{self._file.size}"} if self._file.size else {}
        began = time.monotonic()
        sent = self._http.put(SentFile, _place(self._file), data, headers, _LAST if end == self._file.size else 0.0)
        spent = time.monotonic() - began
        if spent > _WANTED:
            self._piece = max(_SMALLEST, self._piece // 2)
        elif spent < _WANTED / 4:
            self._piece = min(_LARGEST, self._piece * 2)
        return sent

    def _passes(self, error: ClientError) -> bool:
        """Returns True if the upload may continue after ``error``. Raises ClientError if the file has changed since
        its hash was computed.
        """
        if not isinstance(error, ServiceError):
            return isinstance(error, UnreachableError)
        code = error.problem.get("code")
        if code == "wrong_hash":
            self._file.check(self._opened.fileno())
            if not self._again:
                raise self._file.changed()
            self._again = False  # The bytes on the server may be damaged: start again once.
            return True
        return code in {"wrong_offset", "in_progress", "incomplete", "busy"} or error.status in _PASSING

    def _offset(self, known: int) -> int | None:
        """Returns the number of bytes that the server has; None if the server has the whole file; ``known`` if the
        server does not answer.
        """
        try:
            sent = _status(self._http, self._file)
        except (ServiceError, UnreachableError):
            return known
        return 0 if sent is None else None if sent.whole else sent.offset
