"""Writing that survives a power cut: data first, then its name, then the folder that holds the name."""

import os
import shutil
from pathlib import Path

from conoid.cases.reading import whole

_PROBE = 1 << 16
"""Bytes that are written to find out whether a folder takes any: more than a launch writes. Chosen."""


def write(path: Path, content: bytes, mode: int = 0o600) -> None:
    """Puts ``content`` at ``path`` whole or not at all: a temporary name, fsync, rename, fsync of the folder."""
    beside = path.with_name(f".{path.name}.new")
    with whole.named(path), open(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, mode), "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)
    sync_folder(path.parent)


def probe(folder: Path) -> None:
    """Raises OSError when nothing can be written in ``folder`` now: it is gone, full, or no descriptor is left."""
    path = folder / ".probe"
    with whole.named(path), open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
        file.write(bytes(_PROBE))
        file.flush()
        os.fsync(file.fileno())
    path.unlink()


def write_new(path: Path, content: bytes) -> None:
    """A file in a folder that no process reads yet; the caller syncs the folder. Raises FileExistsError."""
    with whole.named(path), open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def copy(source: Path, target: Path) -> None:
    """A new file with the bytes of a regular one; the caller syncs the folder. Raises OSError."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    with whole.named(target), whole.opened(source) as file, open(os.open(target, flags, 0o400), "wb") as made:
        shutil.copyfileobj(file, made, 1 << 20)
        made.flush()
        os.fsync(made.fileno())


def sync_folder(folder: Path) -> None:
    """Makes the names in ``folder`` durable."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with whole.named(folder):
            os.fsync(descriptor)
    finally:
        os.close(descriptor)
