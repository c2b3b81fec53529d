"""Download of whole files, or parts of files, from the folder of a run. No file outside the folder of the run is ever
sent.
"""

import base64
import hashlib
import os
import re
import stat
from collections.abc import AsyncIterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from ..errors import ServiceError, not_found
from ..requests.thread_pool import ThreadPool
from ..requests.user_limits import place_of
from .digests import Digests, State, state_of

_CHUNK = 1 << 18
"""Number of bytes that are read and sent at once; larger numbers were not faster (measured)."""
_SMALL = 1 << 20
"""Largest size in bytes of a file that is hashed before it is sent, without a task of its own: 1 ms of CPU time (chosen
value)."""
_RANGE = re.compile(r"bytes=(\d{0,18})-(\d{0,18})")
_TYPES = {
    ".json": "application/json", ".jsonl": "application/x-ndjson", ".toml": "application/toml",
    ".csv": "text/csv; charset=utf-8", ".log": "text/plain; charset=utf-8",
    ".series": "application/json", ".png": "image/png", ".vtkhdf": "application/x-hdf5",
}  # fmt: skip


@dataclass(frozen=True)
class Entry:
    """A file of a run. ``path``: path relative to the run's folder; ``modified``: Unix time of the last change of the
    file, s.
    """

    path: str
    size: int
    modified: float


def listing(folder: Path) -> list[Entry]:
    """Lists the regular files below ``folder``, sorted by path; links and hidden names are left out."""
    entries = []
    for here, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        for name in names:
            path = Path(here, name)
            with suppress(FileNotFoundError):
                status = path.lstat()
                if stat.S_ISREG(status.st_mode) and not name.startswith("."):
                    entries.append(Entry(str(path.relative_to(folder)), status.st_size, status.st_mtime))
    return sorted(entries, key=lambda entry: entry.path)


def open_inside(folder: Path, relative: str) -> BinaryIO:
    """Opens a regular file below ``folder``.

    Raises ServiceError with status 404 if the path is not a regular file below ``folder``. Each part of the path is
    opened relative to its parent folder, and links are not followed. Therefore neither ``..`` nor a link leads to a
    file outside of ``folder``, even if the link is created during the call.
    """
    parts = relative.split("/")
    if any(part in {"", ".", ".."} or part.startswith(".") or "\0" in part for part in parts):
        raise not_found(f"file {relative[:200]!r}")
    try:
        descriptor = _walk(folder, parts)
    except OSError:
        raise not_found(f"file {relative[:200]!r}") from None
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise not_found(f"file {relative[:200]!r}")
    return os.fdopen(descriptor, "rb")


def _walk(folder: Path, parts: list[str]) -> int:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    for part in parts:
        try:
            inner = os.open(part, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=descriptor)
        finally:
            os.close(descriptor)
        descriptor = inner
    return descriptor


