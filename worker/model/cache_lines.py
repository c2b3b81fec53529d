"""Tables in which each row is a cache line, so that a kernel reads a row in one memory access."""

import numpy as np

from .state import Floats

LINE = 8
"""Number of 64-bit words in a cache line of 64 bytes."""


def cache_lines(n: int) -> Floats:
    """Return an uninitialised (n, LINE) array whose rows are aligned to cache lines."""
    room = np.empty(n * LINE + LINE)
    first = -(room.ctypes.data // room.itemsize) % LINE
    return room[first : first + n * LINE].reshape(n, LINE)
