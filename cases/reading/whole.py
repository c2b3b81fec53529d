"""Reading and writing of complete files: atomic replacement, and safe opening of files that another user may have
placed."""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BytesIO, FileIO, TextIOWrapper
from pathlib import Path

MOST = 256 << 20
"""Largest size of a file that is read as a whole, bytes; a case, an outcome and a manifest have some MB at most (reason
of the chosen limit)."""
_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_AT_ONCE = getattr(os, "O_NONBLOCK", 0)
"""Flags of open(2) with which opening a pipe without a writer does not block."""
_NO_FILE = frozenset({errno.ELOOP, errno.ENXIO, errno.ENODEV, errno.EOPNOTSUPP})
"""Errors that open(2) reports for a link to itself, for a socket, and for a device without a driver."""


@contextmanager
def named(path: str | Path) -> Iterator[None]:
    """Adds ``path`` to an OSError of the ``with`` block that has no file name, because write(2) and fsync(2) do not set
    the name.
    """
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise


def write(path: Path, content: bytes, mode: int = 0o644) -> None:
    """Replaces a file atomically: writes a temporary file in the same folder, flushes it to disk, renames it; removes
    an incomplete temporary file. Raises OSError, also if the temporary name is a link.
    """
    beside = path.with_name(f"{path.name}.part")
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | _NO_LINK
    with named(path), open(os.open(beside, flags, mode), "wb") as file:
        try:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        except OSError:
            with suppress(OSError):
                beside.unlink()
            raise
    beside.rename(path)


def touch(path: Path) -> None:
    """Creates an empty file if the file does not exist. Raises OSError, also for a link; the target of the link is not
    changed.
    """
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | _NO_LINK | _AT_ONCE, 0o666))


def opened(path: str | Path, *, folder: int | None = None, links: bool = True) -> FileIO:
    """Opens a regular file for reading, unbuffered.

    ``folder``: descriptor of the directory to which ``path`` is relative; ``links``: whether the file may be a symbolic
    link. A pipe, a socket or a device could block the reader, or never end; each of them is refused like a directory,
    with IsADirectoryError. Raises OSError.
    """
    try:
        handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC | _AT_ONCE | (0 if links else _NO_LINK), dir_fd=folder)
    except OSError as error:
        raise (_no_file(path, "is not a regular file") if error.errno in _NO_FILE else error) from None
    return _regular(handle, path, "rb")


def appended(path: str | Path, mode: int = 0o666) -> FileIO:
    """Opens a regular file, unbuffered, for reading and appending; creates the file if it does not exist. Raises
    IsADirectoryError if the file is a pipe, a socket or a device; raises OSError.
    """
    try:
        handle = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | _AT_ONCE, mode)
    except OSError as error:
        raise (_no_file(path, "is not a regular file") if error.errno in _NO_FILE else error) from None
    return _regular(handle, path, "a+")


def _regular(handle: int, path: str | Path, mode: str) -> FileIO:
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise _no_file(path, "is not a regular file")
    return FileIO(handle, mode)


def read(path: str | Path, most: int = MOST, *, links: bool = True) -> bytes:
    """Returns the bytes of a regular file of at most ``most`` bytes; ``links``: whether the file may be a symbolic
    link.

    Raises IsADirectoryError if the file is not regular; raises OSError.
    """
    with opened(path, links=links) as file:
        left = _size(file, path, most)
        pieces = []
        while left > 0 and (piece := file.read(left)):
            pieces.append(piece)
            left -= len(piece)
    return b"".join(pieces)


def read_text(path: str | Path) -> str:
    """Returns the text of a file in UTF-8, with line feeds as line ends. Raises UnicodeDecodeError if the file is not
    UTF-8, and the errors of the function ``read``.
    """
    return TextIOWrapper(BytesIO(read(path)), encoding="utf-8").read()


def check(path: str | Path, most: int = MOST) -> None:
    """Raises the errors that the function ``read`` would raise."""
    with opened(path) as file:
        _size(file, path, most)


def _size(file: FileIO, path: str | Path, most: int) -> int:
    size = os.fstat(file.fileno()).st_size
    if size > most:
        raise _no_file(path, f"has more than {most} bytes")
    return size


def _no_file(path: str | Path, why: str) -> OSError:
    return IsADirectoryError(errno.EISDIR, why, str(path))
