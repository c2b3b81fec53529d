"""Parcels travel unchanged, as messages and as files."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import parse_case, read_data, shipped_path
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
    found, manifest = checkpoint.latest(tmp_path)
    assert (found, manifest["step"], manifest["t"]) == (place, 12, 1e-6)
    checkpoint.require_same(case, manifest)
    assert same(vars(checkpoint.read(place, manifest, SerialComm())), vars(parcel()))


@pytest.mark.parametrize("harm", ["manifest", "file", "missing"])
def test_a_checkpoint_that_is_not_whole_is_passed_over(tmp_path: Path, harm: str) -> None:
    case = parse_case(read_data(shipped_path("free_tets")))
    places = [checkpoint.write(parcel(), case, tmp_path, step, 0.0, SerialComm())[0] for step in (1, 2, 3)]
    assert checkpoint.found(tmp_path) == places[:0:-1]
    if harm == "manifest":
        (places[2] / "manifest.json").write_text(json.dumps({"format": 1}))
    elif harm == "file":
        with (places[2] / "rank-0.h5").open("r+b") as file:
            file.seek(2000)
            file.write(b"\xff")
    else:
        (places[2] / "rank-0.h5").unlink()
    assert checkpoint.latest(tmp_path)[0] == places[1]


def test_tables() -> None:
    table = {"id": np.array([4, 2, 4]), "x": np.array([0.4, 0.2, 0.5])}
    assert length(table) == 3
    assert length({}) == 0
    assert take(table, np.array([1]))["x"].tolist() == [0.2]
    assert joined([{}, table, table])["id"].tolist() == [4, 2, 4, 4, 2, 4]
    assert once(table, table["id"])["x"].tolist() == [0.2, 0.4]
