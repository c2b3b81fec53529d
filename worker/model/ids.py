"""Search for global ids in sorted lists. If many ids are searched, the functions use a table of all ids up to the
largest id; if few are searched, they use bisection.
"""

import numpy as np
import numpy.typing as npt

_Ids = npt.NDArray[np.int64] | npt.NDArray[np.int32]
_Places = npt.NDArray[np.int32]

_BISECTION = 32
"""Number of table entries that a processor fills in the time of one bisection."""


def located(known: _Ids, wanted: _Ids) -> _Places:
    """Return the positions in ``known`` of the ids ``wanted``, in the shape of ``wanted``. ``known`` is ascending and
    must contain every wanted id.
    """
    if _few(known, wanted):
        return np.searchsorted(known, wanted).astype(np.int32)
    table = np.empty(known[-1] + 1, np.int32)
    table[known] = np.arange(len(known), dtype=np.int32)
    return np.asarray(table[wanted])


def places(known: _Ids, wanted: _Ids) -> _Places:
    """Return the positions in ``known`` of the ids ``wanted``, in the shape of ``wanted``; -1 for ids that are not in
    ``known``, which is ascending.
    """
    if not len(known):
        return np.full(wanted.shape, -1, np.int32)
    if _few(known, wanted):
        at = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
        return np.where(known[at] == wanted, at, -1).astype(np.int32)
    beyond = int(known[-1]) + 1
    table = np.full(beyond + 1, -1, np.int32)
    table[known] = np.arange(len(known), dtype=np.int32)
    return np.asarray(table[np.minimum(wanted.astype(np.uint64), np.uint64(beyond))])  # negative ids become large


def among(known: _Ids, wanted: _Ids) -> npt.NDArray[np.bool_]:
    """Return whether each of the ids ``wanted`` is in ``known``, in the shape of ``wanted``. ``known`` is ascending."""
    return np.asarray(places(known, wanted) >= 0)


def unique(ids: _Ids) -> npt.NDArray[np.int64]:
    """Return the distinct ids, ascending; the value -1 is omitted, because it means that there is no id."""
    largest = int(ids.max(initial=-1))
    if ids.size * _BISECTION < largest:
        return np.unique(ids[ids >= 0]).astype(np.int64)
    table = np.zeros(largest + 2, bool)
    table[ids.reshape(-1)] = True
    return np.flatnonzero(table[:-1])


class IdIndex:
    """Positions of ids in a list of any order."""

    def __init__(self, ids: _Ids) -> None:
        """``ids`` (n,): ids of the list, all different."""
        self._order = np.argsort(ids, kind="stable").astype(np.int32)
        self._known = ids[self._order]

    def places(self, wanted: _Ids) -> _Places:
        """Return the positions in the list of the ids ``wanted``, in the shape of ``wanted``; -1 for ids that are not
        in the list.
        """
        at = places(self._known, wanted)
        return np.where(at >= 0, self._order[at], -1).astype(np.int32) if len(self._order) else at


def _few(known: _Ids, wanted: _Ids) -> bool:
    return not len(known) or wanted.size * _BISECTION < known[-1]
