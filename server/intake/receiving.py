"""Receiving of uploaded files: writes the bytes to disk from the first missing byte on, and verifies the SHA-256 hash.

A PUT with ``Content-Range: bytes FIRST-LAST/SIZE`` is a partial PUT of RFC 9110, 14.5. An interrupted transfer
continues after the stored bytes. The header ``Upload-Offset`` (draft-ietf-httpbis-resumable-upload) of HEAD and of
every answer gives their number. A PUT without the header ``Content-Range`` sends the whole file. Stored bytes of an
incomplete file are kept if the connection breaks or the server is killed.
"""

import asyncio
import hashlib
import re
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field

from starlette.requests import ClientDisconnect, Request

from ..errors import ServiceError
from ..requests.limits import check_encoding
from ..requests.thread_pool import ThreadPool
from ..requests.user_limits import place_of
from .uploads import Part, Upload, Uploads

_RANGE = re.compile(r"bytes (?:(\d{1,18})-(\d{1,18})|\*)/(\d{1,18})")
_GATHERED = 1 << 18
"""Number of bytes that are collected before they are written; larger numbers were not faster (measured)."""
_SLICE = 1 << 25
"""Number of bytes that one task hashes, in 0.1 s; other requests of the user are handled between two tasks (chosen
value)."""
_SILENCE = 30.0
"""Time in s within which the next piece of an upload must arrive, the limit of all request bodies (chosen value)."""
_STALLED = 5.0
"""Time in s without new bytes after which another connection may continue the upload; the first connection is probably
broken (chosen value)."""


@dataclass(frozen=True)
class Span:
    """Byte range of a file of ``total`` bytes, from ``first`` to ``end`` (exclusive). ``anew``: whether the request
    body replaces all stored bytes.
    """

    first: int
    end: int
    total: int
    anew: bool = False


@dataclass
class _Transfer:
    """A connection that sends bytes of a file."""

    received: float = field(default_factory=time.monotonic)
    given_up: bool = False
    busy: bool = False
    """Whether all bytes have arrived and are being verified."""
    over: asyncio.Event = field(default_factory=asyncio.Event)
    patience: asyncio.Timeout | None = None

    def give_up(self) -> None:
        """Stops this transfer at once, because another connection continues the upload."""
        self.given_up = True
        if self.patience is not None:
            with suppress(RuntimeError):  # the transfer then stops waiting for its request body
                self.patience.reschedule(0.0)


