"""Conversion of a whole model into the bytes of a snapshot (cases/output/snapshot.py), and into the bytes of all tets
for sections.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec.structs import replace

from conoid.cases.output.snapshot import FIELD, Array, Column, Field, Header, pack, size_of

from ..fracture import connectivity
from ..fracture.numbers import numbered
from ..model.state import Floats, Ints, Model
from ..parallel.comm import SerialComm
from . import arrows, decimate, outline, table, volume
from .outline import Outline
from .share import Whole

_VERTEX, _TRIANGLE = 6 + 4, 12 + 2 + 1
"""Number of bytes of a vertex, and number of bytes of a triangle without its fields."""
_HEADER = 200
"""Largest number of bytes that one array adds to the header and to the padding."""
UNITS = {
    "speed": "m/s", "broken_faces": "", "plastic_strain": "", "temperature": "K", "damage": "", "mises": "Pa",
    "pressure": "Pa", "principal_stress": "Pa",
}  # fmt: skip
"""Units of the fields. The field ``broken_faces`` is the fraction of a tet's faces that are broken."""


_PERCENTILES = 0.0, 0.5, 99.5, 100.0
"""Percentiles of the values of a field that are computed. Chosen values: 0.5 % of the values at each end count as
extremes."""


@dataclass(frozen=True)
class Budget:
    """Limits of a snapshot: number of triangles, and number of bytes."""

    triangles: int = 50_000
    bytes: int = 1_000_000


@dataclass(frozen=True)
class Made:
    """Snapshot, and the other fields of its line in the journal."""

    data: bytes
    tets: bytes
    """All tets for sections, in packed form. The packed data is empty if there are no tets, or more than
    ``volume.MOST_TETS``."""
    triangles: int
    fragments: int
    smallest: int
    """First size class of the histogram of fragments (``table.by_size``)."""
    sizes: list[int]
    fields: dict[str, list[float]]
    """Statistics of each field: smallest value, 0.5 percentile, 99.5 percentile, and largest value."""


Births = Callable[[Ints], Floats]
"""Callback that returns (g,) times, s, at which the fragments with the given numbers were formed."""


def made(whole: Whole, stamp: dict[str, Any], births: Births, budget: Budget) -> Made:
    """Return the snapshot of a model. ``stamp``: entries of the header (n, step, t, ranks and walls)."""
    labels = np.concatenate([np.zeros(0, np.int64), *connectivity.labels(whole.model, whole.held, SerialComm())])
    every = table.measured(whole, _numbers(whole, labels))
    columns, row = table.columns(every, births(every.label))
    values, seen = _fields(whole), outline.find(whole.model, every.of)
    room = budget.bytes - _bytes(columns) - arrows.MOST_BYTES - _HEADER * (len(columns) + len(values) + 8)

    def fits(tried: Outline) -> bool:
        each = _TRIANGLE + 1 + len(values)
        return len(tried.tet) <= budget.triangles and _VERTEX * len(tried.points) + each * len(tried.tet) <= room

    drawn = decimate.to_budget(seen, every.mass, budget.triangles, fits)
    velocity = _velocity(whole.model, drawn)
    of = {"speed": _length(velocity), **{name: each[drawn.tet] for name, each in values.items()}}
    fields, levels = _levels(of)
    corners = np.concatenate([np.zeros((0, 4), np.int64), *(b.tets.astype(np.int64) for b in whole.model.blocks)])
    box = _box(whole.model.nodes.x[corners.reshape(-1)])
    header = Header(
        **stamp, box=box, parts=whole.model.parts, tets=whole.model.elements_global, fields=fields,
        surface_triangles=len(seen.tet), fragments_total=len(every.label),
        fragments_listed=min(len(every.label), table.MOST_ROWS),
    )  # fmt: skip
    arrays = _drawn(whole, drawn, row, box) | arrows.chosen(drawn, velocity)
    data = _packed(header, arrays | levels | columns)
    tets = _tets(whole, header, corners, values, row[every.of]) if 0 < len(corners) <= volume.MOST_TETS else b""
    return Made(data, tets, len(drawn.tet), len(every.label), *table.by_size(every.size), _ranges(of))


def _numbers(whole: Whole, labels: Ints) -> Ints:
    """Return (tets,) the number of the fragment of each tet.

    If only erosion can separate bodies, there is no record of fragments. In a case without such a record, the largest
    piece of each part has the number of the part; the number of every other piece is the number of parts plus the index
    of the first tet of the piece.
    """
    if whole.initial:
        return numbered(whole.numbers, labels, whole.next, SerialComm())[0]
    pieces = np.column_stack([_parts(whole.model).astype(np.int64), labels])
    pairs, of, tets = np.unique(pieces, axis=0, return_inverse=True, return_counts=True)
    order = np.lexsort((pairs[:, 1], -tets, pairs[:, 0]))
    largest = order[np.append(True, np.diff(pairs[order, 0]) != 0)[: len(order)]]
    number = pairs[:, 1] + len(whole.model.parts)
    number[largest] = pairs[largest, 0]
    return np.asarray(number[of.reshape(-1)])


