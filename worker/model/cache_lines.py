"""Tables whose rows are cache lines: what a kernel takes of a row costs one access to memory."""

import numpy as np

from .state import Floats

LINE = 8
"""Words of a cache line of 64 bytes."""


def cache_lines(n: int) -> Floats:
    """(n, LINE) that begins where a cache line does; what is in it is anything."""
    room = np.empty(n * LINE + LINE)
    first = -(room.ctypes.data // room.itemsize) % LINE
    return room[first : first + n * LINE].reshape(n, LINE)
