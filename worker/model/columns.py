"""Columns of a growing table. A column is an array with one row for each member of the table. The columns belong to
objects of several stages.

A stage declares its columns once, with a rule for the values of new rows. Columns have spare rows: ``extend`` appends
rows to all columns in one call of a kernel, without copying the columns.
"""

from enum import IntFlag
from typing import Any

import numpy as np
import numpy.typing as npt

from .growing import address_of, aligned, same_memory, spare


class Rule(IntFlag):
    """Rule for the values of new rows of a column."""

    ZERO = 0
    """New rows have the value zero, or False."""
    ABSENT = 1
    """All bits of a new row are set; an integer is then -1."""
    COPIED = 2
    """Flag of a rule. If the flag is set, a new row that is a copy of another row has the values of that row."""


ZERO, ABSENT, COPIED = Rule.ZERO, Rule.ABSENT, Rule.COPIED
_WORDS, _ALL_BITS = 5, 255
"""Number of words that describe a column to the kernels: address, number of bytes, bytes of a row, value of each byte
of a new row, and flag for copied rows; and value of a byte in which all bits are set."""


class _Columns:
    """Columns that are attributes of one object. The object may be replaced by another object of the same type."""

    def __init__(self, owner: object, at: str, names: dict[str, int]) -> None:
        """``at``: path from ``owner`` to the object with the attributes, "" for the owner itself; ``names``: dictionary
        from the names of the columns to their numbers.
        """
        self._owner, self._path, self.names = owner, at.split(".") if at else [], names

    @property
    def now(self) -> dict[str, Any]:
        """Dictionary of the present attributes of the object; it is empty if the object does not exist."""
        holder: Any = self._owner
        for name in self._path:
            holder = getattr(holder, name)
            if holder is None:
                return {}
        found: dict[str, Any] = vars(holder)
        return found


class Columns:
    """All columns of one table."""

    def __init__(self) -> None:
        """Creates a table without columns."""
        self._objects: list[_Columns] = []
        self._rules: list[Rule] = []
        self._rooms: list[np.ndarray | None] = []
        """Buffers of the columns, with spare rows. The entry of a column is None if the scene does not need it."""
        self._words = np.zeros((0, _WORDS), np.int64)

    def declare(self, owner: object, at: str = "", /, **rules: Rule) -> None:
        """Declares attributes of ``owner`` as columns. Each attribute has a rule for its new rows.

        ``at``: path from the owner to the object that has the attributes. If a table has rows and an array has length
        0, the scene does not need this column.
        """
        first = len(self._rules)
        self._objects.append(_Columns(owner, at, {name: first + k for k, name in enumerate(rules)}))
        self._rules += rules.values()
        self._rooms += [None] * len(rules)
        self._words = np.zeros((len(self._rules), _WORDS), np.int64)
        for k in range(first):
            self._set(k, self._rooms[k])

    def extend(self, n: int, more: int) -> None:
        """Appends ``more`` rows to the ``n`` rows of all columns. The values follow the rules of the columns."""
        from .inheriting import fill  # numba is imported here, because the folder of its cache must be set first

        m, rooms = n + more, self._rooms
        for some in self._objects:
            if columns := some.now:
                for name, k in some.names.items():
                    array, room = columns[name], rooms[k]
                    if room is None and not len(array):
                        continue
                    if room is None or len(array) != n or len(room) < m or not same_memory(room[:n], array):
                        self._set(k, room := _room(array, n, m, name))
                    if room is not None:
                        columns[name] = room[:m]
            else:
                for k in some.names.values():
                    self._set(k, None)
        fill(self._words, address_of(self._words), n, more)

    def copy(self, sources: "npt.NDArray[Any]", targets: "npt.NDArray[Any]") -> None:
        """Copies the rows ``sources`` (k,) to the rows ``targets`` (k,) in the columns with the rule COPIED. The arrays
        ``sources`` and ``targets`` are int64.
        """
        from .inheriting import copy

        copy(self._words, address_of(self._words), sources, targets)

    def _set(self, k: int, room: "np.ndarray | None") -> None:
        self._rooms[k] = room
        self._words[k] = _words(room, self._rules[k])


def _room(array: "np.ndarray", n: int, m: int, name: str) -> "np.ndarray | None":
    """Returns the buffer of an array of ``n`` rows, if the buffer has at least ``m`` rows, else a copy of the array
    with spare rows. Returns None for an array without rows.
    """
    if len(array) != n:
        if len(array):
            raise ValueError(f"column {name!r} has {len(array)} rows instead of {n}")
        return None
    if (room := spare(array, m)) is None:
        room = aligned(m + m // 2, array.shape[1:], array.dtype)
        room[:n] = array
    return room


def _words(room: "np.ndarray | None", rule: Rule) -> tuple[int, int, int, int, bool]:
    if room is None:
        return 0, 0, 0, 0, False
    value = _ALL_BITS if rule & ABSENT else 0
    return address_of(room), room.nbytes, room.nbytes // len(room), value, bool(rule & COPIED)
