"""The files that a case names, and the location of each file for a run."""

from pathlib import Path
from typing import Any

import pytest

from conoid.cases.load import CaseError, parse_case, read_data, shipped_path
from conoid.cases.output import layout
from conoid.cases.reading.files import copy_of, files_of, located

HASH = "0123456789abcdef" * 4


def case_with(**mesh: Any) -> dict[str, Any]:
    data = read_data(shipped_path("demo"))
    data["parts"][0]["mesh"] = {"shape": "file", "path": "rod.inp", "unit": "1 mm", **mesh}
    return data


def test_every_table_below_a_mesh_that_has_a_path_names_a_file() -> None:
    """Tables inside of other tables may also name files; all keys of a table except ``path`` are ignored."""
    inner = {"shape": "union", "of": [{"path": "a.STEP", "sha256": HASH.upper()}, {"shape": "box"}, 3]}
    case = {"parts": [{"mesh": {"path": "b.k"}}, {}, None, {"mesh": inner}, {"mesh": {"path": 7}}], "path": "no"}
    found = [(file.table, file.path, file.sha256, file.copy) for file in files_of(case)]
    assert found == [
        (("parts", 0, "mesh"), "b.k", None, ""),
        (("parts", 3, "mesh", "of", 0), "a.STEP", HASH, f"{HASH}.step"),
    ]
    assert not any(files_of(odd) for odd in ({}, {"parts": 3}, {"parts": "mesh"}, {"parts": [[{"path": "x"}]]}))


@pytest.mark.parametrize("path", ["a/../b.in p", "x.", "..", "/", "a.b/c", "a.\n", "x." + "y" * 9, "", "x.é"])
def test_the_name_of_a_copy_is_a_hash_and_a_plain_ending(path: str) -> None:
    assert copy_of(path, HASH) == HASH
    assert copy_of(path, "../" + HASH) == copy_of(path, None) == ""


def test_a_run_of_a_server_reads_its_own_copy_and_no_path(tmp_path: Path) -> None:
    here = tmp_path / "rod.inp"
    assert located("rod.inp", None, tmp_path) == located("rod.inp", HASH, tmp_path) == here
    copy = tmp_path / layout.FILES / f"{HASH}.inp"
    copy.parent.mkdir()
    copy.touch()
    assert located("rod.inp", None, tmp_path) == here
    assert located("/etc/rod.inp", HASH, tmp_path) == copy
    copy.unlink()
    (tmp_path / layout.SUBMISSION).touch()
    assert located("/etc/rod.inp", HASH, tmp_path) == copy
    assert located("/etc/passwd", None, tmp_path).parent == copy.parent


@pytest.mark.parametrize("wrong", ["", "12", HASH[:-1], HASH + "0", "g" * 64, "../../etc/passwd"])
def test_an_invalid_hash_is_refused(wrong: str) -> None:
    with pytest.raises(CaseError, match=r"^parts\[0\]\.mesh\.sha256 = .*: expected 64 hexadecimal digits") as raised:
        parse_case(case_with(sha256=wrong))
    assert len(raised.value.problems) == 1
    assert parse_case(case_with(sha256=HASH.upper())).model_dump()["parts"][0]["mesh"]["sha256"] == HASH
