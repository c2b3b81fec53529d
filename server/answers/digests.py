"""SHA-256 of files. A hash is computed in slices of the file, and is computed again only if the file has changed."""

import asyncio
import hashlib
import os
from collections import OrderedDict
from typing import BinaryIO
from weakref import WeakValueDictionary

from ..requests.thread_pool import ThreadPool

State = tuple[int, int, int, int, int]
"""State of a file: device, inode, time of the last change of its content in ns, time of the last change of its inode in
ns, size in bytes."""
_KEPT = 10_000
"""Largest number of stored digests, 32 bytes each (chosen value)."""
_SLICE, _CHUNK = 1 << 25, 1 << 18
"""Number of bytes that one task hashes, and number of bytes that are read at once. A task takes 0.1 s; the server
handles other requests of the user between two tasks (chosen values)."""


def state_of(file: BinaryIO) -> State:
    """Returns the state of an open file."""
    status = os.fstat(file.fileno())
    return status.st_dev, status.st_ino, status.st_mtime_ns, status.st_ctime_ns, status.st_size


class Digests:
    """Cache of SHA-256 hashes of files; the key is the state of the file. The class is used only in the thread of the
    event loop.
    """

    def __init__(self, pool: ThreadPool) -> None:
        """Creates an empty cache. ``pool``: pool of threads that compute hashes."""
        self._pool = pool
        self._known: OrderedDict[State, bytes] = OrderedDict()
        self._locks: WeakValueDictionary[State, asyncio.Lock] = WeakValueDictionary()

    async def of(self, file: BinaryIO, state: State) -> bytes:
        """Returns the SHA-256 of the first ``size`` bytes of a file. Raises OSError; raises ServiceError with status
        503 if the server is busy.
        """
        lock = self._locks.setdefault(state, asyncio.Lock())
        async with lock:
            if state not in self._known:
                self._known[state] = await self._computed(file, state[-1])
                if len(self._known) > _KEPT:
                    self._known.popitem(last=False)
            return self._known[state]

    async def _computed(self, file: BinaryIO, size: int) -> bytes:
        total, offset = hashlib.sha256(), 0
        while offset < size and (read := await self._pool.run(_add, total, file, offset, min(_SLICE, size - offset))):
            offset += read
        return total.digest()


def _add(total: "hashlib._Hash", file: BinaryIO, offset: int, size: int) -> int:
    """Adds ``size`` bytes of a file to a digest; returns the number of bytes read."""
    end = offset + size
    while offset < end and (chunk := os.pread(file.fileno(), min(_CHUNK, end - offset), offset)):
        total.update(chunk)
        offset += len(chunk)
    return size - (end - offset)
