"""Work of the elements of each part, as exact sums."""

import numpy as np

from ..kernels.jit import njit
from ..model.rows import WORKS
from ..model.state import CHUNK, Block, Floats, Ints
from ..parallel.fixed_point import limbs, magnitude, most


class ElementWork:
    """Sums over all tets of each part of the columns WORKS of the state, J."""

    def __init__(self, blocks: list[Block], parts: int) -> None:
        self._blocks, self._parts = blocks, parts

    def largest(self) -> Floats:
        found = np.zeros(len(WORKS))
        for block in self._blocks:
            _largest_work(found, block.state, block.n)
        return found

    def limbs(self, scale: Floats) -> Ints:
        words = np.zeros((self._parts, 2, len(WORKS)), np.int64)
        for block in self._blocks:
            _limbs_of_work(words[block.part], block.state, block.n, scale)
        return words


@njit("void(float64[::1], float64[:, :, ::1], int64)", cache=True, error_model="numpy")
def _largest_work(largest, state, n):  # type: ignore[no-untyped-def]
    """Raises ``largest`` (4,) to the magnitudes of the columns WORKS of the ``n`` tets."""
    for j in range(len(WORKS)):
        found = 0
        for c in range((n + CHUNK - 1) // CHUNK if WORKS[j] < state.shape[1] else 0):
            found = max(found, most(state[c, WORKS[j], : min(CHUNK, n - c * CHUNK)]))
        largest[j] = max(largest[j], magnitude(found))


@njit("void(int64[:, ::1], float64[:, :, ::1], int64, float64[::1])", cache=True, error_model="numpy")
def _limbs_of_work(words, state, n, scale):  # type: ignore[no-untyped-def]
    """Adds the columns WORKS of the ``n`` tets, divided into limbs, to the exact sums ``words`` (2, 4)."""
    for j in range(len(WORKS)):
        for c in range((n + CHUNK - 1) // CHUNK if WORKS[j] < state.shape[1] else 0):
            high, low = limbs(state[c, WORKS[j], : min(CHUNK, n - c * CHUNK)], scale[j])
            words[0, j] += high
            words[1, j] += low
