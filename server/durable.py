"""Writing of files so that they survive a power failure: the data is flushed to disk, then the file gets its name, then
the folder is flushed.
"""

import os
import shutil
from pathlib import Path

from conoid.cases.reading import whole

_PROBE = 1 << 16
"""Number of bytes that a test writes to find out whether a folder can be written (chosen value)."""


def write(path: Path, content: bytes, mode: int = 0o600) -> None:
    """Writes ``content`` to ``path`` completely or not at all: writes a temporary file, calls fsync, renames the file,
    and calls fsync for the folder.
    """
    beside = path.with_name(f".{path.name}.new")
    with whole.named(path), open(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, mode), "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)
    sync_folder(path.parent)


def probe(folder: Path) -> None:
    """Raises OSError if nothing can be written in ``folder`` now: the folder is missing, the disk is full, or no
    file descriptor is free."""
    path = folder / ".probe"
    with whole.named(path), open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
        file.write(bytes(_PROBE))
        file.flush()
        os.fsync(file.fileno())
    path.unlink()


def write_new(path: Path, content: bytes) -> None:
    """Creates a file in a folder that no process reads yet. The caller must flush the folder to disk. Raises
    FileExistsError if the file exists.
    """
    with whole.named(path), open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def copy(source: Path, target: Path) -> None:
    """Creates a file with the bytes of another file, which is a regular file. The caller must flush the folder to disk.
    Raises OSError if the file cannot be copied.
    """
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    with whole.named(target), whole.opened(source) as file, open(os.open(target, flags, 0o400), "wb") as made:
        shutil.copyfileobj(file, made, 1 << 20)
        made.flush()
        os.fsync(made.fileno())


def sync_folder(folder: Path) -> None:
    """Calls fsync for ``folder``, which flushes the names of its files to disk."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with whole.named(folder):
            os.fsync(descriptor)
    finally:
        os.close(descriptor)
