"""Kernels that set new rows of columns, and new nodes that are copies of other nodes."""

from ..kernels.jit import njit, types
from ..parallel.arguments import reader

_WIDTH, _VALUE, _IS_COPIED, _SIZE = 2, 3, 4, 40
"""Indices of the words that describe a column (columns.py): bytes of a row, value of each byte of a new row, and flag
for copied rows; and number of bytes of all words of a column."""
_bytes = reader(types.uint8[::1])


@njit("void(int64[:, ::1], int64, int64, int64)", cache=True)
def fill(columns, words, n, more):  # type: ignore[no-untyped-def]
    """Set ``more`` rows, from row ``n`` on, by the rules of the columns. ``words``: address of the table ``columns``
    (c, 5).
    """
    for c in range(len(columns)):
        (room,) = _bytes(words + _SIZE * c)
        width, value = columns[c, _WIDTH], columns[c, _VALUE]
        for i in range(width * n, width * (n + more)):
            room[i] = value


@njit("void(int64[:, ::1], int64, int64[::1], int64[::1])", cache=True)
def copy(columns, words, sources, targets):  # type: ignore[no-untyped-def]
    """Copy the rows ``sources`` to the rows ``targets``, in columns with the rule COPIED."""
    for c in range(len(columns)):
        if not columns[c, _IS_COPIED]:
            continue
        (room,) = _bytes(words + _SIZE * c)
        width = columns[c, _WIDTH]
        for k in range(len(sources)):
            fro, to = width * sources[k], width * targets[k]
            for i in range(width):
                room[to + i] = room[fro + i]


@njit(
    "void(int64[::1], int32[::1], boolean[::1], float64[::1], int64[::1], int64[::1], int32[::1], boolean[::1], "
    "float64[::1], int64)",
    cache=True,
)
def inherit(ids, owner, owned, mass, parents, new_ids, new_owner, new_owned, masses, n):  # type: ignore[no-untyped-def]
    """Set ids, owners and masses of the nodes from ``n`` on, which are copies of the nodes ``parents`` (k,). The mass
    of each copy, ``masses`` (k,), kg, is subtracted from the mass of its parent.
    """
    for c in range(len(parents)):
        ids[n + c], owner[n + c], owned[n + c] = new_ids[c], new_owner[c], new_owned[c]
        mass[n + c] = masses[c]
        mass[parents[c]] -= masses[c]
