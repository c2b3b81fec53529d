"""Reading and writing of whole files: files are replaced atomically, and files that another user may have placed are
opened safely.
"""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BytesIO, FileIO, TextIOWrapper
from pathlib import Path

MOST = 256 << 20
"""Largest size of a file that is read as a whole, bytes; a case, an outcome or a manifest has some MB at most (reason
of the chosen value)."""
_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_AT_ONCE = getattr(os, "O_NONBLOCK", 0)
"""Flag of open(2) with which the call does not wait if a pipe has no writer."""
_NO_FILE = frozenset({errno.ELOOP, errno.ENXIO, errno.ENODEV, errno.EOPNOTSUPP})
"""Error numbers of open(2) for a symbolic link, for a socket, and for a device without a driver."""


@contextmanager
def named(path: str | Path) -> Iterator[None]:
    """Adds the file name ``path`` to an OSError of the ``with`` block that has none: write(2) and fsync(2) do not set
    it.
    """
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise


def write(path: Path, content: bytes, mode: int = 0o644) -> None:
    """Replaces a file atomically: writes a temporary file in the same folder, flushes it to disk and renames it. If
    this fails, the temporary file is removed. Raises OSError, also if the temporary file would be a symbolic link.
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
    """Creates an empty file if there is none at ``path``. Raises OSError, also if ``path`` is a symbolic link; its
    target stays unchanged.
    """
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | _NO_LINK | _AT_ONCE, 0o666))


def opened(path: str | Path, *, folder: int | None = None, links: bool = True) -> FileIO:
    """Opens a regular file for reading, unbuffered.

    ``folder``: descriptor of the directory to which ``path`` is relative; ``links``: whether the file may be a symbolic
    link. Pipes, sockets and devices are refused with IsADirectoryError, because reading them could wait or never end.
    Raises OSError.
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
    """Returns the bytes of a regular file of at most ``most`` bytes. ``links``: whether the file may be a symbolic
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
    """Raises the error that the function ``read`` would raise for this file, without reading it."""
    with opened(path) as file:
        _size(file, path, most)


def _size(file: FileIO, path: str | Path, most: int) -> int:
    size = os.fstat(file.fileno()).st_size
    if size > most:
        raise _no_file(path, f"has more than {most} bytes")
    return size


def _no_file(path: str | Path, why: str) -> OSError:
    return IsADirectoryError(errno.EISDIR, why, str(path))