class Downloads:
    """Sends files of runs as HTTP answers. The class is used only in the thread of the event loop."""

    def __init__(self, pool: ThreadPool) -> None:
        """Creates the object. ``pool``: pool of threads that read files; it limits the threads of each user."""
        self._pool, self._digests = pool, Digests(pool)

    async def respond(self, request: Request, folder: Path, relative: str, ended: bool) -> Response:
        """Sends the present content of a file; handles the headers Range, If-Range and If-None-Match.

        The header Repr-Digest contains the sha256 of the file; the header is omitted for a large file of a run that has
        not ended, because the file may grow faster than the server can hash it. A growing file is sent up to its size
        at the time of the request. Raises ServiceError with status 404, 416, 429 or 503.
        """
        file, state = await self._pool.run(_opened, folder, relative)
        try:
            size = state[-1]
            if size > _SMALL:
                place_of(request).lengthen()
            headers = {
                "Accept-Ranges": "bytes",
                "Cache-Control": "private, no-cache",
                "X-Content-Type-Options": "nosniff",
                "Content-Type": _TYPES.get(Path(relative).suffix, "application/octet-stream"),
            }
            tag = hashlib.sha256(repr(state).encode()).digest()
            if ended or size <= _SMALL:
                tag = await self._digests.of(file, state)
                headers["Repr-Digest"] = f"sha-256=:{base64.b64encode(tag).decode()}:"
            etag = headers["ETag"] = f'"{tag.hex()[:32]}"'
            if is_known(etag, request.headers.get("if-none-match", "")):
                file.close()
                return Response(status_code=304, headers=headers)
            begin, end, status = _part(request, size, etag)
            if status == 206:
                headers["Content-Range"] = f"bytes {begin}-{end - 1}/{size}"
            return _FileResponse(self._pool, file, begin, end, status, headers)
        except BaseException:
            file.close()
            raise

    async def whole(
        self, request: Request, folder: Path, relative: str, size: int, headers: Mapping[str, str], media_type: str
    ) -> Response:
        """Sends a file of ``size`` bytes that never changes, with the additional ``headers``. Raises ServiceError with
        status 404 if the file is missing or has another size, because a browser would cache a damaged file; raises
        ServiceError with status 429 or 503 if the server is busy.
        """
        file, state = await self._pool.run(_opened, folder, relative)
        try:
            if state[-1] != size:
                raise ServiceError(404, "damaged", f"{relative} has {state[-1]} bytes, and had {size} when it was made")
            if state[-1] > _SMALL:
                place_of(request).lengthen()
            return _FileResponse(self._pool, file, 0, state[-1], 200, {**headers, "Content-Type": media_type})
        except BaseException:
            file.close()
            raise


def _opened(folder: Path, relative: str) -> tuple[BinaryIO, State]:
    file = open_inside(folder, relative)
    return file, state_of(file)


def is_known(etag: str, text: str) -> bool:
    """Whether the header If-None-Match contains this ETag or ``*``. A proxy may have changed a strong ETag to a weak
    one; a weak ETag therefore counts as equal to the strong one.
    """
    known = {tag.strip().removeprefix("W/") for tag in text.split(",")}
    return etag in known or known == {"*"}


def tagged(body: bytes, known: str) -> Response:
    """Returns the JSON body with an ETag; returns status 304 if the client already has this ETag."""
    etag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
    headers = {"ETag": etag, "Cache-Control": "private, no-cache"}
    if is_known(etag, known):
        return Response(status_code=304, headers=headers)
    return Response(body, headers=headers, media_type="application/json")


def _part(request: Request, size: int, etag: str) -> tuple[int, int, int]:
    """Returns the first byte of the requested part, the byte after its end, and the HTTP status of the answer. If
    several parts are requested, the whole file is sent.
    """
    match = _RANGE.fullmatch(request.headers.get("range", "").replace(" ", ""))
    if match is None or match[0] == "bytes=-" or request.headers.get("if-range", etag) != etag:
        return 0, size, 200
    if not match[1]:
        begin, end = max(0, size - int(match[2])), size
    else:
        begin, end = int(match[1]), min(size, int(match[2]) + 1) if match[2] else size
    if begin >= end:
        headers = {"Content-Range": f"bytes */{size}"}
        raise ServiceError(416, "bad_range", f"Range {match[0]!r}: the file has {size} bytes", headers=headers)
    return begin, end, 206


class _FileResponse(StreamingResponse):
    """HTTP answer with a part of an open file. The file is closed at the end, even if the client disconnects."""

    def __init__(
        self, pool: ThreadPool, file: BinaryIO, begin: int, end: int, status: int, headers: Mapping[str, str]
    ) -> None:
        super().__init__(_chunks(pool, file, begin, end), status, {**headers, "Content-Length": str(end - begin)})
        self._file = file

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._file.close()


async def _chunks(pool: ThreadPool, file: BinaryIO, begin: int, end: int) -> AsyncIterator[bytes]:
    while begin < end and (chunk := await pool.run(os.pread, file.fileno(), min(_CHUNK, end - begin), begin)):
        begin += len(chunk)
        yield chunk
