"""Room for what grows by a few rows at a time, so that it need not be made anew."""

from typing import Any

import numpy as np


class Scratch:
    """Room for arrays that every step fills anew, by name. While its length stays an array is the same object, so that
    tables of arguments (parallel/arguments.py) that have it stay as they are.
    """

    def __init__(self) -> None:
        self._rooms: dict[str, np.ndarray] = {}
        self._some: dict[str, np.ndarray] = {}

    def of(self, name: str, n: int, kind: "type[np.generic]" = np.int64, *columns: int) -> Any:
        """(n, *columns), whatever is in it; of one name always of one type and as many columns."""
        some = self._some.get(name)
        if some is None or n != len(some):
            room = self._rooms.get(name)
            if room is None or n > len(room):
                room = self._rooms[name] = np.empty((n + n // 2, *columns), kind)
            some = self._some[name] = room[:n]
        return some

    def zeros(self, name: str, n: int, *columns: int) -> Any:
        """The same of integers, all zero."""
        some = self.of(name, n, np.int64, *columns)
        some.fill(0)
        return some


def same_memory(one: np.ndarray, two: np.ndarray) -> bool:
    """Whether two arrays of one type, both in C order, are the same one."""
    return one.shape == two.shape and one.__array_interface__["data"] == two.__array_interface__["data"]


class Rooms:
    """The rooms of some columns of a table. What has room for new rows is not copied when it grows."""

    def __init__(self, *names: str) -> None:
        """``names`` of the columns among the attributes of the table."""
        self._rooms: dict[str, np.ndarray | None] = dict.fromkeys(names)

    def of(self, table: object, more: int) -> list[Any]:
        """The rooms, each with a column of ``table`` in front, and place for ``more`` rows behind it at least."""
        for name, room in self._rooms.items():
            column = getattr(table, name)
            n = len(column)
            if room is None or column.base is not room or len(room) < n + more:
                room = self._rooms[name] = np.empty((n + more + (n + more) // 2, *column.shape[1:]), column.dtype)
                room[:n] = column
        return list(self._rooms.values())

    def append(self, table: object, more: int, **rows: Any) -> None:
        """``more`` rows behind the columns of ``table``: of each column an array, or one value for all."""
        for room, name in zip(self.of(table, more), self._rooms, strict=True):
            n = len(getattr(table, name))
            room[n : n + more] = rows[name]
            setattr(table, name, room[: n + more])

    def take(self, table: object, m: int) -> None:
        """Makes the first ``m`` rows of each room the column of ``table``."""
        for name, room in self._rooms.items():
            assert room is not None
            setattr(table, name, room[:m])
