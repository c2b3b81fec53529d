"""Tables in which each row is a cache line, so that a kernel reads a row in one memory access."""

from typing import cast

import numpy as np

from .growing import aligned
from .state import Floats

LINE = 8
"""Number of 64-bit words in a cache line of 64 bytes."""


def cache_lines(n: int) -> Floats:
    """Return an uninitialised (n, LINE) array whose rows are aligned to cache lines."""
    return cast("Floats", aligned(n, (LINE,), np.float64))