class Receiver:
    """Receives uploaded files. The class is used in the thread of the event loop; threads of the user write the
    files.
    """

    def __init__(self, sent: Uploads, pool: ThreadPool) -> None:
        """Creates the object without transfers."""
        self._sent, self._pool = sent, pool
        self._open: dict[tuple[str, str], _Transfer] = {}

    async def receive(
        self, request: Request, owner: str, sha256: str, check: Callable[[], Awaitable[None]]
    ) -> tuple[Upload, bool]:
        """Receives the request body. Returns the stored file, and whether this request has completed it. ``check``
        raises an error if the token is no longer valid. Raises ServiceError with status 400, 408, 409, 411, 413, 415,
        422, 429, 503 or 507.
        """
        span = span_of(request)
        place_of(request).lengthen()
        transfer = await self._begun(owner, sha256)
        try:
            part = await self._pool.run(self._opened, owner, sha256, span)
            if isinstance(part, Upload):
                return part, False
            await self._taken(request, transfer, part, check)
            if part.offset < span.end:
                raise ServiceError(400, "incomplete", f"the request body ended at byte {part.offset}", retryable=True)
            if part.offset < span.total:
                return Upload(sha256, span.total, part.offset, False, time.time()), False
            transfer.busy = True
            await self._verify(owner, sha256, part)
            return Upload(sha256, span.total, span.total, True, time.time()), True
        except OSError as error:
            detail = f"the file cannot be stored: {error.strerror}"
            raise ServiceError(507, "storage", detail, retryable=True) from error
        finally:
            del self._open[owner, sha256]
            transfer.over.set()

    async def _begun(self, owner: str, sha256: str) -> _Transfer:
        """Registers a connection as the only one that sends bytes of the file. Raises ServiceError with status 409 if
        another connection is sending bytes of the file.
        """
        while (other := self._open.get((owner, sha256))) is not None:
            if other.busy or time.monotonic() - other.received < _STALLED:
                raise _in_progress()
            other.give_up()
            await other.over.wait()
        made = self._open[owner, sha256] = _Transfer()
        return made

    def _opened(self, owner: str, sha256: str, span: Span) -> Part | Upload:
        """Returns the incomplete file, opened at the first byte of the request body; if the file is already complete,
        returns the complete file. Raises ServiceError with status 409, 413, 429 or 507; raises OSError.
        """
        known = self._sent.find(owner, sha256)
        if known is not None and known.whole:
            return known
        return self._sent.begin(owner, sha256, span.total, None if span.anew else span.first)

    async def _taken(
        self, request: Request, transfer: _Transfer, part: Part, check: Callable[[], Awaitable[None]]
    ) -> None:
        """Writes the request body to disk as it arrives. Bytes that were written are kept after any error. Raises
        ServiceError with status 400, 401, 408 or 409, OSError, and the errors of ``check``.
        """
        gathered, chunks = bytearray(), aiter(request.stream())
        try:
            while not transfer.given_up and (chunk := await _next(chunks, transfer)) is not None:
                gathered += chunk
                transfer.received = time.monotonic()
                if len(gathered) >= _GATHERED:
                    await self._pool.run(part.write, bytes(gathered))
                    gathered.clear()
                    await check()
        finally:
            if gathered:
                await self._pool.run(part.write, bytes(gathered))

    async def _verify(self, owner: str, sha256: str, part: Part) -> None:
        """Verifies the hash of the file, gives the file its final name, and flushes it to disk. If the hash differs,
        removes the file and raises ServiceError with status 422.
        """
        total, offset = hashlib.sha256(), 0
        while offset < part.size:
            offset = await self._pool.run(_hashed, total, part, offset)
        if total.hexdigest() != sha256:
            await self._pool.run(self._sent.remove, owner, sha256)
            detail = f"the bytes that have arrived have the sha256 {total.hexdigest()}; the bytes are removed"
            raise ServiceError(422, "wrong_hash", detail, pointer="sha256")
        await self._pool.run(self._sent.finish, owner, part)


async def _next(chunks: AsyncIterator[bytes], transfer: _Transfer) -> bytes | None:
    """Returns the next piece of a request body; None at the end of the body. Raises ServiceError with status 400, 408
    or 409.
    """
    try:
        async with asyncio.timeout(_SILENCE) as transfer.patience:
            return await anext(chunks, None)
    except TimeoutError:
        if transfer.given_up:
            raise _in_progress() from None
        detail = f"no part of the request body has arrived for {_SILENCE:g} s"
        raise ServiceError(408, "timeout", detail, retryable=True) from None
    except ClientDisconnect:
        raise ServiceError(400, "incomplete", "the request body was interrupted", retryable=True) from None


def _in_progress() -> ServiceError:
    detail = "another connection brings this file"
    return ServiceError(409, "in_progress", detail, retryable=True, headers={"Retry-After": "1"})


def _hashed(total: "hashlib._Hash", part: Part, offset: int) -> int:
    """Adds the next slice of the file to the hash; returns the end of the slice. Raises OSError if the file cannot be
    read.
    """
    end = min(part.size, offset + _SLICE)
    while offset < end:
        data = part.read(min(_GATHERED, end - offset), offset)
        if not data:
            raise OSError(5, "the file has become shorter")
        total.update(data)
        offset += len(data)
    return offset


def span_of(request: Request) -> Span:
    """Returns the range of bytes of a PUT request, from its headers. Raises ServiceError with status 400, 411 or
    415.
    """
    check_encoding(request)
    length, content_range = request.headers.get("content-length", ""), request.headers.get("content-range")
    if not length.isdecimal():
        raise ServiceError(411, "length_required", "an upload needs a Content-Length", pointer="Content-Length")
    if content_range is None:
        return Span(0, int(length), int(length), anew=True)
    match = _RANGE.fullmatch(content_range)
    if match is None:
        detail = f"Content-Range {content_range[:80]!r}: write bytes FIRST-LAST/SIZE"
        raise ServiceError(400, "bad_range", detail, pointer="Content-Range")
    total = int(match[3])
    first, end = (total, total) if match[1] is None else (int(match[1]), int(match[2]) + 1)
    if not first <= end <= total or end - first != int(length):
        detail = f"Content-Range {content_range[:80]!r} does not fit Content-Length {int(length)}"
        raise ServiceError(400, "bad_range", detail, pointer="Content-Range")
    return Span(first, end, total)
