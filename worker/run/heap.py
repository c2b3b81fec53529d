"""Settings of the memory allocator of the C library. With these settings the memory of large freed arrays is returned
to the operating system at once."""

import ctypes
import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Parameters of mallopt(3) of glibc."""
LARGE = 1 << 20
"""Smallest size in bytes of an array whose memory is returned to the operating system at once when the array is freed.
By default glibc raises the smallest size, up to 32 MB, to the size of the largest array that was freed. With the
default, arrays that grow while a body breaks leave holes in the heap. The case of docs/tutorial/first_case.md took 540
MB with the default and 380 MB with this setting. The setting does not change the CPU time, even for a bar with 62,000
tets."""
_SPARE = 32 << 20
"""Number of free bytes at the end of the heap that remain allocated. With the value 0, each step of a bar with 62,000
tets returns large arrays and requests them again, which takes 2 s of 28 s."""


def tidy() -> bool:
    """Applies the settings. Returns False if the C library has no function ``mallopt``."""
    if not sys.platform.startswith("linux"):
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and bool(mallopt(_MMAP_THRESHOLD, LARGE)) and bool(mallopt(_TRIM_THRESHOLD, _SPARE))
