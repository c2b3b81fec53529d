"""Work of the elements of each part, as exact sums."""

import numpy as np

from ..kernels.jit import njit, types
from ..model.growing import Scratch
from ..model.rows import WORKS
from ..model.state import CHUNK, Floats, Ints, Model
from ..parallel.arguments import reader
from ..parallel.fixed_point import limbs, magnitude, most
from ..parallel.passes import Pass
from ..parallel.team import TASK, Team

_F1, _F2, _F3, _I = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1], types.int64
_LARGEST, _LIMBS = (_F2, _F3, _I), (types.int64[:, :, ::1], _F3, _I, _F1)
_of_largest, _of_limbs = reader(*_LARGEST), reader(*_LIMBS)
_CHUNKS = 16
"""Number of chunks in a task. Chosen value: a task takes about 10 us; the start of a parallel region takes 2 us."""


class ElementWork:
    """Sums of the columns WORKS over all tets of each part, J, computed from the state (fixed_point.Columns)."""

    def __init__(self, model: Model, team: Team) -> None:
        self._largest = Pass(team, _largest, *_LARGEST, size=_CHUNKS)
        self._limbs = Pass(team, _limbs, *_LIMBS, size=_CHUNKS)
        self._model, self._scratch = model, Scratch()

    def largest(self) -> Floats:
        found = np.zeros(len(WORKS))
        for block in self._model.blocks:
            chunks = -(-block.n // CHUNK)
            some = self._scratch.of("largest", self._largest.many(chunks), np.float64, len(WORKS))
            self._largest.run(chunks, some, block.state, block.n)
            np.maximum(found, some.max(axis=0, initial=0.0), out=found)
        return found

    def limbs(self, scale: Floats) -> Ints:
        words = np.zeros((len(self._model.parts), 2, len(WORKS)), np.int64)
        for block in self._model.blocks:
            chunks = -(-block.n // CHUNK)
            some = self._scratch.of("limbs", self._limbs.many(chunks), np.int64, 2, len(WORKS))
            self._limbs.run(chunks, some, block.state, block.n, scale)
            words[block.part] += some.sum(axis=0)
        return words


@njit(TASK, cache=True, error_model="numpy")
def _largest(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets the row of the task in ``largest`` (tasks, 4) to the largest magnitudes of WORKS of the ``n`` tets in
    some chunks.
    """
    largest, state, n = _of_largest(table)
    for j in range(len(WORKS)):
        found = 0
        for c in range(first, stop if WORKS[j] < state.shape[1] else first):
            found = max(found, most(state[c, WORKS[j], : min(CHUNK, n - c * CHUNK)]))
        largest[first // _CHUNKS, j] = magnitude(found)


@njit(TASK, cache=True, error_model="numpy")
def _limbs(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets the limbs of the task in ``words`` (tasks, 2, 4) to the sums of WORKS of the ``n`` tets in some
    chunks.
    """
    words, state, n, scale = _of_limbs(table)
    mine = words[first // _CHUNKS]
    mine[:] = 0
    for j in range(len(WORKS)):
        for c in range(first, stop if WORKS[j] < state.shape[1] else first):
            high, low = limbs(state[c, WORKS[j], : min(CHUNK, n - c * CHUNK)], scale[j])
            mine[0, j] += high
            mine[1, j] += low
