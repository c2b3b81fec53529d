"""What the C library of a rank does with the memory of arrays that are let go."""

import ctypes
import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Parameters of mallopt(3), of glibc."""
LARGE = 1 << 20
"""Bytes of an array that goes back to the system at once. glibc would raise its own bound up to 32 MB, to the largest
array that it has seen let go: what grows and is made anew while a body breaks then leaves holes, and the case of
docs/tutorial/first_case.md took 540 MB where it takes 380 MB now. Its CPU time is the same, and that of a bar with
62,000 tets."""
_SPARE = 32 << 20
"""Bytes at the end of the heap that stay: without them a step of large arrays gives back and asks again, 2 s of 28 for
that bar."""


def tidy() -> bool:
    """Gives large arrays back as soon as they are let go; False where the C library cannot be told."""
    if not sys.platform.startswith("linux"):
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and bool(mallopt(_MMAP_THRESHOLD, LARGE)) and bool(mallopt(_TRIM_THRESHOLD, _SPARE))
