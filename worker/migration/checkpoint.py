"""Checkpoints. A checkpoint is a folder with one file for each rank and a manifest. The folder is on disk completely or
not at all.

::

    checkpoints/000001200/rank-0.h5 ...   state of each rank: columns of nodes, tets and other things, by global ids
                          manifest.json   step, time, the case, state common to all ranks, bytes and sha256 of each file

The folder is written under a temporary name, flushed to disk and renamed. Any number of ranks can read it. The
conditions of a complete checkpoint are in conoid.cases.output.checkpoints.
"""

import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from conoid.cases.load import resolved_json
from conoid.cases.model.schema import Case
from conoid.cases.output import layout
from conoid.cases.output.checkpoints import (
    FORMAT,
    MANIFEST,
    SEAL,
    DamagedError,
    File,
    Manifest,
    check_bytes,
    found,
    manifest_of,
    sealed,
    sha256,
)
from conoid.cases.reading.problems import Location, problem, shown

from ..errors import InputError
from ..output import hdf5
from ..parallel.comm import Comm
from .parcel import Parcel, Table, take

_KEPT = 2
"""Number of checkpoints that are kept. Chosen value: one more than the latest checkpoint, which may be damaged."""
_FREE = {
    "run": {
        "ranks", "threads", "profile", "cut_scale", "max_steps", "max_wall_time", "checkpoint_every", "residual_limit",
        "made_limit", "snapshots",
    },
    "contact": {"skin", "domain"},
}  # fmt: skip
"""Keys that may change when a run is resumed, because the answer does not depend on them."""


def write(parcel: Parcel, case: Case, folder: Path, step: int, t: float, comm: Comm) -> tuple[Path, int]:
    """Write a checkpoint of the run to ``folder``. Return the folder of the checkpoint and its number of bytes.

    Collective.
    """
    place = layout.checkpoint(folder, step)
    beside = place.with_suffix(".part")
    if comm.rank == 0:
        shutil.rmtree(beside, ignore_errors=True)
        beside.mkdir(parents=True)
    comm.barrier()
    path = beside / f"rank-{comm.rank}.h5"
    _write_parcel(path, parcel)
    files = comm.gather(File(path.name, path.stat().st_size, sha256(path)))
    total = 0
    if files is not None:
        total = sum(file.bytes for file in files)
        known, data = _plain(parcel.known), json.loads(resolved_json(case))
        _describe(beside, Manifest(FORMAT, step, t, data, files, known))
        shutil.rmtree(place, ignore_errors=True)
        beside.rename(place)
        _flush_folder(place.parent)
        for old in found(folder)[_KEPT:]:
            shutil.rmtree(old, ignore_errors=True)
    return place, int(comm.broadcast(total))


def _describe(beside: Path, manifest: Manifest) -> None:
    """Write the manifest and its sha256, and flush them to disk."""
    for name, content in zip((MANIFEST, SEAL), sealed(manifest), strict=True):
        with (beside / name).open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())


def forget(folder: Path, step: int = -1) -> None:
    """Remove the checkpoints of ``folder`` after the step ``step``, and unfinished checkpoints. Without a step all
    checkpoints are removed.
    """
    if step < 0:
        shutil.rmtree(folder / layout.CHECKPOINTS, ignore_errors=True)
    kept = {place.name for place in found(folder) if int(place.name) <= step}
    for place in (folder / layout.CHECKPOINTS).glob("*"):
        if place.name not in kept:
            shutil.rmtree(place, ignore_errors=True)


def latest(folder: Path) -> tuple[Path, Manifest, list[str]]:
    """Return the latest complete checkpoint and its manifest. Also return a message for each later checkpoint, because
    such a checkpoint is damaged.

    Raises InputError if no checkpoint is complete.
    """
    damaged: list[str] = []
    for place in found(folder):
        try:
            manifest = manifest_of(place)
            check_bytes(place, manifest)
        except DamagedError as error:
            damaged.append(f"checkpoint {place.name} is damaged: {error}")
        else:
            return place, manifest, damaged
    why = "; ".join(damaged) or "there is none"
    raise InputError(f"--restart: {folder} has no complete checkpoint: {why}")


