"""What the C library does with the memory that the server has given back."""

import ctypes
import sys

_ARENA_MAX, _MMAP_THRESHOLD = -8, -3
"""Parameters of mallopt(3), of glibc."""
_HEAPS = 2
"""That all threads share. Chosen: Python runs one thread at a time; the server's processor time stays as it was."""
_LARGE = 256 << 10
"""Bytes of a block that goes back to the system at once. Chosen: answers that grow with a run are larger. glibc would
raise its own bound to the largest block that it has seen.
"""


def share() -> bool:
    """Lets all threads take from few heaps, before there are threads; False where the C library cannot be told.

    Else each of the threads that read journals and answer keeps a heap of its own, which does not become smaller than
    its largest answer has made it: the server grows for as long as threads come to their first large answer.
    """
    if not sys.platform.startswith("linux"):
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and bool(mallopt(_ARENA_MAX, _HEAPS)) and bool(mallopt(_MMAP_THRESHOLD, _LARGE))
