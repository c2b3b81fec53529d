"""Tables that grow by a few rows at a time: their columns stand in rooms that are larger than they are."""

from typing import Any

import numpy as np

from .jit import njit


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

    def take(self, table: object, m: int) -> None:
        """Makes the first ``m`` rows of each room the column of ``table``."""
        for name, room in self._rooms.items():
            assert room is not None
            setattr(table, name, room[:m])


@njit(
    "void(int32[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], int64[:, ::1], int64[::1], "
    "float64[::1], int64)",
    cache=True,
)
def inherit(part, x0, x, v, mass, force, parents, masses, n):  # type: ignore[no-untyped-def]
    """Rows from ``n`` on of rooms of nodal columns: copies of ``parents`` (k,), without force, that take ``masses``
    (k,) of theirs, kg.
    """
    for c in range(len(parents)):
        a = parents[c]
        part[n + c] = part[a]
        for i in range(3):
            x0[n + c, i], x[n + c, i], v[n + c, i], force[n + c, i] = x0[a, i], x[a, i], v[a, i], 0
        mass[n + c] = masses[c]
        mass[a] -= masses[c]
