"""Sums of columns by group of rows, with passes that the threads of a rank share (fixed_point.Columns)."""

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
"""Number of rows in a task. Chosen value: ten columns take some 20 us; to start a parallel region takes 2 us."""


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


class GroupedSums:
    """Passes over columns (k, n) whose row i belongs to ``group`` i, (n,). Sums are fast if neighbouring rows are in
    one group.
    """

    def __init__(self, team: Team) -> None:
        self._largest = Pass(team, _largest, *_LARGEST, size=_ROWS)
        self._limbs = Pass(team, _limbs, *_LIMBS, size=_ROWS)
        self._scratch = Scratch()

    def of(self, columns: Floats, group: Indices, groups: int) -> "Grouped":
        """Returns ``columns`` (k, n), in C order, for a sum; valid until the next call."""
        return Grouped(self, columns, group, groups)

    def largest(self, columns: Floats) -> Floats:
        """(k,) the largest magnitude of each column; see fixed_point.Columns."""
        k, n = columns.shape
        found = self._scratch.of(f"largest {k}", self._largest.many(n), np.float64, k)
        self._largest.run(n, found, columns)
        return np.asarray(found.max(axis=0, initial=0.0))

    def limbs(self, columns: Floats, group: Indices, groups: int, scale: Floats) -> Ints:
        """(groups, 2, k) the sums of limbs; see fixed_point.Columns."""
        k, n = columns.shape
        words = self._scratch.of(f"limbs {groups} {k}", self._limbs.many(n), np.int64, groups, 2, k)
        self._limbs.run(n, words, columns, group, scale)
        return np.asarray(words.sum(axis=0))


class Grouped:
    """Columns of GroupedSums in a sum over all ranks (fixed_point.Columns)."""

    def __init__(self, sums: GroupedSums, columns: Floats, group: Indices, groups: int) -> None:
        self._sums, self._columns, self._group, self._groups = sums, columns, group, groups

    def largest(self) -> Floats:
        return self._sums.largest(self._columns)

    def limbs(self, scale: Floats) -> Ints:
        return self._sums.limbs(self._columns, self._group, self._groups, scale)
