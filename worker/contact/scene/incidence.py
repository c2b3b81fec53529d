"""Table from corners to faces and edges. With this table the rows of a scene that a node separation can change are
found without a pass over the whole scene.

The rows of faces and edges of a scene do not change between two searches. When nodes separate, corners are replaced by
copies. Therefore the rows of a copy are among the rows of the slot that was its original at the search.
"""

import numpy as np

from ...kernels.jit import njit, several, types
from ...model.state import Indices, Ints

_I, _I1, _N1, _N2 = types.int64, types.int64[::1], types.int32[::1], types.int32[:, ::1]


class Incidence:
    """Rows of faces or edges at each slot, according to the corners at the last search."""

    def __init__(self, corners: Indices) -> None:
        """``corners`` (n, k): slots of the corners, before any node has separated."""
        self._begin, self._row = _by_slot(corners, int(corners.max(initial=-1)) + 1)

    def at(self, slots: Indices) -> Ints:
        """Returns the rows, ascending, with a corner that was one of the ``slots`` (m,) at the search. The value -1 in
        ``slots`` is ignored.
        """
        return np.asarray(_at(self._begin, self._row, slots))


@njit(several(_I1, _N1)(_N2, _I), cache=True)
def _by_slot(corners, slots):  # type: ignore[no-untyped-def]
    """Returns the offsets (slots + 1,) of the rows of each slot, and the rows."""
    begin, many = np.zeros(slots + 1, np.int64), corners.shape[1]
    for r in range(len(corners)):
        for k in range(many):
            begin[corners[r, k]] += 1
    total = 0
    for s in range(slots + 1):
        begin[s], total = total, total + begin[s]
    rows, at = np.empty(total, np.int32), begin[:slots].copy()
    for r in range(len(corners)):
        for k in range(many):
            rows[at[corners[r, k]]] = r
            at[corners[r, k]] += 1
    return begin, rows


@njit(_I1(_I1, _N1, _N1), cache=True)
def _at(begin, row, slots):  # type: ignore[no-untyped-def]
    """Returns the rows for the method ``Incidence.at``."""
    n, last = 0, len(begin) - 1
    for s in slots:
        if 0 <= s < last:
            n += begin[s + 1] - begin[s]
    found, n, m = np.empty(n, np.int64), 0, 0
    for s in slots:
        if 0 <= s < last:
            for i in range(begin[s], begin[s + 1]):
                found[n] = row[i]
                n += 1
    found.sort()
    for i in range(n):
        if m == 0 or found[i] != found[m - 1]:
            found[m] = found[i]
            m += 1
    return found[:m].copy()
