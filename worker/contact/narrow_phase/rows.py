"""Rows of the active contacts of a step. The module manages the ranges in which passes write the rows, and the list of
the active rows.
"""

from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np

from ...kernels.jit import njit
from ...model.state import Floats, Indices
from .tables import ContactRows

_SPARE = 4
"""Number of needed rows for each spare row. Rows are reserved for all candidate pairs, and there are twenty times as
many candidate pairs as active contacts. More spare rows take memory; fewer spare rows require new allocations more
often."""


@dataclass
class ActiveRows:
    """Rows of active contacts. Every kind of contact has a range of the allocated rows, and every task has a part of
    this range. Rows are not moved; the first ``n`` elements of ``found`` are the numbers of the rows with active
    contacts.
    """

    room: ContactRows = field(default_factory=lambda: ContactRows.room(0))
    found: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    depth: Floats = field(default_factory=lambda: np.zeros(0))
    """(rows,) depth of a node behind a face, m; see single_contact.admitted."""
    earlier: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(rows,) working array: lists of the rows of each node (single_contact.py)."""
    n: int = 0
    _ends: list[int] = field(default_factory=lambda: [0], init=False)
    _holder: Indices = field(default_factory=lambda: np.zeros(0, np.int32), init=False)

    def begin(self, *many: int) -> None:
        """Begins a step without contacts. Reserves rows for each kind of contact; ``many``: their numbers."""
        self._ends, self.n = [0, *accumulate(many)], 0
        self._reserve(self._ends[-1])

    def begins(self, kind: int) -> int:
        """First row of the range of a ``kind``."""
        return self._ends[kind]

    @property
    def nodes(self) -> Indices:
        """(n, 4) slots of the active contacts."""
        return np.asarray(self.room.nodes[self.found[: self.n]])

    def holder(self, slots: int) -> Indices:
        """Returns a working array with at least ``slots`` elements, all -1. Each function that uses the array must
        reset all elements to -1.
        """
        if len(self._holder) < slots:
            self._holder = np.full(slots + slots // _SPARE, -1, np.int32)
        return self._holder

    def _reserve(self, most: int) -> None:
        """Allocates at least ``most`` rows. Only the rows with active contacts are copied."""
        if most > len(self.found):
            found, room, depth, many = self.found[: self.n], self.room, self.depth, most + most // _SPARE
            self.room, self.depth = ContactRows.room(many), np.empty(many)
            self.found, self.earlier = np.empty((2, many), np.int32)
            for name in room._fields:
                getattr(self.room, name)[found] = getattr(room, name)[found]
            self.depth[found] = depth[found]
            self.found[: self.n] = found


@njit("int64(int32[::1], int64, int64, int64, int64[::1], int64)", cache=True)
def collected(found, n, base, size, counts, tasks):  # type: ignore[no-untyped-def]
    """Writes the numbers of the rows that ``tasks`` have written into ``found`` from ``n`` on. Task k has ``counts[k]``
    rows, from ``base`` plus k times ``size`` on. Returns the new length of ``found``.
    """
    for k in range(tasks):
        for row in range(base + k * size, base + k * size + counts[k]):
            found[n] = row
            n += 1
    return n


@njit("int64(int32[::1], int64, int64[::1], int64[::1])", cache=True)
def gathered(found, n, begins, counts):  # type: ignore[no-untyped-def]
    """Writes the numbers of the rows that tasks have written into ``found`` from ``n`` on. Task k has ``counts[k]``
    rows, from ``begins[k]`` on. Returns the new length of ``found``.
    """
    for k in range(len(counts)):
        for row in range(begins[k], begins[k] + counts[k]):
            found[n] = row
            n += 1
    return n
