"""The case in the page's editor, in node: positions of the keys, changes of the text, and hashes of files."""

import base64
import hashlib
import json
import random
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.load import shipped, shipped_path
from conoid.cases.reading.files import files_of

WEB = Path(__file__).parents[2] / "client" / "web"
NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="no node on this machine")
HASH = "ab" * 32


def asked(tmp_path: Path, module: str, script: str, data: Any) -> Any:
    """Returns the value of an expression with the module as ``page`` and the data as ``data``."""
    for path in WEB.glob("*.js"):
        shutil.copy(path, tmp_path)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    question = json.dumps({"module": str(tmp_path / module), "script": script, "data": data})
    command = [str(NODE), str(Path(__file__).with_name("scripts.mjs"))]
    done = subprocess.run(command, input=question, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def keys(value: Any, name: str = "") -> Iterator[str]:
    """Yields the dotted key of each value of a case."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from keys(inner, f"{name}.{key}" if name else key)
    elif isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
        for n, inner in enumerate(value):
            yield from keys(inner, f"{name}[{n}]")
    else:
        yield name


def test_each_key_of_the_shipped_cases_is_found_on_its_line(tmp_path: Path) -> None:
    texts = [path.read_text() for path in shipped().values()]
    wanted = [[text, list(keys(tomllib.loads(text)))] for text in texts]
    script = "data.map(([text, keys]) => keys.map((key) => page.lineOf(text, key)))"
    for text, (_, names), places in zip(texts, wanted, asked(tmp_path, "casetext.js", script, wanted), strict=True):
        lines = text.splitlines()
        for name, place in zip(names, places, strict=True):
            words = name.replace("]", "").replace("[", ".").split(".")
            assert any(word in lines[place] for word in words[-2:]), (name, lines[place])


ODD = '''# a comment with path = "a.inp"
title = "a title" # what it is
description = """
[run]
path = "a.inp" \\" " ""
"""
parts = [{ name = "a", mesh = { shape = "file", path = "a.inp" } }, { mesh.path = 'a.inp' }, { mesh = { path = "b" } }]
[run]   # where it stops
end_time = "1 s" # later
ranks = 2
'''
TABLES = """
[[parts]]
mesh.shape = "file"
  mesh.path = "a.inp" # here
[[parts]]
[parts.mesh]
path = 'a.inp'
sha256 = "old" # stale
[[parts]]
[parts.mesh.outer]
path = "dir/b.inp"
"""


@pytest.mark.parametrize("text", [ODD, TABLES], ids=["inline", "tables"])
def test_a_hash_comes_beside_each_place_that_names_the_file(tmp_path: Path, text: str) -> None:
    script = "((text) => [text, page.withHash(text, 'a.inp', data[1])])(page.withHash(data[0], 'a.inp', data[2]))"
    once, twice = asked(tmp_path, "casetext.js", script, [text, HASH, "cd" * 32])
    before = tomllib.loads(text)
    for made, sha256 in ((once, "cd" * 32), (twice, HASH)):
        files = files_of(tomllib.loads(made))
        assert [(file.path, file.sha256) for file in files if file.path == "a.inp"] == [("a.inp", sha256)] * 2
        assert [file.sha256 for file in files if file.path != "a.inp"] == [None]
        after = tomllib.loads(made.replace(sha256, ""))
        assert after.get("description") == before.get("description")
        assert [file.path for file in files] == [file.path for file in files_of(before)]


def test_a_key_gets_another_value_and_all_else_stays(tmp_path: Path) -> None:
    changes = [
        ["run", "ranks", "8"], ["", "title", '"a \\" title"'], ["run", "threads", "3"], ["numerics", "dt", "0.5"],
    ]  # fmt: skip
    texts = [ODD, TABLES, *(path.read_text() for path in shipped().values())]
    script = "data[0].map((text) => data[1].map((change) => page.withKey(text, ...change)))"
    for text, made in zip(texts, asked(tmp_path, "casetext.js", script, [texts, changes]), strict=True):
        for (table, name, literal), changed in zip(changes, made, strict=True):
            wanted = tomllib.loads(text)
            (wanted.setdefault(table, {}) if table else wanted)[name] = tomllib.loads(f"x = {literal}")["x"]
            assert tomllib.loads(changed) == wanted
            assert [line for line in text.splitlines() if "#" in line and name not in line] == [
                line for line in changed.splitlines() if "#" in line and name not in line
            ]


def test_values_are_read_as_they_are_written(tmp_path: Path) -> None:
    script = "[['', 'title'], ['run', 'ranks'], ['run', 'threads']].map((at) => page.valueOf(data, ...at))"
    assert asked(tmp_path, "casetext.js", script, ODD) == ["a title", "2", ""]
    assert asked(tmp_path, "casetext.js", script, '{"title": "a", "run": {"ranks": 2}}') == ["a", "2", ""]


def test_any_text_that_is_typed_is_survived(tmp_path: Path) -> None:
    """While a user types, the text of an editor is mostly an incomplete case."""
    draw = random.Random(5)
    pieces = [*"\"'[]{}=#\n\\. ", '"""', "'''", "[[", "]]", "path", "a.inp", "run", "ranks = 2"]
    texts = ["".join(draw.choices(pieces, k=40)) for _ in range(400)]
    texts += [ODD[: draw.randrange(len(ODD))] for _ in range(100)]
    script = """data.map((text) => [page.lineOf(text, "parts[0].mesh.path"), page.withHash(text, "a.inp", "x").length,
        page.withKey(text, "run", "ranks", "3").length, page.valueOf(text, "run", "ranks").length].length)"""
    assert asked(tmp_path, "casetext.js", script, texts) == [4] * len(texts)


def test_the_hash_of_a_file_is_its_sha256_however_it_is_cut(tmp_path: Path) -> None:
    draw = random.Random(7)
    lengths = [0, 1, 3, 55, 56, 57, 63, 64, 65, 119, 120, 127, 128, 129, 1000, 100_003]
    bodies = [draw.randbytes(length) for length in lengths]
    script = """data.map((text) => {
        const bytes = Uint8Array.from(atob(text), (one) => one.charCodeAt(0));
        const cut = Math.floor(bytes.length / 3);
        const pieces = [bytes.subarray(0, cut), bytes.subarray(cut, cut + 1), bytes.subarray(cut + 1)];
        return pieces.reduce((hash, piece) => hash.update(piece), new page.Sha256()).digest();
    })"""
    found = asked(tmp_path, "sha256.js", script, [base64.b64encode(body).decode() for body in bodies])
    assert found == [hashlib.sha256(body).hexdigest() for body in bodies]


def test_a_case_in_json_is_the_same_case_in_toml(tmp_path: Path) -> None:
    known = [case for name in shipped() for case in [tomllib.loads(shipped_path(name).read_text(encoding="utf-8"))]]
    odd = {
        "name": "o",
        "odd key.": 'a "b" \\ \n\t\u0001',
        "t": {},
        "u": {"v": {"w": [[1, -2.5e-9], []]}},
        "p": [{"q": [{"r": 1}]}, {}],
    }
    sources = [json.dumps(case) for case in [*known, odd]]
    found = asked(tmp_path, "casetoml.js", "data.map(page.asToml)", sources)
    assert [tomllib.loads(text) for text in found] == [*known, odd]
    assert (
        max(len(line) for text in found[: len(known)] for line in text.splitlines() if "description" not in line) < 200
    )
    left = ['{"a": null}', '{"seed": 12345678901234567}', "name = 1", "{ no json"]
    assert asked(tmp_path, "casetoml.js", "data.map(page.asToml)", left) == left
