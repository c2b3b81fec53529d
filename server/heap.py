"""Settings of the heap of the C library, so that freed memory returns to the operating system."""

import ctypes
import sys

_ARENA_MAX, _MMAP_THRESHOLD = -8, -3
"""Parameters of mallopt(3) of glibc."""
_HEAPS = 2
"""Number of heaps that all threads share. Python runs one thread at a time; fewer heaps than threads did not change the
CPU time (measured)."""
_LARGE = 256 << 10
"""Size in bytes from which a freed block returns to the operating system at once. Answers whose size grows with the run
are larger than this limit (chosen value). With a fixed limit, glibc does not raise it to the size of the largest block
so far."""


def share() -> bool:
    """Limits the number of heaps of the C library. Call it before the first thread starts. Returns False if the C
    library has no such setting. Without this limit each thread has a heap of its own, which stays as large as the
    largest answer that the thread has made.
    """
    if not sys.platform.startswith("linux"):
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and bool(mallopt(_ARENA_MAX, _HEAPS)) and bool(mallopt(_MMAP_THRESHOLD, _LARGE))
