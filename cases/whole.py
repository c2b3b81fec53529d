"""Files that are there whole or not at all, and files that somebody else may have put there."""

import errno
import os
import stat
from pathlib import Path

_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_AT_ONCE = getattr(os, "O_NONBLOCK", 0)
"""A pipe that nobody writes to is opened without waiting."""


def write(path: Path, content: bytes, mode: int = 0o644) -> None:
    """Written beside, flushed to disk, renamed. Raises OSError, also where a link lies beside."""
    beside = path.with_name(f"{path.name}.part")
    with open(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | _NO_LINK, mode), "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    beside.rename(path)


def touch(path: Path) -> None:
    """An empty file, where there is none. Raises OSError, also for a link, whose target is left alone."""
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | _NO_LINK | _AT_ONCE, 0o666))


def read(path: Path) -> bytes:
    """The bytes of a plain file. Raises OSError, also for a pipe or a device, which could keep one waiting."""
    with open(os.open(path, os.O_RDONLY | _AT_ONCE), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(errno.EINVAL, "not a plain file", str(path))
        return file.read()
