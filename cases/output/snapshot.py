"""A snapshot: the surface and the table of the fragments of a run as one sequence of bytes, the same in a file, over
Zenoh and over HTTP.

::

    bytes  0 to  7    CONOSNAP
           8 to 11    version, uint32
          12 to 15    H, the length of the header, uint32
          16 to 16+H  the header, JSON, padded with spaces
          from there  the arrays, each at a multiple of 8 given in the header; little-endian

Each vertex belongs to exactly one fragment, so that a program can draw the fragments apart from each other. The page
``docs/reference/snapshots.md`` describes the arrays.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import msgspec

MAGIC = b"CONOSNAP"
VERSION = 1
"""Version of the layout of snapshots. A reader refuses other versions."""
TYPES = {"uint8": "B", "uint16": "H", "uint32": "I", "int64": "q", "float32": "f", "float64": "d"}
"""Types of arrays, and the letters of the types in Python's module ``struct``."""
REST = -1
"""Value of ``fragment_id`` in the last row of the table if this row is the sum of all fragments that have no row."""
FIELD = "field:"
"""Prefix of the names of field arrays."""
_START = 16
"""Number of bytes before the header."""
_FAR = 1 << 40
"""An offset with more digits than any real offset; the header with this value is the longest possible."""


class Field(msgspec.Struct, kw_only=True, frozen=True):
    """A field over the triangles, stored in 8 bits: 0 means the value ``low``, 255 means the value ``high``."""

    unit: str
    low: float
    high: float


class Array(msgspec.Struct, kw_only=True, frozen=True):
    """An array of a snapshot. ``offset``: position in bytes, from the beginning of the snapshot."""

    dtype: str
    shape: list[int]
    offset: int


class Header(msgspec.Struct, kw_only=True, frozen=True):
    """The header of a snapshot. The simulated time ``t`` is in s, ``box`` in m."""

    n: int
    step: int
    t: float
    box: tuple[tuple[float, float, float], tuple[float, float, float]]
    """Two corners of a box; the values 0 and 65535 of ``positions`` mean the low and the high corner."""
    ranks: int
    parts: list[str]
    tets: int
    """Number of tets of the whole model."""
    surface_triangles: int
    """Number of triangles of the surface before some were merged or omitted."""
    fragments_total: int
    fragments_listed: int
    """Number of rows of the table, without the last row if that row is the sum of other fragments."""
    fields: dict[str, Field]
    walls: list[tuple[float, float, float]] = []
    """Positions of the walls of the case, m; empty if no wall moves."""
    arrays: dict[str, Array] = {}


@dataclass(frozen=True)
class Column:
    """An array that is to be written: its type (a key of ``TYPES``), its shape, and its bytes in C order."""

    dtype: str
    shape: tuple[int, ...]
    data: bytes | memoryview


_decoder = msgspec.json.Decoder(Header)


def pack(header: Header, columns: Mapping[str, Column]) -> bytes:
    """Returns the bytes of a snapshot, and fills in ``header.arrays``."""
    places = {name: Array(dtype=c.dtype, shape=list(c.shape), offset=_FAR) for name, c in columns.items()}
    room = _rounded(len(_encoded(header, places)))
    blob, size = [], _START + room
    for name, column in columns.items():
        data = bytes(column.data)
        places[name] = msgspec.structs.replace(places[name], offset=size)
        blob.append(data.ljust(_rounded(len(data)), b"\0"))
        size += len(blob[-1])
    text = _encoded(header, places).ljust(room)
    return b"".join([MAGIC, VERSION.to_bytes(4, "little"), room.to_bytes(4, "little"), text, *blob])


def header_of(blob: bytes | memoryview, size: int | None = None) -> Header:
    """Returns the header of a snapshot. ``blob``: the snapshot or its beginning; ``size``: number of bytes of the whole
    snapshot if ``blob`` is only its beginning. Raises ValueError if the bytes are no snapshot, or an incomplete one.
    """
    data = memoryview(blob)
    size = len(data) if size is None else size
    if bytes(data[:8]) != MAGIC:
        raise ValueError("not a snapshot: it does not begin with CONOSNAP")
    version, room = (int.from_bytes(data[at : at + 4], "little") for at in (8, 12))
    if version != VERSION:
        raise ValueError(f"a snapshot of version {version}; known: {VERSION}")
    try:
        header = _decoder.decode(data[_START : _START + room])
    except msgspec.MsgspecError as error:
        raise ValueError(f"the header of the snapshot cannot be read: {error}") from None
    for name, array in header.arrays.items():
        if array.dtype not in TYPES or array.offset % 8 or array.offset + size_of(array) > size:
            raise ValueError(f"the snapshot has no whole array {name!r}")
    return header


def view(blob: bytes | memoryview, array: Array) -> memoryview:
    """Returns one array of a snapshot as a flat array without copying it, on little-endian machines."""
    flat: memoryview = memoryview(blob)[array.offset : array.offset + size_of(array)]
    return flat.cast(TYPES[array.dtype])  # type: ignore[call-overload, no-any-return]


def size_of(array: Array) -> int:
    """Size of an array in bytes."""
    items = 1
    for length in array.shape:
        items *= length
    return items * int("".join(digit for digit in array.dtype if digit.isdigit())) // 8


def _encoded(header: Header, places: dict[str, Array]) -> bytes:
    return msgspec.json.encode(msgspec.structs.replace(header, arrays=places))


def _rounded(size: int) -> int:
    return -(-size // 8) * 8
