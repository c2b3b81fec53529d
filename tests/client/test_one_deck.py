"""A keyword deck that includes others is handed in as one file, which says the same."""

import hashlib
import random
from pathlib import Path

import pytest

from conoid.cases.cards import Deck
from conoid.cases.load import CaseError
from conoid.client import one_deck
from conoid.client.local_files import Hashes, keep_copies, with_hashes


def said(path: Path) -> list[object]:
    """All keywords of a deck with their fields, as a reader of decks has them."""
    return [
        (block.name, [block.fields(card, *(10,) * 8) for card in block.filled()], block.least)
        for block in Deck(path).blocks()
        if block.name != "KEYWORD"
    ]


def deck(folder: Path, seed: int) -> Path:
    """A deck of random depth: formats that change, comments, names that go on, folders, ends before the end."""
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
def test_the_one_file_says_what_the_deck_says(tmp_path: Path, seed: int) -> None:
    """Parts of decks are named from the folder of the deck, which is that of the first file here."""
    (tmp_path / "in").mkdir()
    top = deck(tmp_path / "in", seed)
    root = tmp_path / "in" / "top.k"
    root.write_text(f"*KEYWORD\n*INCLUDE\n{top.relative_to(tmp_path / 'in')}\n*NODE\n1,0,0,0\n*END\n")
    files = one_deck.write(root, tmp_path / "one.k")
    assert said(tmp_path / "one.k") == said(root)
    assert not one_deck.includes(tmp_path / "one.k")
    assert {path.name for path in files} == {path.name for path in files_of(root)}


def files_of(path: Path) -> list[Path]:
    """All files that a reader of decks opens."""
    made = Deck(path)
    list(made.blocks())
    return made.included.files


def case(path: str, **more: str) -> dict[str, object]:
    return {"parts": [{"mesh": {"shape": "file", "path": path, "unit": "1 mm", **more}}]}


def test_a_deck_with_includes_is_hashed_and_kept_as_one_file(tmp_path: Path) -> None:
    """What is included belongs to it: another one makes another file."""
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
    with pytest.raises(CaseError, match=r"^parts\[0\]\.mesh\.path = 'a\.k': the (included )?file '.*' ") as told:
        Hashes().of(case("a.k"), tmp_path / "in")
    assert "\n" not in str(told.value)
