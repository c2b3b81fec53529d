"""A keyword deck with includes is submitted as one file with the same content."""

import hashlib
import random
from pathlib import Path

import numpy as np
import pytest
from pydantic import TypeAdapter

from conoid.cases.load import CaseError
from conoid.cases.model.bodies import MeshFile
from conoid.cases.reading.cards import Deck
from conoid.client.decks.importing import read_deck
from conoid.client.decks.toml import bare
from conoid.client.errors import UsageError
from conoid.client.local import one_deck
from conoid.client.local.local_files import Hashes, keep_copies, with_hashes
from conoid.worker.mesh.read import read

from .deck_texts import abaqus, r20, radioss


def readings(path: Path) -> list[object]:
    """Returns all keywords of a deck with their fields, as the importer reads them."""
    return [
        (block.name, [block.fields(card, *(10,) * 8) for card in block.filled()], block.least)
        for block in Deck(path).blocks()
        if block.name != "KEYWORD"
    ]


def deck(folder: Path, seed: int) -> Path:
    """Writes a deck with includes of random depth, with changing formats, comments, continued names, folders, and *END
    before the end.
    """
    dice, count = random.Random(seed), 0

    def write(depth: int) -> str:
        nonlocal count
        count += 1
        name = dice.choice(["", "sub/", "sub/deep/"]) + f"{count}.k"
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = [dice.choice(["*KEYWORD", "*KEYWORD LONG=Y", "*KEYWORD LONG=S", "$ a comment"])]
        for _ in range(dice.randrange(1, 5)):
            lines += ["$ before", dice.choice(["*NODE", "*NODE", "*NODE +"])]
            lines += [f"{dice.randrange(1000)},{dice.random():.3g},0,1" for _ in range(dice.randrange(3))]
            if depth and dice.random() < 0.6:
                names = [write(depth - 1) for _ in range(dice.randrange(1, 3))]
                broken = [f"{each[:1]} +\n{each[1:]}" if dice.random() < 0.3 else each for each in names]
                lines += [dice.choice(["*INCLUDE", "*include", "*INCLUDE $ of ours"]), "$ names", *broken]
        if dice.random() < 0.3:
            lines += ["*END", "*NODE", "9,9,9,9"]
        path.write_text("\n".join(lines) + dice.choice(["\n", ""]), newline=dice.choice(["\n", "\r\n"]))
        return name

    return folder / write(3)


@pytest.mark.parametrize("seed", range(12))
def test_the_one_file_equals_the_deck_with_its_includes(tmp_path: Path, seed: int) -> None:
    """Names of parts are relative to the folder of the deck, which is the folder of the first file in this test."""
    (tmp_path / "in").mkdir()
    top = deck(tmp_path / "in", seed)
    root = tmp_path / "in" / "top.k"
    root.write_text(f"*KEYWORD\n*INCLUDE\n{top.relative_to(tmp_path / 'in')}\n*NODE\n1,0,0,0\n*END\n")
    files = one_deck.write(root, tmp_path / "one.k")
    assert readings(tmp_path / "one.k") == readings(root)
    assert not one_deck.includes(tmp_path / "one.k")
    assert {path.name for path in files} == {path.name for path in files_of(root)}


def files_of(path: Path) -> list[Path]:
    """Returns all files that the importer opens for a deck."""
    made = Deck(path)
    list(made.blocks())
    return made.included.files


@pytest.mark.parametrize("seed", range(8))
def test_includes_are_found_at_every_place_of_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """The file is searched piece by piece; a line that includes a file may begin in one piece and end in the next."""
    dice = random.Random(seed)
    for _ in range(200):
        monkeypatch.setattr(one_deck, "_CHUNK", dice.randrange(1, 40))
        long, end = "x" * dice.randrange(300), dice.choice(["", "\n", "\r\n"])
        line = dice.choice(["*INCLUDE", " * include", "#include a.inc", "*PART"])
        text = f"{dice.choice(['', chr(0xFEFF)])}{long}{end}{line}\n{long}"
        (tmp_path / "a.rad").write_text(text, encoding="utf-8", newline="")
        starts = bool(end) or not long
        assert one_deck.includes(tmp_path / "a.rad") == ("include" in line.lower() and starts), text


def case(path: str, **more: str) -> dict[str, object]:
    return {"parts": [{"mesh": {"shape": "file", "path": path, "unit": "1 mm", **more}}]}