def _tets(whole: Whole, header: Header, corners: Ints, values: dict[str, Floats], row: Ints) -> bytes:
    """Return all tets, packed.

    ``corners`` (tets, 4): indices of the nodes of each tet; ``row`` (tets,): row of the fragment of each tet.
    """
    places = _in_box(whole.model.nodes.x, header.box)
    nodes, over, order = volume.ordered(places, corners)
    every = {"speed": volume.speed(whole.model.nodes.v, corners), **values}
    fields, levels = _levels({name: each[order] for name, each in every.items()})
    arrays = {
        "positions": places[nodes], "tet_steps": volume.steps(over), "tet_row": row[order].astype(np.uint16),
        "tet_part": _parts(whole.model)[order],
    }  # fmt: skip
    return volume.packed(_packed(replace(header, fields=fields), arrays | levels))


def _packed(header: Header, arrays: dict[str, "np.ndarray"]) -> bytes:
    return pack(header, {name: _column(values) for name, values in arrays.items()})


def _levels(of: dict[str, Floats]) -> tuple[dict[str, Field], dict[str, "np.ndarray"]]:
    """Return the header entries of fields (m,), and the arrays of the fields."""
    fields, arrays = {}, {}
    for name, values in of.items():
        low, high, arrays[FIELD + name] = _in_bits(values)
        fields[name] = Field(unit=UNITS[name], low=low, high=high)
    return fields, arrays


def _ranges(of: dict[str, Floats]) -> dict[str, list[float]]:
    """Return the statistics of the fields, for the attribute ``Made.fields``."""
    known = {name: values[np.isfinite(values)] for name, values in of.items()}
    return {name: np.percentile(values, _PERCENTILES).tolist() for name, values in known.items() if len(values)}


def _drawn(whole: Whole, drawn: Outline, row: Ints, box: Any) -> dict[str, "np.ndarray"]:
    """Return the arrays of vertices and triangles, without the fields. ``row`` (g,): row of each fragment."""
    return {
        "positions": _in_box(drawn.points, box), "triangles": drawn.triangles.astype(np.uint32),
        "vertex_fragment": row[drawn.fragment].astype(np.uint32), "triangle_rank": whole.rank[drawn.tet],
        "triangle_part": _parts(whole.model)[drawn.tet],
    }  # fmt: skip


def _fields(whole: Whole) -> dict[str, Floats]:
    """Return all fields except the speed, one array (tets,) for each field."""
    values = dict(whole.rows)
    if any(len(block.bond) for block in whole.model.blocks):
        shares = [(b.bond > 0).mean(axis=1) if len(b.bond) else np.zeros(b.n) for b in whole.model.blocks]
        values["broken_faces"] = np.concatenate(shares)
    return values


def _velocity(model: Model, drawn: Outline) -> Floats:
    """Return (m, 3) the velocity of each triangle, m/s, which is the mean velocity of its original nodes."""
    v = model.nodes.v[drawn.faces]
    return np.asarray((v[:, 0] + v[:, 1] + v[:, 2]) / 3.0)


def _length(v: Floats) -> Floats:
    return np.asarray(np.sqrt(v[:, 0] ** 2 + v[:, 1] ** 2 + v[:, 2] ** 2))


def _parts(model: Model) -> "np.ndarray":
    parts = [np.full(block.n, block.part, np.uint8) for block in model.blocks]
    return np.concatenate([np.zeros(0, np.uint8), *parts])


def _box(points: Floats) -> Any:
    """Return the lower and the upper corner of the bounding box of the points."""
    if not len(points):
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return tuple(points.min(axis=0).tolist()), tuple(points.max(axis=0).tolist())


def _in_box(points: Floats, box: Any) -> "np.ndarray":
    """Return (v, 3) positions of points in a box, as uint16 numbers."""
    low, high = np.array(box)
    places = np.rint((points - low) * (65535.0 / np.where(high > low, high - low, 1.0)))
    return np.asarray(np.clip(places, 0, 65535).astype(np.uint16))


def _in_bits(values: Floats) -> tuple[float, float, "np.ndarray"]:
    """Return the lowest value, the highest value, and the values (m,) as uint8 levels between these two."""
    low, high = float(values.min(initial=np.inf)), float(values.max(initial=-np.inf))
    if not low < high:
        return (low, low, np.zeros(len(values), np.uint8)) if len(values) else (0.0, 0.0, np.zeros(0, np.uint8))
    return low, high, np.rint((values - low) * (255.0 / (high - low))).astype(np.uint8)


def _column(values: "np.ndarray") -> Column:
    whole = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    return Column(values.dtype.name, values.shape, whole.tobytes())


def _bytes(columns: dict[str, "np.ndarray"]) -> int:
    made = (Array(dtype=c.dtype.name, shape=list(c.shape), offset=0) for c in columns.values())
    return sum(size_of(array) for array in made)
