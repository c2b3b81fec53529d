"""Random numbers that do not depend on the number of ranks. A number is a hash of an index, not the next number of a
sequence.

The hash is splitmix64: Steele, Lea and Flood 2014, with the constants of Vigna's public-domain splitmix64.c. Number k
of the sequence with a seed is a hash of seed + (k + 1) times the golden ratio, so any number can be computed directly.
"""

import numpy as np
import numpy.typing as npt

from .state import Floats

_GOLDEN = 0x9E3779B97F4A7C15
"""Odd integer next to 2^64 divided by the golden ratio (splitmix64.c)."""


def splitmix64(numbers: npt.NDArray[np.integer], seed: int) -> npt.NDArray[np.uint64]:
    """Return the elements with the indices ``numbers`` (from 0) of the random sequence with the seed ``seed``. An
    element has 64 random bits.
    """
    z = (np.asarray(numbers).astype(np.uint64) + np.uint64(1)) * np.uint64(_GOLDEN) + np.uint64(seed)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(z ^ (z >> np.uint64(31)))


def uniform(numbers: npt.NDArray[np.integer], seed: int) -> Floats:
    """Return one random float in [0, 1) for each index in ``numbers``. The float is a multiple of 2^-53."""
    return np.asarray((splitmix64(numbers, seed) >> np.uint64(11)) * 2.0**-53)
