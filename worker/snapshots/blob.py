"""From a whole model to the bytes of a snapshot (cases/snapshot.py)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from conoid.cases.snapshot import FIELD, Array, Column, Field, Header, pack, size_of

from ..fracture import connectivity
from ..fracture.numbers import numbered
from ..parallel.comm import SerialComm
from ..state import Floats, Ints, Model
from . import decimate, outline, table
from .outline import Outline
from .share import Whole

_VERTEX, _TRIANGLE = 6 + 4, 12 + 2 + 1
"""Bytes of a vertex, and of a triangle without its fields."""
_HEADER = 200
"""Bytes that an array takes in the header and in filling up, at most."""
UNITS = {"speed": "m/s", "broken_faces": "", "plastic_strain": "", "temperature": "K", "damage": ""}
"""Fields, and their units. ``broken_faces`` is the share of a tet's faces that have broken."""


@dataclass(frozen=True)
class Budget:
    """What a snapshot may hold: triangles, and bytes."""

    triangles: int = 50_000
    bytes: int = 1_000_000


@dataclass(frozen=True)
class Made:
    """A snapshot, and what its journal line says besides."""

    data: bytes
    triangles: int
    fragments: int
    smallest: int
    """See ``table.by_size``, as the next."""
    sizes: list[int]


Births = Callable[[Ints], Floats]
"""(g,) times of birth, s, of fragments with these numbers."""


def made(whole: Whole, told: dict[str, Any], births: Births, budget: Budget) -> Made:
    """The snapshot of a model. ``told``: n, step, t and ranks for the header."""
    labels = np.concatenate([np.zeros(0, np.int64), *connectivity.labels(whole.model, whole.held, SerialComm())])
    every = table.measured(whole, numbered(whole.numbers, labels, whole.next, SerialComm())[0])
    columns, row = table.columns(every, births(every.label))
    values, seen = _fields(whole), outline.find(whole.model, every.of)
    room = budget.bytes - _bytes(columns) - _HEADER * (len(columns) + len(values) + 6)

    def fits(tried: Outline) -> bool:
        each = _TRIANGLE + 1 + len(values)
        return len(tried.tet) <= budget.triangles and _VERTEX * len(tried.points) + each * len(tried.tet) <= room

    drawn = decimate.to_budget(seen, every.mass, budget.triangles, fits)
    box, arrays = _drawn(whole, drawn, row)
    fields = {}
    for name, of in {"speed": _speed(whole.model, drawn), **{n: v[drawn.tet] for n, v in values.items()}}.items():
        low, high, arrays[FIELD + name] = _in_bits(of)
        fields[name] = Field(unit=UNITS[name], low=low, high=high)
    header = Header(
        **told, box=box, parts=whole.model.parts, tets=whole.model.elements_global, fields=fields,
        surface_triangles=len(seen.tet), fragments_total=len(every.label),
        fragments_listed=min(len(every.label), table.MOST_ROWS),
    )  # fmt: skip
    data = pack(header, {name: _column(values) for name, values in (arrays | columns).items()})
    return Made(data, len(drawn.tet), len(every.label), *table.by_size(every.size))


def _drawn(whole: Whole, drawn: Outline, row: Ints) -> tuple[Any, dict[str, "np.ndarray"]]:
    """The box, and the arrays of vertices and triangles but the fields; ``row`` (g,): of each fragment."""
    box, positions = _in_box(drawn.points)
    return box, {
        "positions": positions, "triangles": drawn.triangles.astype(np.uint32),
        "vertex_fragment": row[drawn.fragment].astype(np.uint32), "triangle_rank": whole.rank[drawn.tet],
        "triangle_part": _parts(whole.model)[drawn.tet],
    }  # fmt: skip


def _fields(whole: Whole) -> dict[str, Floats]:
    """(tets,) of each field but the speed."""
    values = dict(whole.rows)
    if any(len(block.bond) for block in whole.model.blocks):
        shares = [(b.bond > 0).mean(axis=1) if len(b.bond) else np.zeros(b.n) for b in whole.model.blocks]
        values["broken_faces"] = np.concatenate(shares)
    return values


def _speed(model: Model, drawn: Outline) -> Floats:
    """(m,) of the mean velocity of the nodes that a triangle had at first, m/s."""
    v = model.nodes.v[drawn.faces]
    mean = (v[:, 0] + v[:, 1] + v[:, 2]) / 3.0
    return np.asarray(np.sqrt(mean[:, 0] ** 2 + mean[:, 1] ** 2 + mean[:, 2] ** 2))


def _parts(model: Model) -> "np.ndarray":
    parts = [np.full(block.n, block.part, np.uint8) for block in model.blocks]
    return np.concatenate([np.zeros(0, np.uint8), *parts])


def _in_box(points: Floats) -> tuple[Any, "np.ndarray"]:
    """Low and high corner of the box round the points, and (v, 3) uint16 places in it."""
    if not len(points):
        return ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), np.zeros((0, 3), np.uint16)
    low, high = points.min(axis=0), points.max(axis=0)
    places = np.rint((points - low) * (65535.0 / np.where(high > low, high - low, 1.0)))
    return (tuple(low.tolist()), tuple(high.tolist())), np.clip(places, 0, 65535).astype(np.uint16)


def _in_bits(values: Floats) -> tuple[float, float, "np.ndarray"]:
    """The lowest and highest of values (m,), and uint8 levels between them."""
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
