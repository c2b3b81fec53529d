"""Sends a file of a run's folder, whole or in part, and nothing outside of it."""

import base64
import hashlib
import os
import re
import stat
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from .errors import ServiceError, not_found

_CHUNK = 1 << 18
"""Bytes that are read and sent at once. Chosen: larger ones are not faster."""
_DIGESTS = 10_000
"""Digests of files that are kept, 32 bytes each. Chosen."""
_digests: dict[tuple[int, int, int, int], bytes] = {}
_RANGE = re.compile(r"bytes=(\d{0,18})-(\d{0,18})")
_TYPES = {
    ".json": "application/json", ".jsonl": "application/x-ndjson", ".toml": "application/toml",
    ".csv": "text/csv; charset=utf-8", ".log": "text/plain; charset=utf-8",
    ".series": "application/json", ".png": "image/png", ".vtkhdf": "application/x-hdf5",
}  # fmt: skip


@dataclass(frozen=True)
class Entry:
    """A file of a run, with its path relative to the run's folder; ``modified`` in Unix s."""

    path: str
    size: int
    modified: float


def listing(folder: Path) -> list[Entry]:
    """Every regular file below ``folder``, by path; links and hidden names are left out."""
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
    """Opens a regular file below ``folder``. Raises ServiceError 404 for everything else.

    Each step of the path is opened from the one before without following links, so that neither ``..`` nor a link,
    not even one put there at this moment, leads outside.
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


def respond(request: Request, folder: Path, relative: str) -> Response:
    """The file as it is now, honouring Range, If-Range and If-None-Match; its sha256 stands in Repr-Digest.

    A file that is still growing is sent up to its size at this moment. Raises ServiceError 404, 416.
    """
    file = open_inside(folder, relative)
    try:
        size, etag, digest = _identify(file)
        headers = {
            "ETag": etag,
            "Accept-Ranges": "bytes",
            "Repr-Digest": f"sha-256=:{base64.b64encode(digest).decode()}:",
            "Cache-Control": "private, no-cache",
            "X-Content-Type-Options": "nosniff",
            "Content-Type": _TYPES.get(Path(relative).suffix, "application/octet-stream"),
        }
        if is_known(etag, request.headers.get("if-none-match", "")):
            file.close()
            return Response(status_code=304, headers=headers)
        begin, end, status = _part(request, size, etag)
        if status == 206:
            headers["Content-Range"] = f"bytes {begin}-{end - 1}/{size}"
        headers["Content-Length"] = str(end - begin)
        if request.method == "HEAD":
            file.close()
            return Response(status_code=status, headers=headers)
        return _FileResponse(file, begin, end, status, headers)
    except BaseException:
        file.close()
        raise


def is_known(etag: str, text: str) -> bool:
    """Whether an If-None-Match has this ETag, or all there are; one that a proxy has made weak counts as well."""
    known = {tag.strip().removeprefix("W/") for tag in text.split(",")}
    return etag in known or known == {"*"}


def _part(request: Request, size: int, etag: str) -> tuple[int, int, int]:
    """First byte, end and status of the answer; several ranges at once are answered with the whole file."""
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
    """A part of an open file; closes it, also when the client leaves in the middle."""

    def __init__(self, file: BinaryIO, begin: int, end: int, status: int, headers: dict[str, str]) -> None:
        super().__init__(_chunks(file, begin, end), status, headers)
        self._file = file

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._file.close()


def _chunks(file: BinaryIO, begin: int, end: int) -> Iterator[bytes]:
    file.seek(begin)
    while begin < end and (chunk := file.read(min(_CHUNK, end - begin))):
        begin += len(chunk)
        yield chunk


def _identify(file: BinaryIO) -> tuple[int, str, bytes]:
    """Size, ETag and sha256 of an open file. The digest is computed once for each state of the file."""
    status = os.fstat(file.fileno())
    state = (status.st_dev, status.st_ino, status.st_mtime_ns, status.st_size)
    digest = _digests.get(state)
    if digest is None:
        digest = _digest(file, status.st_size)
        if len(_digests) >= _DIGESTS:
            _digests.clear()
        _digests[state] = digest
    return status.st_size, f'"{digest.hex()[:32]}"', digest


def _digest(file: BinaryIO, size: int) -> bytes:
    total = hashlib.sha256()
    while size and (chunk := file.read(min(_CHUNK, size))):
        total.update(chunk)
        size -= len(chunk)
    return total.digest()
