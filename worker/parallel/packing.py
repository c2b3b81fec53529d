"""Packing of results. The tasks of a pass write their results to separate ranges; packing copies these results to one
array without gaps.

The number of results of a task is not known before, so each task writes its results from a fixed row on. The packed
results have the order of the tasks, so the packed array is the same for any number of threads.
"""

from typing import Any

import numpy as np

from ..kernels.jit import njit, types
from ..model.state import Ints
from .arguments import reader
from .passes import Pass
from .team import TASK, Team

_U1, _I1, _I = types.uint8[::1], types.int64[::1], types.int64
_PACK = _U1, _U1, _I, _I1, _I1, _I, _I
_pack = reader(*_PACK)


@njit("int64(int64[::1], int64[::1])", cache=True)
def offsets(begins, counts):  # type: ignore[no-untyped-def]
    """Set each of ``begins`` to the sum of all ``counts`` before it. Return the sum of all counts."""
    total = 0
    for k in range(len(counts)):
        begins[k] = total
        total += counts[k]
    return total


@njit("int64(int64[::1], int64[:, ::1])", cache=True)
def range_offsets(begins, counts):  # type: ignore[no-untyped-def]
    """Compute where each range and each task begins in a counting sort by ranges of keys.

    Set ``begins`` (ranges + 1,) to the index of the first item of each range. Replace each of ``counts`` (tasks,
    ranges) by the index of the first item of the task in the range. Return the number of items.
    """
    total = 0
    for r in range(counts.shape[1]):
        begins[r] = total
        for k in range(len(counts)):
            counts[k, r], total = total, total + counts[k, r]
    begins[counts.shape[1]] = total
    return total


@njit(TASK, cache=True)
def _copy(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: copy the rows of task number ``first`` / ``size``. A row has ``width`` bytes."""
    out, source, width, begins, counts, size, spread = _pack(table)
    k = first // size
    to, fro = width * begins[k], width * spread * first
    for i in range(width * counts[k]):
        out[to + i] = source[fro + i]


class Packing:
    """Passes that pack the results of other passes. All tasks of these passes have the same length."""

    def __init__(self, team: Team, size: int) -> None:
        """``size``: length of a task."""
        self._size, self._pass = size, Pass(team, _copy, *_PACK, size=size)

    def run(self, n: int, out: Any, source: Any, begins: Ints, counts: Ints, spread: int = 1) -> None:
        """Copy the results of a pass over the range from 0 to ``n`` from ``source`` to ``out``; the two arrays have
        rows of one type.

        The task that begins at index f has written ``counts`` rows to ``source``, from row ``spread`` * f on. The rows
        of a task are copied to ``out``, from the row given by ``begins`` on.
        """
        if n:
            width = source.dtype.itemsize * int(np.prod(source.shape[1:], dtype=np.int64))
            flat = (array.reshape(-1).view(np.uint8) for array in (out, source))
            self._pass.run(n, *flat, width, begins, counts, self._size, spread)
