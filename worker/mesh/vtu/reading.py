"""Selection of elements from a .vtu file: all volume elements, or the elements with a given value in an array of cells.

Conoid has its own reader. The reader of VTK only prints an error for a damaged file and continues with partial
contents, and meshio ends if an array is unknown.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import MeshError
from ..cells import HEX8, HEX20, PYRAMID5, PYRAMID13, TET4, TET10, WEDGE6, WEDGE15, Cells, Form, Kind, cells
from ..model import Floats, Ids
from ..sets import Named, surface
from ..solid import Content
from .arrays import Grid

_KINDS = {
    10: TET4, 12: HEX8, 13: WEDGE6, 14: PYRAMID5, 24: TET10, 25: HEX20, 26: WEDGE15, 27: PYRAMID13, 11: HEX8,
    29: Kind(Form.HEXAHEDRON, 27),
}  # fmt: skip
"""Numbers of the VTK volume types that are read (vtkCellType.h), and their kinds."""
_FACES = {5: 3, 9: 4, 22: 3, 23: 4, 28: 4, 8: 4}
"""Numbers of the VTK surface types, and the number of corners of each type."""
_EMPTY = frozenset((0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 21, 22, 23, 28, 30, 34, 35, 36))
"""Numbers of the VTK types without volume."""
_VOXEL, _PIXEL = 11, 8
"""Numbers of the VTK types voxel and pixel; the corners of these cells are ordered first by x, then by y, then by z."""
_ORDER = {_VOXEL: [0, 1, 3, 2, 4, 5, 7, 6], _PIXEL: [0, 1, 3, 2]}
_MIRRORED = {6: [0, 2, 1, 3, 5, 4], 15: [0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13]}
"""Order of the nodes of a wedge. In the documentation of VTK the first triangle of a wedge faces outwards, but most
programs write wedges whose first triangle faces inwards."""


def read_vtu(path: Path, group: str | None, key: str) -> Content:
    """Return the volume elements of ``group``, or all volume elements of a .vtu file; also return the sets of the file.

    ``group`` is ``array:value``, or only a value if exactly one array of cells has integers. An integer array of points
    is a set of nodes; the set contains the nodes whose value is not 0. Each value of an array of cells is a surface. In
    messages nodes and elements are numbered from 0. Raises MeshError.
    """
    grid = Grid(path)
    n, m = grid.points_count, grid.cells_count
    points = grid.array("Points", None, 3 * n, "f").astype(np.float64).reshape(-1, 3)
    types = grid.array("Cells", "types", m, "i").astype(np.int64)
    ends = grid.array("Cells", "offsets", m, "i").astype(np.int64)
    nodes = grid.array("Cells", "connectivity", int(ends[-1]) if m else 0, "i").astype(np.int64)
    _refuse_wild(ends, nodes, n)
    values = dict(grid.whole("CellData", m))
    chosen = np.ones(m, bool) if group is None else _chosen(values, group, key)
    volumes = ~np.isin(types, sorted(_EMPTY))
    strange = np.flatnonzero(chosen & volumes & ~np.isin(types, sorted(_KINDS)))
    if len(strange):
        raise MeshError(f"cell {strange[0]} has the type {types[strange[0]]} of VTK, which is not read")
    rows = list(_rows(types, ends, nodes, chosen & volumes, _KINDS, points))
    named = [*_sets(grid, n), *_surfaces(types, ends, nodes, values)]
    return Content(np.arange(n), points, rows, named, tuple(_notes(types, chosen)))


def _refuse_wild(ends: Ids, nodes: Ids, n: int) -> None:
    if len(ends) and (np.diff(ends, prepend=0) < 1).any():
        raise MeshError("the file is damaged: the offsets of its cells do not ascend")
    wild = np.flatnonzero((nodes < 0) | (nodes >= n))
    if len(wild):
        cell = int(np.searchsorted(ends, wild[0], side="right"))
        raise MeshError(f"cell {cell} uses node {nodes[wild[0]]}, which is not defined")


def _chosen(values: dict[str, NDArray[np.int64]], group: str, key: str) -> NDArray[np.bool_]:
    array, _, value = group.rpartition(":")
    if not array and len(values) == 1:
        array = next(iter(values))
    if array not in values or not value.removeprefix("-").isdecimal() or not (values[array] == int(value)).any():
        known = [f"{name}:{each}" for name, of in values.items() for each in np.unique(of)[:20]]
        raise MeshError(f"{key}.group = {group!r}: no cells with such a value; known: {', '.join(known) or 'none'}")
    return np.asarray(values[array] == int(value))


def _rows(
    types: Ids, ends: Ids, nodes: Ids, chosen: NDArray[np.bool_], kinds: dict[int, Kind], points: Floats
) -> Iterator[Cells]:
    for kind in np.unique(types[chosen]).tolist():
        some = np.flatnonzero(chosen & (types == kind))
        corners = _of(ends, nodes, some, kinds[kind].nodes, kind)
        if kinds[kind].form is Form.WEDGE and _all_inverted(corners, points):
            corners = corners[:, _MIRRORED[kinds[kind].nodes]]
        yield cells(kinds[kind], some, corners)


def _of(ends: Ids, nodes: Ids, some: Ids, size: int, kind: int) -> Ids:
    """Return (k, size) nodes of the cells of one type. Raises MeshError if a cell has a wrong number of nodes."""
    sizes = np.diff(ends, prepend=0)[some]
    if (sizes != size).any():
        k = np.flatnonzero(sizes != size)[0]
        raise MeshError(f"cell {some[k]} of the type {kind} of VTK has {sizes[k]} nodes; expected {size}")
    found = nodes[(ends[some] - size)[:, None] + np.arange(size)]
    return np.asarray(found[:, _ORDER[kind]] if kind in _ORDER else found, np.int64)


def _all_inverted(wedges: Ids, points: Floats) -> bool:
    a, b, c, d = (points[wedges[:, k]] for k in range(4))
    return bool(((np.cross(b - a, c - a) * (d - a)).sum(axis=1) < 0).all())


def _sets(grid: Grid, n: int) -> Iterator[Named]:
    for name, values in grid.whole("PointData", n):
        yield Named((name,), np.flatnonzero(values).astype(np.int64))


def _surfaces(types: Ids, ends: Ids, nodes: Ids, values: dict[str, NDArray[np.int64]]) -> Iterator[Named]:
    flat = np.isin(types, sorted(_FACES))
    for array, of in values.items():
        for value in np.unique(of[flat]).tolist():
            faces = []
            for kind, size in _FACES.items():
                some = np.flatnonzero(flat & (of == value) & (types == kind))
                sizes = np.diff(ends, prepend=0)[some]
                if len(some) and (sizes < size).any():
                    raise MeshError(f"cell {some[0]} of the type {kind} of VTK has {sizes[0]} nodes")
                first = nodes[(ends[some] - sizes)[:, None] + np.arange(size)]
                faces.append(first[:, _ORDER[kind]] if kind in _ORDER else first)
            words = (f"{array}:{value}", *([str(value)] if len(values) == 1 else []))
            yield surface(words, faces)


def _notes(types: Ids, chosen: NDArray[np.bool_]) -> Iterator[str]:
    kinds, counts = np.unique(types[chosen & np.isin(types, sorted(_EMPTY))], return_counts=True)
    if len(kinds):
        listed = ", ".join(f"{many} of the type {kind}" for kind, many in zip(kinds, counts, strict=True))
        yield f"cells that carry no volume are skipped: {listed} of VTK"
    others, counts = np.unique(types[~chosen & ~np.isin(types, sorted(_EMPTY | set(_KINDS)))], return_counts=True)
    if len(others):
        listed = ", ".join(f"{many} of the type {kind}" for kind, many in zip(others, counts, strict=True))
        yield f"cells that cannot be read are outside of the group: {listed} of VTK"
