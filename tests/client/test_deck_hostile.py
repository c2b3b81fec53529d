"""Damaged decks: each deck is refused in one line, or becomes a case with an account of its keywords."""

import random
import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from conoid.client.cli import app
from conoid.client.decks.importing import lines, read_deck
from conoid.client.errors import ClientError

from .deck_texts import DECKS, FOLDER, lsdyna, row

STRANGE = "0123456789.-+eE,* $&/#x\t\"'\\=%é\x00"
WORDS = (
    "*END\n", "/END\n", "*PART\n", "*NODE\n", "*Step\n", "*Material, name=Q\n", "*SET_NODE_LIST\n", "*INCLUDE\nx.k\n",
    "*MAT_RIGID\n         1     7.8\n", "/PART/9\n", "*Instance, name=Z, part=Cube\n", "\n", "*End Part\n",
    "/MAT/LAW2/1\n",
)  # fmt: skip
NUMBERS = ("0", "-1", "999999999999", "1e400", "1E-400", "nan", "1.e29", "-1.5-3")


def spoilt(text: list[str], chance: random.Random) -> list[str]:
    """Returns a deck whose lines are removed, added, moved, cut or overwritten at random."""
    at, what = chance.randrange(len(text)), chance.randrange(7)
    if what == 0:
        return text[:at] + text[at + 1 :]
    if what == 1:
        return [*text[:at], text[chance.randrange(len(text))], *text[at:]]
    if what == 2:
        return [*text[:at], chance.choice(WORDS), *text[at:]]
    if what == 3:
        return text[: at + 1]
    if what == 4:
        line = re.sub(r"\d+", lambda found: chance.choice([found[0], *NUMBERS]), text[at])
    elif what == 5:
        place = chance.randrange(len(text[at]))
        line = text[at][:place] + chance.choice(STRANGE) + text[at][place + 1 :]
    else:
        line = text[at].swapcase()
    return [*text[:at], line, *text[at + 1 :]]


@pytest.mark.parametrize("name", DECKS)
def test_spoilt_decks_end_in_a_list_or_in_one_line(tmp_path: Path, name: str) -> None:
    shutil.copytree(FOLDER, tmp_path, dirs_exist_ok=True)
    chance = random.Random(name)
    for _ in range(60):
        text = (FOLDER / name).read_text(encoding="utf-8").splitlines(keepends=True)
        for _ in range(chance.choice((1, 1, 3))):
            text = spoilt(text, chance) or ["\n"]
        (tmp_path / name).write_text("".join(text), encoding="utf-8")
        assert "\n" not in refusal_of(tmp_path / name)


def refusal_of(deck: Path) -> str:
    """Returns all lines that the import of a deck prints, or the line with which the deck is refused."""
    try:
        found = read_deck(deck, None if deck.suffix == ".rad" else "mm,t,s")
    except ClientError as error:
        return str(error)
    assert all(each.decided for each in found.account.entries)
    return "".join([*lines(found, "case.toml"), *found.refusals])


def conoid(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words], prog_name="conoid")


