"""Tables of the comparison of two runs for the command line."""

from rich.table import Table

from conoid.cases.figures import fixed, number

from ..reports.compare import AT_THE_END, Comparison
from .tables import pairs, table

_LONGEST = 60
"""Largest number of characters of a value that are shown (chosen value: the values of two runs fit side by side; some
values, such as descriptions, are longer)."""
_NUMBERS = ("A", "B", "B - A", "% of A")
_LEAST = 26
"""Smallest number of characters of the column of names (chosen value: most names fit, and a table line has 80
characters)."""


def _brief(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"


def comparison_tables(found: Comparison) -> list[Table | str]:
    """Returns the differences between two runs: keys of the case, outcomes and fragments."""
    same = "both runs have the same answer, bit for bit" if found.same_answer else "different answers"
    keys = table("key", "A", "B", wide=("A", "B"))
    for each in found.keys:
        keys.add_row(each.key, *("–" if value is None else _brief(str(value)) for value in (each.a, each.b)))
    runs = pairs(dict(zip("AB", found.names, strict=True)))
    parts: list[Table | str] = [runs, same, "", keys if found.keys else "the cases of both runs have equal keys"]
    for title, values in (("at the end", found.ends), ("fragments", found.sizes)):
        if values:
            made = table(title, "unit", *_NUMBERS, right=_NUMBERS, wide=(title,), least=_LEAST)
            made.padding = 0
            for one in values:
                share = fixed(100 * one.relative) if one.difference else ""
                share = f"+{share}" if one.relative > 0 else share
                change = number(one.difference) if one.difference else "same"
                made.add_row(one.name.removesuffix(AT_THE_END), one.unit, number(one.a), number(one.b), change, share)
            parts += ["", made]
    return parts
