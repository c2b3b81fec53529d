"""Where global ids stand: by a table of all ids up to the largest where many are wanted, by bisection where few are."""

import numpy as np
import numpy.typing as npt

_Ids = npt.NDArray[np.int64] | npt.NDArray[np.int32]
_Places = npt.NDArray[np.int32]

_A_LOOK = 32
"""Entries of a table that cost as much to lay out as a bisection."""


def located(known: _Ids, wanted: _Ids) -> _Places:
    """Where ``wanted`` ids, which must be there, stand among the ascending ``known``, in their shape."""
    if _few(known, wanted):
        return np.searchsorted(known, wanted).astype(np.int32)
    table = np.empty(known[-1] + 1, np.int32)
    table[known] = np.arange(len(known), dtype=np.int32)
    return np.asarray(table[wanted])


def places(known: _Ids, wanted: _Ids) -> _Places:
    """Where ``wanted`` stand among the ascending ``known``, in their shape; -1 where they do not."""
    if not len(known):
        return np.full(wanted.shape, -1, np.int32)
    if _few(known, wanted):
        at = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
        return np.where(known[at] == wanted, at, -1).astype(np.int32)
    beyond = int(known[-1]) + 1
    table = np.full(beyond + 1, -1, np.int32)
    table[known] = np.arange(len(known), dtype=np.int32)
    return np.asarray(table[np.minimum(wanted.astype(np.uint64), np.uint64(beyond))])  # one below 0 is beyond as well


def among(known: _Ids, wanted: _Ids) -> npt.NDArray[np.bool_]:
    """Which of ``wanted`` are in the ascending ``known``."""
    return np.asarray(places(known, wanted) >= 0)


def unique(ids: _Ids) -> npt.NDArray[np.int64]:
    """The ids, ascending, each once, without -1, which stands for none."""
    largest = int(ids.max(initial=-1))
    if ids.size * _A_LOOK < largest:
        return np.unique(ids[ids >= 0]).astype(np.int64)
    table = np.zeros(largest + 2, bool)
    table[ids.reshape(-1)] = True
    return np.flatnonzero(table[:-1])


def _few(known: _Ids, wanted: _Ids) -> bool:
    return not len(known) or wanted.size * _A_LOOK < known[-1]
