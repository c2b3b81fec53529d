"""HDF5 files on disks that may be full: the library itself is not told of it.

Where a write fails, HDF5 goes on with what it could not put down: it fails again at each object that is let go, where
Python can only print that, and ends in a segmentation fault; or a file is taken for whole of which a part is missing.
"""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py


@contextmanager
def created(path: Path) -> Iterator["h5py.File"]:
    """A new HDF5 file, flushed to disk at the end. Raises OSError with the name of the file where it is not whole:
    the first failure of the disk, whatever HDF5 has made of it.
    """
    with open(path, "w+b", buffering=0, opener=_at_once) as raw:
        disk = _Disk(raw)
        try:
            with h5py.File(disk, "w") as file:
                yield file
        finally:
            if disk.failure is not None:
                raise OSError(disk.failure.errno, disk.failure.strerror, str(path))
        os.fsync(raw.fileno())


def _at_once(path: str, flags: int) -> int:
    """What is no regular file takes no HDF5 file: a pipe would keep the rank waiting, a device forgets."""
    handle = os.open(path, flags | os.O_NONBLOCK, 0o666)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.ENOSPC, "is not a regular file, and keeps nothing", path)
    return handle


class _Disk:
    """A file as HDF5 asks for it. What is written after a failure is not written, and said to be."""

    def __init__(self, raw: Any) -> None:
        self._raw = raw
        self.failure: OSError | None = None
        """The first."""

    def write(self, data: Any) -> int:
        """Takes all of it."""
        left = memoryview(data).cast("B")
        size = len(left)
        while self.failure is None and left:
            try:
                left = left[self._raw.write(left) :]
            except OSError as error:
                self.failure = error
        return size

    def readinto(self, room: Any) -> int:
        """Zeros where nothing was written."""
        left = memoryview(room).cast("B")
        size = len(left)
        while left and (found := self._raw.readinto(left)):
            left = left[found:]
        left[:] = bytes(len(left))
        return size

    def read(self, size: int) -> bytes:
        """By which h5py knows a file."""
        room = bytearray(size)
        self.readinto(room)
        return bytes(room)

    def truncate(self, size: int) -> int:
        """Makes it as long, where that can be."""
        try:
            self._raw.truncate(size)
        except OSError as error:
            self.failure = self.failure or error
        return size

    def seek(self, offset: int, whence: int = 0) -> int:
        """Where it is then."""
        return int(self._raw.seek(offset, whence))

    def tell(self) -> int:
        """Where it is."""
        return int(self._raw.tell())

    def flush(self) -> None:
        """Nothing is held back."""
