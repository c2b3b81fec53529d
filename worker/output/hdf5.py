"""HDF5 files that are written safely even if the disk becomes full.

After a failed write HDF5 continues with the data that it could not write. HDF5 then fails again at each object that is
freed. Python can only print the errors at the freed objects, and at last the process ends with a segmentation fault. In
other cases an incomplete file can be opened as if it were complete. Therefore this module records the failures of the
disk and does not report them to HDF5.
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
    """Open a new HDF5 file and flush it to disk at the end.

    Raises OSError with the name of the file if the file is incomplete. The raised error is the first failure of the
    disk; later errors of HDF5 are ignored.
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
    """Open a file without waiting.

    Raises OSError if the path is not a regular file, because a pipe would block the rank, and a device would not keep
    the data.
    """
    handle = os.open(path, flags | os.O_NONBLOCK, 0o666)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.ENOSPC, "is not a regular file, and keeps nothing", path)
    return handle


class _Disk:
    """File object for HDF5. After a failure of the disk it discards the data to be written, and reports success to
    HDF5.
    """

    def __init__(self, raw: Any) -> None:
        self._raw = raw
        self.failure: OSError | None = None
        """The first failure of the disk; None if no failure occurred."""

    def write(self, data: Any) -> int:
        """Write all data and return its size. After a failure of the disk, discard the data."""
        left = memoryview(data).cast("B")
        size = len(left)
        while self.failure is None and left:
            try:
                left = left[self._raw.write(left) :]
            except OSError as error:
                self.failure = error
        return size

    def readinto(self, room: Any) -> int:
        """Fill ``room`` with data of the file. If the file has less data, fill the rest with zeros."""
        left = memoryview(room).cast("B")
        size = len(left)
        while left and (found := self._raw.readinto(left)):
            left = left[found:]
        left[:] = bytes(len(left))
        return size

    def read(self, size: int) -> bytes:
        """Read ``size`` bytes. h5py recognises a file object by the presence of this method."""
        room = bytearray(size)
        self.readinto(room)
        return bytes(room)

    def truncate(self, size: int) -> int:
        """Set the size of the file if possible."""
        try:
            self._raw.truncate(size)
        except OSError as error:
            self.failure = self.failure or error
        return size

    def seek(self, offset: int, whence: int = 0) -> int:
        """Move the position in the file and return the new position."""
        return int(self._raw.seek(offset, whence))

    def tell(self) -> int:
        """Return the position in the file."""
        return int(self._raw.tell())

    def flush(self) -> None:
        """Do nothing, because no data is buffered."""
