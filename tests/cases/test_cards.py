"""LS-DYNA keyword decks as text: keywords, cards, fields, parameters, included files."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from conoid.cases.reading.cards import Block, CardError, Deck

NODE = (8, 16, 16, 16, 8, 8)


def deck(folder: Path, text: str, name: str = "deck.k") -> list[Block]:
    (folder / name).write_bytes(text.encode())
    return list(Deck(folder / name).blocks())


def numbers(blocks: Iterator[Block] | list[Block]) -> list[int]:
    found = []
    for block in blocks:
        for card in block.filled():
            items = block.fields(card, *NODE)
            found.append(block.whole(card, items[0], "nid"))
            block.real(card, items[1], "x")
    return found


def refusal(folder: Path, text: str) -> str:
    with pytest.raises(CardError) as error:
        numbers(deck(folder, text))
    assert "\n" not in str(error.value)
    return str(error.value)


def row(block: Block, place: int = 0) -> tuple[int, float, float]:
    number, x, y, *_ = block.fields(block.cards[place], *NODE)
    card = block.cards[place]
    return block.whole(card, number, "nid"), block.real(card, x, "x"), block.real(card, y, "y")


def test_a_deck_is_its_keywords_with_their_cards_up_to_its_end(tmp_path: Path) -> None:
    text = (
        "\ufeff*keyword\r\n$ a remark\r\n*Set_Node_List_Title\r\nclamp, left\r\n         1\r\n\r\n*COMMENT\r\nx\r\n"
        "*ELEMENT_SOLID (ten nodes format)\r\n*END\r\nrest\r\n"
    )
    keyword, nodes, solid = deck(tmp_path, text)
    assert (keyword.name, nodes.name, nodes.number) == ("KEYWORD", "SET_NODE_LIST_TITLE", 3)
    assert [(card.number, card.text) for card in nodes.cards] == [(4, "clamp, left"), (5, "         1"), (6, "")]
    assert nodes.parted({"LIST", "TITLE"}) == ("SET_NODE", frozenset({"LIST", "TITLE"}))
    assert (solid.name, solid.remark) == ("ELEMENT_SOLID", "ten nodes format")


@pytest.mark.parametrize(
    ("keyword", "card"),
    [
        ("*NODE", f"{12:8}{'1.50000000':>16}{'2.D+2':>16}"),
        ("*NODE", "12, +1.5, 2+2"),
        ("*NODE", "12,1.5,200.,,,,"),
        ("*NODE %", f"{12:10}{'1.5e0':>16}{'200.':>16}"),
        ("*NODE+", f"{12:20}{'15.e-1':>20}{'.2E3':>20}"),
        ("*KEYWORD LONG=Y\n*NODE -", f"{12:8}{'1.5':>16}{'200':>16}"),
        ("*KEYWORD long=k\n*NODE", f"{12:20}{'1.5':>20}{'200':>20}"),
        ("*KEYWORD 100000 LONG=S\n*NODE", f"{12:8}{'1.5':>16}{'200':>16}"),
        ("*KEYWORD I10=Y\n*NODE", f"{12:10}{'1.5':>16}{'200':>16}"),
        (
            f"*PARAMETER\nR  L      {'1.5':>10}I      N  {12:10}\nR h, -200\n*NODE",
            f"{'&n':>8}{'&L':>16}{'-&h':>16}",
        ),
    ],
)
def test_a_card_is_read_equally_in_every_format(tmp_path: Path, keyword: str, card: str) -> None:
    assert row(deck(tmp_path, f"{keyword}\n{card}\n")[-1]) == (12, 1.5, 200.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: the file has no keyword"),
        ("1 2 3\n*NODE\n", "line 1: '1 2 3' is before the first keyword"),
        ("*NODE\n\n       x\n", "line 3: nid = 'x' is not a whole number"),
        ("*NODE\n       1             1.x\n", "line 2: x = '1.x' is not a number"),
        ("*NODE\n       1           1e999\n", "line 2: x = '1e999' is not a number"),
        ("*NODE\n       1\t1.0\n", "line 2: a tab"),
        ("*NODE\n1,2,3,4,5,6,7\n", "line 2: 7 fields between commas"),
        ("*NODE\n" + " " * 75 + "7\n", "line 2: '7' is behind the last field, beyond column 72"),
        ("*NODE\n      &n\n", "line 2: the parameter '&n' is not defined above; known: none"),
        ("*PARAMETER\nR a, 1\nR a, 2\n", "line 3: the parameter 'a' has another value above"),
        ("*INCLUDE_TRANSFORM\na.k\n", "line 1: *INCLUDE_TRANSFORM is not supported"),
        ("*NODE extra\n", "line 1: 'extra' is behind *NODE"),
        ("*\n", "line 1: '*' is no keyword"),
        ("*KEYWORD LONG=X\n", "line 1: *KEYWORD LONG=X: expected"),
        ("*NODE\n\0\n", "line 2: a null byte"),
        ("*NODE\n" + "1" * 5000, "line 2: a line of more than 4096 characters"),
        ("*INCLUDE\n../deck.k\n", "line 2: the included file '../deck.k' is not below the folder of the deck"),
        ("*INCLUDE\n/etc/passwd\n", "line 2: the included file '/etc/passwd' is not below the folder"),
        ("*INCLUDE\nnothing.k\n", "line 2: the included file 'nothing.k' is no file there"),
        ("*INCLUDE\ndeck.k\n", "line 2: the file 'deck.k' includes itself"),
        ("*INCLUDE\nouter.k\n", "line 2: the included file 'outer.k' is not below the folder of the deck"),
        ("*INCLUDE\npipe.k\n", "line 2: the included file 'pipe.k' is no file there"),
        ("*INCLUDE\n", "line 1: *INCLUDE names no file"),
    ],
)
def test_an_unsupported_card_is_refused_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    folder = tmp_path / "below"
    folder.mkdir()
    (tmp_path / "other.k").write_text("*NODE\n")
    (folder / "outer.k").symlink_to(tmp_path / "other.k")
    os.mkfifo(folder / "pipe.k")
    assert refusal(folder, text).startswith(message)


def test_included_files_are_read_where_they_are_named(tmp_path: Path) -> None:
    sub = tmp_path / "sub"
    sub.mkdir()
    (sub / "one.k").write_text("*NODE\n       1\n*INCLUDE\nsub/t +\nwo.k\n*END\n*NODE\n")
    (sub / "two.k").write_text("*KEYWORD LONG=Y\n*NODE\n" + f"{2:20}\n")
    text = "*KEYWORD\n*INCLUDE\nsub\\one.k\ntwo.k\n*NODE\n       3\n"
    (sub / "two.k").rename(tmp_path / "two.k")
    (tmp_path / "sub" / "two.k").write_text("*NODE\n       4\n*NODE\n       x\n")
    (tmp_path / "deck.k").write_text(text)
    with pytest.raises(CardError, match=r"^'sub/two.k', line 4: nid = 'x'"):
        numbers(Deck(tmp_path / "deck.k").blocks())
    (sub / "two.k").write_text("*NODE\n       4\n")
    whole = Deck(tmp_path / "deck.k")
    assert numbers(block for block in whole.blocks() if block.name == "NODE") == [1, 4, 2, 3]
    assert [path.relative_to(tmp_path.resolve()).as_posix() for path in whole.included.files] == [
        "deck.k",
        "sub/one.k",
        "sub/two.k",
        "two.k",
    ]


def test_includes_have_a_limit_of_depth_and_of_number(tmp_path: Path) -> None:
    for i in range(12):
        (tmp_path / f"{i}.k").write_text(f"*INCLUDE\n{i + 1}.k\n")
    assert "more than 8 within each other" in refusal(tmp_path, "*INCLUDE\n0.k\n")
    (tmp_path / "leaf.k").write_text("*NODE\n")
    for i, inner in enumerate(["leaf.k", "a0.k", "a1.k"]):
        (tmp_path / f"a{i}.k").write_text(f"*INCLUDE\n{inner}\n" * 40)
    assert "more than 1000 files" in refusal(tmp_path, "*INCLUDE\na2.k\n")
