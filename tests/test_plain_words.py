"""Tests of the checker of words: the checker finds the words that CONVENTIONS.md bans, and ignores code and plain
prose.
"""

from collections import Counter
from pathlib import Path

import pytest

from . import plain_words

WRONG = {
    ".py": [
        ('"""A rank that hears of splits."""', "hears"),
        ("x = 1  # the list knows its length", "knows"),
        ('raise ValueError(f"{name}: nobody has a file of it")', "nobody"),
        ('X = 1\n"""What a step costs."""', "docstring begins with What"),
        ('def f():\n    """Whose turn it is.\n\n    More.\n    """', "docstring begins with Whose"),
    ],
    ".js": [("// the slave node", "slave"), ("const a = 'it says so in the log';", "says")],
    ".md": [("The list\nis told of it.", "told"), ("all faces but for one", "but for")],
    ".html": [("<p>Nobody\nwatches</p>", "nobody"), ('<a title="who sends it">x</a>', "who")],
    "": [("# Nothing takes 10 s: it tells how long", "tells")],
}
RIGHT = {
    ".py": [
        '"""Whether a node is on the surface, due to the user who asks."""',
        'told = {"told": "a, b"}\nx = f"{told} of the rank"  # see ``told`` and `news.told`',
        "JS = 'const told = new Told(); told.take(data);'",
    ],
    ".js": ["const told = new Told(); // a table of rows"],
    ".md": ["```\ntold says knows\n```\n\nAdd `told` to the table."],
    ".html": ["<told>the run has ended</told>"],
    "": ["told = echo"],
}


def rules(suffix: str, source: str) -> list[str]:
    return [rule for text in plain_words.READERS[suffix](source) for _, rule, _ in plain_words.of_words(text)]


@pytest.mark.parametrize(("suffix", "source", "rule"), [(s, *each) for s, cases in WRONG.items() for each in cases])
def test_each_kind_of_text_is_searched(suffix: str, source: str, rule: str) -> None:
    assert rules(suffix, source) == [rule]


@pytest.mark.parametrize(("suffix", "source"), [(s, each) for s, cases in RIGHT.items() for each in cases])
def test_code_and_plain_prose_pass(suffix: str, source: str) -> None:
    assert rules(suffix, source) == []


@pytest.mark.parametrize(
    ("name", "source", "count"),
    [
        ("a.py", "told = [1]\nx = told + y.said  # told\nz = 'told'", 3),
        ("a.js", "const told = 1; // told\nthis.said = 'told';", 2),
        ("a.md", "`told`", 0),
    ],
)
def test_names_of_variables_are_checked(name: str, source: str, count: int) -> None:
    assert len(list(plain_words.of_names(Path(name), source))) == count


def test_the_line_of_a_word_is_reported() -> None:
    (text,) = plain_words.python('x = 1\n"""A list.\n\nIt\nknows `x`.\n"""')
    assert [line for line, _, _ in plain_words.of_words(text)] == [6 - 1]


def test_long_lines_are_found_except_tables_and_addresses() -> None:
    long = "word " * 30
    assert [line for line, _, _ in plain_words.of_lengths(f"short\n{long}\n| {long} |\nhttps://{long}")] == [2]


@pytest.mark.parametrize(
    ("subject", "good"),
    [
        ("fracture: exchange with affected ranks instead of collectives", True),
        ("A break is the business of those whom it touches", False),
        ("words:", False),
        ("docs, site: plain words", True),
        ("contact: " + "x" * 64, False),
    ],
)
def test_commit_subjects_name_an_area_and_what_changed(subject: str, good: bool) -> None:
    assert plain_words.is_subject(subject) is good


def test_paragraphs_of_a_page_begin_with_a_noun() -> None:
    source = "It is here.\nThey follow.\n\n- Both of them\n- An item\n\n```\nThose\n```\n"
    assert [number for number, _, _ in plain_words.of_paragraphs(source)] == [1, 4]


def test_more_findings_than_a_folder_may_have_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plain_words, "NOT_YET", {"cases": 2})
    counts = Counter({"cases": 3, "docs": 1})
    assert [line.partition(":")[0] for line in plain_words.excess(counts)] == ["cases", "docs"]
    assert plain_words.excess(Counter({"cases": 2})) == []


def test_every_kind_of_list_in_the_conventions_is_read() -> None:
    assert all(plain_words.banned().fullmatch(word) for word in ("slave", "told", "lets go", "By hand"))
    assert all(plain_words.first_words().match(word) for word in ("What", "Nothing"))
    assert not plain_words.banned().fullmatch("component"), "a word that has a meaning of its own elsewhere"
