"""Numbers in words: one table of inputs and texts for Python and for the page."""

import ast
import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

from conoid.cases import figures

TABLE: list[tuple[str, list[Any], Any]] = json.loads(
    (Path(__file__).parents[1] / "figures.json").read_text(encoding="utf-8")
)


@pytest.mark.parametrize(("name", "given", "text"), TABLE, ids=[f"{name} {given}" for name, given, _ in TABLE])
def test_python_writes_a_number_as_the_table_has_it(name: str, given: list[Any], text: Any) -> None:
    assert getattr(figures, name)(*given) == text


def test_unknown_and_infinite_numbers_are_shown_as_symbols() -> None:
    assert figures.si(math.nan, "s") == figures.number(math.nan) == figures.rough(math.nan) == figures.UNKNOWN
    assert (figures.si(math.inf, "s"), figures.number(-math.inf)) == ("∞ s", "-∞")
    assert figures.day(1e18) == figures.UNKNOWN


OWN = {"studies/chart.py", "drawing/films.py"}
"""Exceptions from the rule: coordinates in SVG, options of ffmpeg, and messages about decks, which repeat the numbers
of the deck."""


def test_no_module_of_the_client_writes_numbers_on_its_own() -> None:
    client = Path(__file__).parents[2] / "client"
    form = re.compile(r"[.,\d%+]*[eEfgG%]|,")
    found = [
        f"{path.name}:{node.lineno}"
        for path in client.rglob("*.py")
        if path.relative_to(client).as_posix() not in OWN and path.relative_to(client).parts[0] != "decks"
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FormattedValue)
        and node.format_spec is not None
        and form.fullmatch(ast.unparse(node.format_spec)[2:-1])
    ]
    assert not found