def test_a_deck_with_includes_is_hashed_and_kept_as_one_file(tmp_path: Path) -> None:
    """Included files belong to the deck: with another included file the submitted file and its hash differ."""
    (tmp_path / "a.k").write_text("*KEYWORD\n*INCLUDE\nnodes.k\n*END\n")
    (tmp_path / "nodes.k").write_text("*NODE\n1,0,0,0\n")
    hashes = Hashes()
    (first,) = hashes.of(case("a.k"), tmp_path)
    assert first.path.read_text() == "*KEYWORD\n$ begin of nodes.k\n*NODE\n1,0,0,0\n$ end of nodes.k\n*END\n"
    itself = hashlib.sha256((tmp_path / "a.k").read_bytes()).hexdigest()
    for known in (itself, first.sha256):
        assert hashes.of(case("a.k", sha256=known), tmp_path)[0].sha256 == first.sha256
    keep_copies([first], tmp_path / "run")
    (copy,) = (tmp_path / "run" / "files").iterdir()
    assert copy.name == f"{first.sha256}.k"
    kept = with_hashes(case("a.k"), [first])
    assert hashes.of(kept, tmp_path / "run")[0].sha256 == first.sha256, "the folder of a run has it whole"
    (tmp_path / "nodes.k").write_text("*NODE\n1,0,0,2\n")
    (second,) = hashes.of(case("a.k"), tmp_path)
    assert second.sha256 != first.sha256
    place = second.path.parent.parent
    del hashes
    assert not place.exists(), "nothing is left behind"


@pytest.mark.parametrize("name", ["../secret", "/etc/passwd", "none.k", "a.k"])
def test_a_deck_that_leads_out_of_its_folder_is_refused_in_a_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "secret").write_text("*NODE\n")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.k").write_text(f"*KEYWORD\n*INCLUDE\n{name}\n")
    with pytest.raises(CaseError, match=r"^parts\[0\]\.mesh\.path = 'a\.k': the (included )?file '.*' ") as raised:
        Hashes().of(case("a.k"), tmp_path / "in")
    assert "\n" not in str(raised.value)


def split(folder: Path, name: str, text: str, begin: str, end: str, line: str) -> None:
    """Writes a deck whose lines from ``begin`` to ``end`` are in another file, and the same deck as one file."""
    at, to = text.index(begin), text.index(end)
    (folder / "sub").mkdir()
    (folder / "sub" / "mesh.inc").write_text(text[at:to])
    (folder / f"whole_{name}").write_text(text)
    for stem in ("bar", "whole_bar"):
        (folder / f"{stem}_0001.rad").write_text(f"{RUN}/END\n")
    (folder / name).write_text(f"{text[:at]}{line}\n{text[to:]}")


RUN = "/RUN/body/1\n1e-5\n"
OTHERS = {
    "bar.inp": (
        abaqus("*Density\n7.85e-9,\n*Elastic\n2.1e5, 0.3"), "*Node", "*Solid", '*Include, input="sub/mesh.inc"'
    ),
    "bar_0000.rad": (
        radioss("/MAT/ELAST/1", "steel", r20("7.85E-9"), r20(2.1e5, 0.3)).replace(RUN, ""), "/NODE", "/MAT",
        "#include sub/mesh.inc",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHERS)
def test_decks_with_includes_give_the_same_case_and_are_sent_as_one_file(tmp_path: Path, name: str) -> None:
    split(tmp_path, name, *OTHERS[name])
    units = None if name.endswith(".rad") else "mm,t,s"
    found, plain = (read_deck(tmp_path / each, units) for each in (name, f"whole_{name}"))
    assert found.refusals == []
    (included,) = [each for each in found.account.entries if "include" in each.keyword.lower()]
    assert included.fate == "left"
    assert {each.file for each in found.account.of("taken")} - {"bar_0001.rad"} == {"", "sub/mesh.inc"}
    for each in (found, plain):
        each.data["parts"][0]["mesh"].pop("path")
    assert bare(found.data["parts"]) == bare(plain.data["parts"])
    spec = {"shape": "file", "path": name, "unit": 1e-3}
    mesh = TypeAdapter[MeshFile](MeshFile).validate_python(spec)
    made = read(mesh, tmp_path / name)
    assert made.origin is not None
    assert [path for path, _ in made.origin.included] == [str(tmp_path / "sub" / "mesh.inc")]
    assert one_deck.includes(tmp_path / name)
    files = one_deck.write(tmp_path / name, tmp_path / f"one_{name}")
    assert [path.name for path in files] == [name, "mesh.inc"]
    assert not one_deck.includes(tmp_path / f"one_{name}")
    np.testing.assert_array_equal(read(mesh, tmp_path / f"one_{name}").points, made.points)


@pytest.mark.parametrize("name", OTHERS)
def test_includes_of_other_codes_that_cannot_be_followed_are_one_line(tmp_path: Path, name: str) -> None:
    split(tmp_path, name, *OTHERS[name])
    line, inner = OTHERS[name][3], tmp_path / "sub" / "mesh.inc"
    inner.write_text(inner.read_text() + line.replace("sub/mesh.inc", name) + "\n")
    with pytest.raises(UsageError, match=rf"line \d+ of sub/mesh.inc: the file '{name}' includes itself"):
        read_deck(tmp_path / name)
    inner.unlink()
    with pytest.raises(UsageError, match=r"line \d+: the included file 'sub/mesh.inc' is no file there"):
        read_deck(tmp_path / name)
    (tmp_path / name).write_text((tmp_path / name).read_text().replace("sub/mesh.inc", "/etc/passwd"))
    with pytest.raises(UsageError, match=r"line \d+: the included file '/etc/passwd' is not below the folder"):
        read_deck(tmp_path / name)
