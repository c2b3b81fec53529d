"""The sha256 of files, computed in slices, once for each state of a file."""

import asyncio
import hashlib
import os
from collections import OrderedDict
from typing import BinaryIO
from weakref import WeakValueDictionary

from .lanes import Lanes

State = tuple[int, int, int, int, int]
"""Device, inode, times of the last change of content and of the file in ns, size in bytes."""
_KEPT = 10_000
"""Digests that are kept, 32 bytes each. Chosen."""
_SLICE, _CHUNK = 1 << 25, 1 << 18
"""Bytes that are read in one piece of work, and at once. Chosen: 0.1 s, and others of the user come between."""


def state_of(file: BinaryIO) -> State:
    """Of an open file."""
    status = os.fstat(file.fileno())
    return status.st_dev, status.st_ino, status.st_mtime_ns, status.st_ctime_ns, status.st_size


class Digests:
    """Belongs to the event loop."""

    def __init__(self, lanes: Lanes) -> None:
        """None is known yet."""
        self._lanes = lanes
        self._known: OrderedDict[State, bytes] = OrderedDict()
        self._locks: WeakValueDictionary[State, asyncio.Lock] = WeakValueDictionary()

    async def of(self, file: BinaryIO, state: State) -> bytes:
        """The sha256 of the first ``size`` bytes. Raises OSError, ServiceError 503."""
        lock = self._locks.setdefault(state, asyncio.Lock())
        async with lock:
            if state not in self._known:
                self._known[state] = await self._computed(file, state[-1])
                if len(self._known) > _KEPT:
                    self._known.popitem(last=False)
            return self._known[state]

    async def _computed(self, file: BinaryIO, size: int) -> bytes:
        total, offset = hashlib.sha256(), 0
        while offset < size and (read := await self._lanes.run(_add, total, file, offset, min(_SLICE, size - offset))):
            offset += read
        return total.digest()


def _add(total: "hashlib._Hash", file: BinaryIO, offset: int, size: int) -> int:
    """Adds ``size`` bytes of a file to a digest; returns how many there were."""
    end = offset + size
    while offset < end and (chunk := os.pread(file.fileno(), min(_CHUNK, end - offset), offset)):
        total.update(chunk)
        offset += len(chunk)
    return size - (end - offset)