def require_same(case: Case, manifest: Manifest) -> None:
    """Raise InputError if the case differs from the case of the checkpoint in a key on which the answer depends. Raise
    InputError also if the case allows no further step."""
    now, then = (_answering(data) for data in (json.loads(resolved_json(case)), manifest.case))
    for location, value, former in _differences(now, then, ()):
        was = "does not have" if former is ... else f"has {shown(former)} in"
        message = f"the case of the checkpoint {was} this key; --restart resumes this case"
        raise InputError(str(problem(location, value, message)))
    if case.run.max_steps <= manifest.step:
        message = f"the checkpoint has {manifest.step} steps; set a number above {manifest.step}"
        raise InputError(str(problem(("run", "max_steps"), case.run.max_steps, message)))


def _differences(now: Any, then: Any, location: Location) -> Iterator[tuple[Location, object, object]]:
    """Yield the location and the two values of each key that differs between two cases. The value of a missing key is
    Ellipsis.
    """
    if isinstance(now, dict) and isinstance(then, dict):
        for key in sorted({*now, *then}):
            yield from _differences(now.get(key, ...), then.get(key, ...), (*location, key))
    elif isinstance(now, list) and isinstance(then, list) and len(now) == len(then):
        for k, pair in enumerate(zip(now, then, strict=True)):
            yield from _differences(*pair, (*location, k))
    elif now != then:
        yield location, now, then


def _answering(case: dict[str, Any]) -> dict[str, Any]:
    """Return the keys of a case on which the answer of the run depends."""
    found = {key: value for key, value in case.items() if key not in ("balance", "title", "description")}
    for table, free in _FREE.items():
        if isinstance(keys := found.get(table), dict):
            found[table] = {key: value for key, value in keys.items() if key not in free}
    return found


def read(place: Path, manifest: Manifest, comm: Comm) -> Parcel:
    """Return the data of a checkpoint that this rank reads: the contents of some of its files, or empty tables."""
    names = [file.name for file in manifest.files]
    mine = [_read_parcel(place / name) for name in names[comm.rank :: comm.size]]
    whole = Parcel.of(mine or [_nothing_of(_read_parcel(place / names[0]))])
    whole.known = _rich(manifest.known)
    return whole


def _nothing_of(parcel: Parcel) -> Parcel:
    """Return a parcel with all columns and no rows."""
    none = np.zeros(0, np.int64)
    return Parcel(
        {}, {name: np.zeros_like(words) for name, words in parcel.sums.items()}, take(parcel.nodes, none), {},
        {name: take(table, none) for name, table in parcel.rows.items()},
    )  # fmt: skip


def _write_parcel(path: Path, parcel: Parcel) -> None:
    with hdf5.created(path) as file:
        for name, words in parcel.sums.items():
            file[f"sums/{name}"] = words
        _write_table(file, "nodes", parcel.nodes)
        for part, table in parcel.tets.items():
            _write_table(file, f"tets/{part}", table)
        for name, table in parcel.rows.items():
            _write_table(file, f"rows/{name}", table)


def _write_table(file: "h5py.File", name: str, table: Table) -> None:
    for column, values in table.items():
        file[f"{name}/{column}"] = values


def _read_parcel(path: Path) -> Parcel:
    with h5py.File(path, "r") as file:
        sums = {name: words[()] for name, words in file.get("sums", {}).items()}
        tets = {int(part): _columns(table) for part, table in file.get("tets", {}).items()}
        rows = {name: _columns(table) for name, table in file.get("rows", {}).items()}
        return Parcel({}, sums, _columns(file["nodes"]), tets, rows)


def _columns(group: "h5py.Group") -> Table:
    return {name: column[()] for name, column in group.items()}


def _plain(value: Any) -> Any:
    """Return a value that JSON can represent. The representation of an array contains its type and its shape, because a
    list of no values does not show the dimensions.
    """
    if isinstance(value, np.ndarray):
        return {"dtype": str(value.dtype), "values": value.tolist(), "shape": list(value.shape)}
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value


def _rich(value: Any) -> Any:
    """Return the value that ``_plain`` converted. Lists become tuples."""
    if isinstance(value, dict):
        if value.keys() >= {"dtype", "values"}:
            made = np.array(value["values"], value["dtype"])
            return made.reshape(value.get("shape", made.shape))
        return {key: _rich(item) for key, item in value.items()}
    return [_rich(item) for item in value] if isinstance(value, list) else value


def _flush_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
