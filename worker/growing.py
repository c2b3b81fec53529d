"""Tables that grow by a few rows at a time: their columns stand in rooms that are larger than they are."""

from typing import Any

import numpy as np


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
