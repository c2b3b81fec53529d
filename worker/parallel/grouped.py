"""Sums of columns for each group of rows. The threads of a rank share the passes (fixed_point.Columns)."""

import numpy as np

from ..kernels.jit import njit, types
from ..model.growing import Scratch
from ..model.state import Floats, Indices, Ints
from .arguments import reader
from .fixed_point import limbs, magnitude, most
from .passes import Pass
from .team import TASK, Team

_F1, _F2, _N1 = types.float64[::1], types.float64[:, ::1], types.int32[::1]
_LARGEST, _LIMBS = (_F2, _F2), (types.int64[:, :, :, ::1], _F2, _N1, _F1)
_of_largest, _of_limbs = reader(*_LARGEST), reader(*_LIMBS)
_ROWS = 4096
"""Number of rows in a task. Chosen value: a task with ten columns takes about 20 us; the start of a parallel region
takes 2 us."""


@njit(TASK, cache=True, error_model="numpy")
def _largest(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets the row of the task in ``largest`` (tasks, k) to the largest magnitudes of the columns."""
    largest, columns = _of_largest(table)
    for j in range(len(columns)):
        largest[first // _ROWS, j] = magnitude(most(columns[j, first:stop]))


@njit(TASK, cache=True, error_model="numpy")
def _limbs(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets the sums of the task in ``words`` (tasks, groups, 2, k). Successive rows of one group are summed
    together.
    """
    words, columns, group, scale = _of_limbs(table)
    mine, begin = words[first // _ROWS], first
    mine[:] = 0
    while begin < stop:
        end = begin + 1
        while end < stop and group[end] == group[begin]:
            end += 1
        for j in range(len(scale)):
            high, low = limbs(columns[j, begin:end], scale[j])
            mine[group[begin], 0, j] += high
            mine[group[begin], 1, j] += low
        begin = end


class Grouped:
    """Columns (k, n) that are summed for each group of rows (fixed_point.Columns). Row i belongs to the group
    ``group[i]``. Sums are fast if neighbouring rows are in one group.
    """

    def __init__(self, team: Team, groups: int) -> None:
        """Makes the passes for columns with this number of ``groups``."""
        self._largest = Pass(team, _largest, *_LARGEST, size=_ROWS)
        self._limbs = Pass(team, _limbs, *_LIMBS, size=_ROWS)
        self._scratch, self._groups = Scratch(), groups
        self._columns, self._group = np.zeros((0, 0)), np.zeros(0, np.int32)

    def of(self, columns: Floats, group: Indices) -> "Grouped":
        """Sets the ``columns`` (k, n), in C order, and the ``group`` (n,) of each row; returns the object."""
        self._columns, self._group = columns, group
        return self

    def largest(self) -> Floats:
        k, n = self._columns.shape
        found = self._scratch.of("largest", self._largest.many(n), np.float64, k)
        self._largest.run(n, found, self._columns)
        return np.asarray(found.max(axis=0, initial=0.0))

    def limbs(self, scale: Floats) -> Ints:
        k, n = self._columns.shape
        words = self._scratch.of("limbs", self._limbs.many(n), np.int64, self._groups, 2, k)
        self._limbs.run(n, words, self._columns, self._group, scale)
        return np.asarray(words.sum(axis=0))
