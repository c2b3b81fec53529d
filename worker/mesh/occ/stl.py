"""Reader of STL files, text and binary. A file has closed surfaces of triangles that face outwards; two triangles may
have only edges and corners in common.
"""

import struct
from pathlib import Path

import numpy as np

from ...errors import MeshError
from ..model import Floats
from .crossing import crossing
from .shells import Surface, Triangles, astray, shells

MOST_FACETS = 1_000_000
"""Largest number of facets. Chosen value: the search for crossing facets takes a minute."""
_HEAD, _FACET = 84, 50
"""Number of bytes of a binary STL file before its facets, and number of bytes of each facet."""


def read_stl(path: Path, head: str) -> Surface:
    """Return the surface in a file. Raises MeshError, with a message that begins with ``head``, if the surface
    encloses no volume or is damaged.
    """
    try:
        data = path.read_bytes() if path.stat().st_size <= _HEAD + _FACET * 6 * MOST_FACETS else b""
    except OSError as error:
        raise MeshError(f"{head}: {error.strerror}") from error
    corners = _binary(data, head) if _is_binary(data) else _text(data, head)
    if len(corners) > MOST_FACETS:
        raise MeshError(f"{head}: {len(corners):,} facets are too many; allowed: up to {MOST_FACETS:,}")
    if not np.isfinite(corners).all():
        raise MeshError(f"{head}: a coordinate of the STL file is not finite")
    points, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3).astype(np.int64)
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    _refuse_open(points, faces, head)
    made = Surface(points, faces, shells(len(points), faces))
    if not made.volume() > 0.0:
        raise MeshError(
            f"{head}: the facets of the STL file face inwards; reverse the order of the corners of all facets"
        )
    if len(pairs := crossing(points, faces)):
        at = _place(points[faces[pairs[0, 0]]].mean(axis=0))
        raise MeshError(f"{head}: the surface crosses or touches itself: {len(pairs):,} pairs of facets, one at ({at})")
    if (place := astray(made)) is not None:
        raise MeshError(f"{head}: its closed surfaces overlap each other, for example at ({_place(place)})")
    return made


def _is_binary(data: bytes) -> bool:
    """Return True if an STL file is binary.

    The test uses the size of the file, or bytes that no text has. The first word of the file is not sufficient for the
    test, because the head of a binary file may also begin with ``solid``.
    """
    if len(data) < _HEAD:
        return False
    sized = len(data) == _HEAD + _FACET * struct.unpack_from("<I", data, 80)[0]
    return sized or b"\0" in data or data.lstrip()[:5].lower() != b"solid"


def _binary(data: bytes, head: str) -> Floats:
    count = struct.unpack_from("<I", data, 80)[0]
    if len(data) != _HEAD + _FACET * count:
        should = f"{count:,} facets take {_HEAD + _FACET * count:,} bytes, and the file has {len(data):,}"
        raise MeshError(f"{head}: the binary STL file is cut off, or is no STL file: {should}")
    layout = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    return np.frombuffer(data, layout, offset=_HEAD)["corners"].astype(np.float64)


def _text(data: bytes, head: str) -> Floats:
    words = data.split()
    if not words or words[0].lower() != b"solid":
        raise MeshError(f"{head}: no STL file: a text begins with solid, a binary file has a whole number of facets")
    if b"endsolid" not in (word.lower() for word in words[-200:]):
        raise MeshError(f"{head}: the STL file is cut off: it does not end with endsolid")
    at = [n for n, word in enumerate(words) if word == b"vertex" or word == b"VERTEX"]
    try:
        numbers = np.array([[float(words[n + k]) for k in (1, 2, 3)] for n in at], np.float64)
    except (ValueError, IndexError) as error:
        raise MeshError(f"{head}: a corner in the STL file does not have three numbers ({error})") from error
    if len(numbers) % 3 or not len(numbers):
        raise MeshError(f"{head}: {len(numbers)} corners in the STL file do not make triangles")
    return numbers.reshape(-1, 3, 3)


def _refuse_open(points: Floats, faces: Triangles, head: str) -> None:
    """Raise MeshError unless each edge belongs to exactly two facets, which run through the edge in opposite
    directions.
    """
    if not len(faces):
        raise MeshError(f"{head}: the STL file has no facet")
    same = np.unique(np.sort(faces, axis=1), axis=0, return_counts=True)[1]
    if (same > 1).any():
        raise MeshError(f"{head}: {int((same > 1).sum()):,} facets of the STL file occur more than once")
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    pairs, group, many = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    along = np.bincount(group.reshape(-1), np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
    for wrong, what in (
        (many == 1, "the surface has a hole: {} edges belong to one facet"),
        (many > 2, "{} edges belong to more than two facets"),
        (along != 0.0, "facets are flipped: {} edges have facets that face opposite ways"),
    ):
        if wrong.any():
            ends = " - ".join(f"({_place(points[p])})" for p in pairs[np.argmax(wrong)])
            raise MeshError(f"{head}: {what.format(f'{int(wrong.sum()):,}')}, one of them {ends}")


def _place(point: Floats) -> str:
    return ", ".join(f"{x:.6g}" for x in point)
