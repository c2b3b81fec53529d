"""Buffers with spare capacity for arrays to which rows are appended, and for arrays that are filled again in every
step.
"""

import ctypes
from typing import Any

import numpy as np

_word = ctypes.c_int64.from_address
_DATA = 16
"""Offset of the address of the data in an array object (numpy's ``PyArrayObject_fields``), bytes."""


def address_of(array: Any) -> int:
    """Return the address of the first item of an array; ``array.ctypes.data`` gives the same number more slowly."""
    return int(_word(id(array) + _DATA).value)


class Scratch:
    """Buffers of arrays that are filled again in every step; each buffer has a name.

    An array keeps its address while its length does not change. Therefore a table of arguments (parallel/arguments.py)
    that contains the array stays valid.
    """

    def __init__(self) -> None:
        self._rooms: dict[str, np.ndarray] = {}
        self._some: dict[str, np.ndarray] = {}

    def of(self, name: str, n: int, kind: "type[np.generic]" = np.int64, *columns: int) -> Any:
        """Return an uninitialised (n, *columns) array. All calls with one name must have the same type and columns."""
        some = self._some.get(name)
        if some is None or n != len(some):
            room = self._rooms.get(name)
            if room is None or n > len(room):
                room = self._rooms[name] = np.empty((n + n // 2, *columns), kind)
            some = self._some[name] = room[:n]
        return some

    def zeros(self, name: str, n: int, *columns: int) -> Any:
        """Return a (n, *columns) array of int64 zeros."""
        some = self.of(name, n, np.int64, *columns)
        some.fill(0)
        return some


_LINE = 64
"""Bytes of a cache line. A table whose rows are whole cache lines, or equal parts of one, begins on a cache line."""


def aligned(n: int, columns: tuple[int, ...], kind: Any) -> Any:
    """Return an uninitialised (n, *columns) array that begins on a cache line."""
    dtype = np.dtype(kind)
    size = n * int(np.prod(columns, dtype=np.int64)) * dtype.itemsize
    room = np.empty(size + _LINE, np.uint8)
    first = -address_of(room) % _LINE
    return room[first : first + size].view(dtype).reshape(n, *columns)


def spacious(n: int, columns: tuple[int, ...], kind: Any) -> Any:
    """Return an uninitialised (n, *columns) array in a buffer with spare rows (columns.py)."""
    return np.empty((n + n // 2, *columns), kind)[:n]


def spacious_copy(array: Any) -> Any:
    """Return a copy of an array in a buffer with spare rows (columns.py)."""
    copy = spacious(len(array), array.shape[1:], array.dtype)
    copy[:] = array
    return copy


def spare(array: "np.ndarray", m: int) -> "np.ndarray | None":
    """Return the buffer whose first rows are ``array``, if it has at least ``m`` rows, else None."""
    room = array.base
    if not isinstance(room, np.ndarray) or room.shape[1:] != array.shape[1:] or room.dtype != array.dtype:
        return None
    return room if len(room) >= m and same_memory(room[: len(array)], array) else None


def extended(array: "np.ndarray", rows: "np.ndarray") -> "np.ndarray":
    """Return ``array`` with ``rows`` appended: in the buffer of ``array``, if it has capacity, else in a larger one."""
    n, m = len(array), len(array) + len(rows)
    if n == m:
        return array
    if (room := spare(array, m)) is None:
        room = np.empty((m + m // 2, *array.shape[1:]), array.dtype)
        room[:n] = array
    room[n:m] = rows
    return room[:m]


def same_memory(one: np.ndarray, two: np.ndarray) -> bool:
    """Return whether two C-ordered arrays of one type occupy the same memory."""
    return one.shape == two.shape and address_of(one) == address_of(two)


class Rooms:
    """Buffers of some columns of a table. A column with spare capacity is not copied when rows are appended."""

    def __init__(self, *names: str) -> None:
        """``names``: names of the attributes of the table that are columns."""
        self._rooms: dict[str, np.ndarray | None] = dict.fromkeys(names)

    def of(self, table: object, more: int) -> list[Any]:
        """Return the buffers of the columns of ``table``. A buffer begins with the rows of its column and has capacity
        for at least ``more`` further rows.
        """
        for name, room in self._rooms.items():
            column = getattr(table, name)
            n = len(column)
            if room is None or column.base is not room or len(room) < n + more:
                room = self._rooms[name] = np.empty((n + more + (n + more) // 2, *column.shape[1:]), column.dtype)
                room[:n] = column
        return list(self._rooms.values())

    def append(self, table: object, more: int, **rows: Any) -> None:
        """Append ``more`` rows to the columns of ``table``. Each further argument is an array for one column, or one
        value for all new rows of a column.
        """
        for room, name in zip(self.of(table, more), self._rooms, strict=True):
            n = len(getattr(table, name))
            room[n : n + more] = rows[name]
            setattr(table, name, room[: n + more])

    def take(self, table: object, m: int) -> None:
        """Set each column of ``table`` to the first ``m`` rows of its buffer."""
        for name, room in self._rooms.items():
            assert room is not None
            setattr(table, name, room[:m])
