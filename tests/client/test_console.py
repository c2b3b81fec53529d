"""Titles and messages reach the terminal as text."""

import io

import pytest
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from conoid.client.console import PlainConsole, plain

EVIL = ["\x1b]0;owned\x07", "\x1b[2J", "\x9b31m", "\x1b]52;c;cm0=\x07", "a\rb", "\x08\x08", "\u202egnp.exe"]


@pytest.mark.parametrize("evil", EVIL)
def test_what_a_terminal_would_obey_is_replaced(evil: str) -> None:
    out = io.StringIO()
    console = PlainConsole(file=out, force_terminal=True, color_system="truecolor", width=80)
    table = Table(title=evil)
    table.add_column(evil)
    table.add_row(Text(f"a {evil} b", style="bold"))
    for thing in (evil, Text(evil), Panel(evil, title=Text(evil)), table):
        console.print(thing, markup=False)
    said = out.getvalue()
    assert evil not in said
    assert "\x1b[" in said, "its own colours stay"


def test_a_line_of_text_stays_as_it_is() -> None:
    assert plain("210 m/s, µs, °, tab\tand\nline") == "210 m/s, µs, °, tab\tand\nline"