FILES: dict[str, tuple[bytes, str]] = {
    "empty.k": (b"", "not recognised as an LS-DYNA keyword deck"),
    "binary.inp": (bytes(range(256)) * 40, "a null byte; this is no text file"),
    "words.k": (b"to whom it may concern\n", "not recognised as an LS-DYNA keyword deck"),
    "wide.k": (b"*KEYWORD\n" + b"a" * 100_000, "a line of more than 4096 characters"),
    "wide.inp": (b"*HEADING\n" + b"a" * 100_000, "a line of more than"),
    "wide_0000.rad": (b"#RADIOSS STARTER\n/BEGIN\n" + b"1" * 100_000, "a line of more than 4096 characters"),
    "utf16.k": ("*KEYWORD\n".encode("utf-16"), "UTF-16"),
    "loop.k": (b"*KEYWORD\n*INCLUDE\nloop.k\n", "the file 'loop.k' includes itself"),
    "away.k": (b"*KEYWORD\n*INCLUDE\n../../../../etc/passwd\n", "is not below the folder of the deck"),
    "moved.k": (b"*KEYWORD\n*INCLUDE_TRANSFORM\na.k\n", "*INCLUDE_TRANSFORM is not supported"),
    "tabs.k": (lsdyna("*MAT_ELASTIC", "1\t7.85E-9\t2.1E5\t0.3").encode(), "a tab in a card of fixed widths"),
    "generate.k": (lsdyna("*MAT_ELASTIC", row(1, "7.85E-9", 2.1e5, 0.3), "*SET_NODE_LIST_GENERATE", row(1),
                          row(9, 1)).encode(), "the range from 9 to 1 has no numbers"),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_not_a_deck_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    content, message = FILES[name]
    (tmp_path / name).write_bytes(content)
    result = conoid("import", tmp_path / name, "--units", "mm,t,s")
    assert result.exit_code == 2
    assert message in result.stderr
    assert not list(tmp_path.glob("*.toml"))


def test_a_path_that_is_not_a_regular_file_is_not_opened(tmp_path: Path) -> None:
    for path in ("/dev/zero", tmp_path, tmp_path / "none.k"):
        result = conoid("import", path, "--out", tmp_path / "case.toml")
        assert (result.exit_code, len(result.stderr.splitlines())) == (1, 1)


# The command ----------------------------------------------------------------------------------------------------------


def test_the_case_and_the_list_stand_beside_the_deck(tmp_path: Path) -> None:
    shutil.copy(FOLDER / "lspp_taylor.k", tmp_path / "bar.k")
    result = conoid("import", tmp_path / "bar.k")
    assert result.exit_code == 0, result.stderr
    listed = (tmp_path / "bar.import.txt").read_text()
    assert listed in result.stdout
    assert "*CONTROL_TIMESTEP -> numerics.dt_safety" in listed
    case = (tmp_path / "bar.toml").read_text()
    assert 'mesh.path = "bar.k"' in case
    assert "# Imported from bar.k, LS-DYNA keyword deck, in mm, t, s" in case
    again = conoid("import", tmp_path / "bar.k")
    assert (again.exit_code, (tmp_path / "bar.toml").read_text()) == (1, case)
    assert "already exists; name another file with --out" in again.stderr


def test_the_mesh_is_found_from_the_folder_of_the_case(tmp_path: Path) -> None:
    shutil.copy(FOLDER / "cae_taylor.inp", tmp_path / "bar.inp")
    (tmp_path / "cases").mkdir()
    result = conoid(
        "import", tmp_path / "bar.inp", "--units", "mm,t,s", "--out", tmp_path / "cases" / "rod.toml", "--json"
    )
    assert result.exit_code == 0, result.stderr
    assert 'mesh.path = "../bar.inp"' in (tmp_path / "cases" / "rod.toml").read_text()
    assert result.stdout == (tmp_path / "cases" / "rod.import.json").read_text()
    assert conoid("validate", tmp_path / "cases" / "rod.toml").exit_code == 0


def test_a_refused_deck_has_its_list_and_no_case_but_with_anyway(tmp_path: Path) -> None:
    deck = tmp_path / "foam.k"
    deck.write_text(lsdyna("*MAT_HONEYCOMB_TITLE", "core", row(1, "7.85E-9", 1.0)), encoding="utf-8")
    result = conoid("import", deck, "--units", "mm,t,s")
    assert result.exit_code == 2
    assert "*MAT_HONEYCOMB_TITLE: Conoid has no such material law" in result.stderr
    assert "refused: 1 keyword" in (tmp_path / "foam.import.txt").read_text()
    assert not (tmp_path / "foam.toml").exists()
    result = conoid("import", deck, "--units", "mm,t,s", "--anyway")
    assert result.exit_code == 0
    case = (tmp_path / "foam.toml").read_text()
    assert "# NOT TRANSLATED: line 16, *MAT_HONEYCOMB_TITLE: Conoid has no such material law" in case
    refused = conoid("validate", tmp_path / "foam.toml")
    assert (refused.exit_code, "parts[0].material = 'core': unknown material" in refused.stderr) == (2, True)
