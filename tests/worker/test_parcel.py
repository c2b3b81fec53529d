"""Parcels (state of tets and nodes in a message or checkpoint) arrive unchanged, as messages and as files."""

import hashlib
import json
import math
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import parse_case, read_data, shipped_path
from conoid.cases.output import checkpoints
from conoid.cases.output.checkpoints import FORMAT, MANIFEST, SEAL
from conoid.worker.errors import InputError
from conoid.worker.migration import checkpoint
from conoid.worker.migration.parcel import Parcel, joined, length, once, take
from conoid.worker.parallel.comm import SerialComm

KNOWN: dict[str, Any] = {
    "number": 0.1 + 0.2, "never": -math.inf, "flag": True, "words": np.array([2**62, -1]), "none": None,
    "nested": {"pair": [1, np.array([0.1, 5e-324])]},
}  # fmt: skip


def parcel() -> Parcel:
    draw = np.random.default_rng(1)
    return Parcel(
        KNOWN, {"sum": np.array([1, -(2**60)])}, {"id": np.array([3, 5, 9]), "x": draw.normal(size=(3, 3))},
        {0: {"id": np.array([7]), "corners": np.array([[3, 5, 9, 3]]), "worn": np.array([True])}},
        {"rows": {"tet": np.array([7, 7]), "with": np.array([[3], [9]])}, "empty": {"tet": np.zeros(0, np.int64)}},
    )  # fmt: skip


def same(one: Any, two: Any) -> bool:
    if isinstance(one, dict):
        return one.keys() == two.keys() and all(same(one[key], two[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(two) and all(map(same, one, two))
    if isinstance(one, np.ndarray):
        return one.dtype == two.dtype and one.shape == two.shape and bool((one == two).all())
    return bool(one == two)


def test_a_parcel_is_one_message() -> None:
    before, after = parcel(), Parcel.unpacked(parcel().packed())
    assert same(vars(before), vars(after))


def test_a_parcel_is_a_checkpoint(tmp_path: Path) -> None:
    case = parse_case(read_data(shipped_path("free_tets")))
    place, size = checkpoint.write(parcel(), case, tmp_path, 12, 1e-6, SerialComm())
    assert size == sum(file.stat().st_size for file in place.glob("*.h5"))
    found, manifest, damaged = checkpoint.latest(tmp_path)
    assert (found, manifest.step, manifest.t, damaged) == (place, 12, 1e-6, [])
    checkpoint.require_same(case, manifest)
    assert same(vars(checkpoint.read(place, manifest, SerialComm())), vars(parcel()))


HARMS: dict[str, Callable[[Path], Any]] = {
    "no manifest": lambda place: (place / MANIFEST).unlink(),
    "an empty manifest": lambda place: (place / MANIFEST).write_bytes(b""),
    "half a manifest": lambda place: os.truncate(place / MANIFEST, 200),
    "a manifest of nothing": lambda place: (place / MANIFEST).write_text("null"),
    "a manifest of other things": lambda place: (place / MANIFEST).write_text(json.dumps({"format": FORMAT})),
    "a manifest that is a list": lambda place: resealed(place, b"[]"),
    "a manifest of wrong types": lambda place: resealed(place, b'{"format": 16, "step": "3", "files": null}'),
    "a manifest with another number": lambda place: flipped(place / MANIFEST, b'"step": 3', b'"step": 4'),
    "a manifest that is a folder": lambda place: put(place / MANIFEST, Path.mkdir),
    "a manifest that is a pipe": lambda place: put(place / MANIFEST, os.mkfifo),
    "no sha256": lambda place: (place / SEAL).unlink(),
    "a file without bytes": lambda place: os.truncate(place / "rank-0.h5", 0),
    "half a file": lambda place: os.truncate(place / "rank-0.h5", 1000),
    "a file with another byte": lambda place: flipped(place / "rank-0.h5"),
    "no file": lambda place: (place / "rank-0.h5").unlink(),
    "a file that is an endless one": lambda place: put(place / "rank-0.h5", lambda path: path.symlink_to("/dev/zero")),
    "nothing": lambda place: emptied(place),
}


def put(path: Path, make: Callable[[Path], None]) -> None:
    """Replaces a file with other data."""
    path.unlink()
    make(path)


def emptied(place: Path) -> None:
    """Removes the files of a folder."""
    for path in place.iterdir():
        path.unlink()


def flipped(path: Path, old: bytes = b"", new: bytes = b"") -> None:
    """Changes one byte of a file, or replaces ``old`` by ``new``."""
    content = path.read_bytes()
    assert old in content
    middle = len(content) // 2
    other = bytes([content[middle] ^ 1])
    path.write_bytes(content.replace(old, new) if old else content[:middle] + other + content[middle + 1 :])


def resealed(place: Path, text: bytes) -> None:
    """Writes another manifest with the matching sha256."""
    (place / MANIFEST).write_bytes(text)
    (place / SEAL).write_text(hashlib.sha256(text).hexdigest())


@pytest.mark.parametrize("harm", HARMS)
def test_an_incomplete_checkpoint_is_skipped(tmp_path: Path, harm: str) -> None:
    case = parse_case(read_data(shipped_path("free_tets")))
    places = [checkpoint.write(parcel(), case, tmp_path, step, 0.0, SerialComm())[0] for step in (1, 2, 3)]
    (tmp_path / "checkpoints" / "notes.7").mkdir()
    assert checkpoints.found(tmp_path) == places[:0:-1]
    HARMS[harm](places[2])
    place, manifest, damaged = checkpoint.latest(tmp_path)
    assert (place, manifest.step) == (places[1], 2)
    assert [line.partition(":")[0] for line in damaged] == ["checkpoint 000000003 is damaged"]
    shutil.rmtree(places[1])
    with pytest.raises(InputError, match="no complete checkpoint: checkpoint 000000003 is damaged: "):
        checkpoint.latest(tmp_path)


def test_tables() -> None:
    table = {"id": np.array([4, 2, 4]), "x": np.array([0.4, 0.2, 0.5])}
    assert length(table) == 3
    assert length({}) == 0
    assert take(table, np.array([1]))["x"].tolist() == [0.2]
    assert joined([{}, table, table])["id"].tolist() == [4, 2, 4, 4, 2, 4]
    assert once(table, table["id"])["x"].tolist() == [0.2, 0.4]
