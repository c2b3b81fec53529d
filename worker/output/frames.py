"""Frames. Each frame is one VTKHDF file (version 2.3, UnstructuredGrid), which can be read during the run.

A file is written under a temporary name, flushed to disk and renamed, so a visible file is complete.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from conoid.cases.output import layout

from ..model.rows import PLASTIC_STRAIN, PRESSURE, S_XX, S_XY, TEMPERATURE
from ..model.state import CHUNK, Block, Floats, Ints, Model
from ..parallel.comm import Comm
from ..scene.marks import held
from . import fields, hdf5

_TETRA = 10
"""Cell type VTK_TETRA (vtkCellType.h)."""
_PACKING = {"compression": "gzip", "compression_opts": 1, "shuffle": True}


def von_mises(deviator: Floats) -> Floats:
    """Return sqrt(3/2 s : s) of deviatoric stresses (6, n) in the order xx, yy, zz, yz, zx, xy."""
    squares = (deviator[:3] ** 2).sum(axis=0) + 2.0 * (deviator[3:] ** 2).sum(axis=0)
    mises: Floats = np.sqrt(1.5 * squares)
    return mises


UNITS = {
    "velocity": "m/s", "displacement": "m", "pressure": "Pa", "mises": "Pa", "stress": "Pa", "principal_stress": "Pa",
    "temperature": "K", "plastic_strain": "1", "damage": "1", "density": "kg/m^3", "strain": "1",
    "effective_strain": "1", "strain_rate": "1/s", "contact_pressure": "Pa",
}  # fmt: skip
"""Units of the fields. The unit of a field is the attribute ``unit`` of its data set. Fields that are names or numbers
have no unit."""
_NOTHING = fields.Wanted()
_ORDER = [0, 1, 2, 5, 3, 4]
"""Indices of the components xx, yy, zz, xy, yz, zx (the order of VTK) among the components of the state
(CONVENTIONS.md)."""


def principal(stress: Floats) -> Floats:
    """Return (n,) the largest principal values of stresses (n, 6), whose components are in the order of VTK."""
    xx, yy, zz, xy, yz, zx = stress.T
    matrices = np.stack([xx, xy, zx, xy, yy, yz, zx, yz, zz], axis=1).reshape(-1, 3, 3)
    values: Floats = np.linalg.eigvalsh(np.where(np.isfinite(matrices), matrices, 0.0))[:, 2]
    return values


def _cells(block: Block, rank: int, fragment: Ints | None, damage: Floats | None) -> dict[str, Any]:
    deviator = np.array([block.row(row) for row in range(S_XX, S_XY + 1)])
    stress = deviator[_ORDER].T.copy()
    stress[:, :3] -= block.row(PRESSURE)[:, None]
    strain = block.row(PLASTIC_STRAIN) if block.has(PLASTIC_STRAIN) else np.zeros(block.n)
    temperature = block.row(TEMPERATURE) if block.has(TEMPERATURE) else np.full(block.n, block.temperature)
    cells = {
        "part": np.full(block.n, block.part, np.int32),
        "rank": np.full(block.n, rank, np.int32),
        "tet": block.id,
        "pressure": block.row(PRESSURE).astype(np.float32),
        "mises": von_mises(deviator).astype(np.float32),
        "stress": stress.astype(np.float32),
        "principal_stress": principal(stress).astype(np.float32),
        "plastic_strain": strain.astype(np.float32),
        "temperature": temperature.astype(np.float32),
    }
    cells |= {} if damage is None else {"damage": damage.astype(np.float32)}
    return cells if fragment is None else {**cells, "fragment": fragment}


def _share(
    model: Model, rank: int, labels: list[Ints] | None, damage: list[Floats] | None, wanted: fields.Wanted
) -> dict[str, Any]:
    """Return the data of a frame that this rank writes."""
    nodes = model.nodes
    cells = [
        _cells(block, rank, None if labels is None else each, None if damage is None else share)
        | {name: own.astype(np.float32) for name, own in fields.of_tets(wanted.names, block, nodes).items()}
        for block, each, share in _by_block(model, labels, damage)
    ]
    return {
        "ids": nodes.id,
        "points": nodes.x,
        "velocity": nodes.v.astype(np.float32),
        "displacement": (nodes.x - nodes.x0).astype(np.float32),
        "impulses": wanted.impulses,
        "sets": {name: held(nodes.marks, bit).astype(np.uint8) for name, bit in wanted.sets.items()},
        "tets": np.concatenate([nodes.id[b.tets] for b in model.blocks] or [np.zeros((0, 4), np.int64)]),
        "cells": {name: np.concatenate([c[name] for c in cells]) for name in cells[0]},
    }


def _by_block(
    model: Model, labels: list[Ints] | None, damage: list[Floats] | None
) -> Iterator[tuple[Block, Ints, Floats]]:  # fmt: skip
    """Yield each block with the fragments and the damage of its tets. A rank without tets yields an empty block, so
    that every rank has all columns.
    """
    none: tuple[Ints, Floats] = np.zeros(0, np.int64), np.zeros(0)
    if not model.blocks:
        state = np.zeros((0, PRESSURE + 1, CHUNK))
        yield Block(0, 0, np.zeros((0, 4), np.uint32), none[0], state, 0, 0, none[1]), *none
    for b, block in enumerate(model.blocks):
        yield block, labels[b] if labels else none[0], damage[b] if damage else none[1]


def write(
    folder: Path, index: int, t: float, model: Model, comm: Comm, labels: list[Ints] | None = None,
    damage: list[Floats] | None = None, wanted: fields.Wanted = _NOTHING,
) -> str | None:  # fmt: skip
    """Write frame ``index``. Return the path of its file, relative to the run's folder, on rank 0; None on other ranks.
    Collective.

    ``labels``: for each block the fragment of each tet, or None; ``damage``: for each block the damage of each tet, or
    None; ``wanted``: further fields.
    """
    pieces = comm.gather(_share(model, comm.rank, labels, damage, wanted))
    if pieces is None:
        return None
    path = layout.frame(folder, index)
    path.parent.mkdir(exist_ok=True)
    beside = path.with_suffix(".part")
    with hdf5.created(beside) as file:
        _write_grid(file, pieces, model.nodes_global, wanted.passed)
        file.attrs["time"], file.attrs["time_unit"] = t, "s"
        file["VTKHDF/FieldData/time"] = np.array([t])
        file["VTKHDF/FieldData/time"].attrs["unit"] = "s"
        if wanted.walls is not None:
            file["VTKHDF/FieldData/wall_position"] = wanted.walls
            file["VTKHDF/FieldData/wall_position"].attrs["unit"] = "m"
    beside.rename(path)
    _append_series(path, t)
    return str(path.relative_to(folder))


def _write_grid(file: "h5py.File", pieces: list[dict[str, Any]], total: int, passed: float) -> None:
    root = file.create_group("VTKHDF", track_order=True)
    root.attrs["Version"] = (2, 3)
    root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", 16))
    point_data = {name: _by_id(pieces, name, total) for name in ("points", "velocity", "displacement")}
    cells = {name: np.concatenate([p["cells"][name] for p in pieces]) for name in pieces[0]["cells"]}
    order = np.argsort(cells["tet"])
    tets = np.concatenate([p["tets"] for p in pieces])[order]
    n = len(tets)
    if pieces[0]["impulses"] is not None:
        impulses = _by_id(pieces, "impulses", total)
        pressure = fields.contact_pressure(point_data["points"], tets, impulses, passed)
        point_data["contact_pressure"] = pressure.astype(np.float32)
    root["NumberOfPoints"], root["NumberOfCells"] = np.array([total]), np.array([n])
    root["NumberOfConnectivityIds"] = np.array([4 * n])
    root.create_dataset("Points", data=point_data.pop("points"), **_PACKING).attrs["unit"] = "m"
    root.create_dataset("Connectivity", data=tets.reshape(-1), **_PACKING)
    root.create_dataset("Offsets", data=np.arange(0, 4 * n + 1, 4), **_PACKING)
    root.create_dataset("Types", data=np.full(n, _TETRA, np.uint8), **_PACKING)
    for name, values in (point_data | _sets(pieces, total)).items():
        _add(root, f"PointData/{name}", values)
    for name, values in cells.items():
        _add(root, f"CellData/{name}", values[order])


def _add(root: "h5py.Group", path: str, values: "np.ndarray") -> None:
    """Write a field with its unit, and the components of a tensor."""
    name, stored = path.partition("/")[2], root.create_dataset(path, data=values, **_PACKING)
    if name in UNITS:
        stored.attrs["unit"] = UNITS[name]
    if name in ("stress", "strain"):
        stored.attrs["components"] = "xx yy zz xy yz zx"


def _by_id(pieces: list[dict[str, Any]], name: str, total: int) -> "np.ndarray":
    values = np.empty((total, 3), pieces[0][name].dtype)
    for piece in pieces:
        values[piece["ids"]] = piece[name]
    return values


def _sets(pieces: list[dict[str, Any]], total: int) -> dict[str, "np.ndarray"]:
    """Return a dictionary from the name of the array of each set to an array (nodes,). A value is 1 if the node is in
    the set, else 0.
    """
    found = {name: np.zeros(total, np.uint8) for name in pieces[0]["sets"]}
    for piece in pieces:
        for name, values in found.items():
            values[piece["ids"]] = piece["sets"][name]
    return found


def _append_series(path: Path, t: float) -> None:
    series = path.parent / layout.FRAME_SERIES
    known = json.loads(series.read_text())["files"] if series.exists() else []
    files = [f for f in known if f["name"] != path.name] + [{"name": path.name, "time": t}]
    content = {"file-series-version": "1.0", "files": files}
    beside = series.with_suffix(".part")
    beside.write_text(json.dumps(content, indent=1))
    beside.rename(series)
