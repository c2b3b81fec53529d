"""Text of a Radioss starter or engine file: options with their lines, and named fields of these lines.

A line that begins with ``/`` is an option; a line that begins with ``#`` or ``$`` is a comment. A whole number takes
10 columns, any other field 20 (Reference Guide, "Block format").
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from conoid.cases.reading.cards import CardError
from conoid.cases.reading.included import Included, flattened, included_by
from conoid.cases.reading.problems import shown

from .. import fields
from ..account import Entry

_REAL = re.compile(r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?:[eEdD]([+-]?[0-9]{1,4})|([+-][0-9]{1,4}))?", re.ASCII)
_WHOLE = re.compile(r"[+-]?[0-9]{1,18}", re.ASCII)
Row = tuple[int, str]


@dataclass
class Option:
    """An option such as ``/MAT/LAW2/1``: its words in upper case, and its text lines with their numbers."""

    shown: str
    """Option as it is written in the file."""
    words: list[str]
    line: int
    rows: list[Row]
    file: str = ""

    def number(self) -> int:
        """Identifier of the option: the first number among its words; 0 if the option has none."""
        return next((int(word) for word in self.words if _WHOLE.fullmatch(word)), 0)

    @property
    def local(self) -> bool:
        """True if a second number follows the identifier; this number selects units for the option."""
        return sum(_WHOLE.fullmatch(word) is not None and int(word) > 0 for word in self.words) > 1


def options(deck: Included, file: str = "") -> Iterator[Option]:
    """Yields every option of a deck and of its included files, up to ``/END``; the lines of an option include empty
    lines. ``file``: name of the deck in messages. Raises CardError, OSError.
    """
    option: Option | None = None
    try:
        for number, text in flattened(deck, included_by):
            if text.startswith(("#", "$")):
                continue
            if text.startswith("/"):
                if option is not None:
                    yield option
                words = [word.strip().upper() for word in text.strip()[1:].split("/")]
                option = Option(text.strip(), words, int(number), [], number.file or file)
            elif option is not None:
                option.rows.append((number, text))
            elif text.strip():
                raise CardError(f"line {number}: {shown(text.strip())} stands before the first option")
    except ValueError as error:
        raise CardError(str(error)) from None
    if option is None:
        raise CardError("line 1: the file has no option; this is no Radioss file")
    yield option


def whole(line: int, item: str, what: str) -> int:
    """Reads a whole number. Raises CardError."""
    if not _WHOLE.fullmatch(item):
        raise CardError(f"line {line}: {what} = {shown(item)} is not a whole number (fields have fixed widths)")
    return int(item)


def real(line: int, item: str, what: str) -> float:
    """Reads a number; allowed notations include ``1.5-3`` and ``1D5``. Raises CardError."""
    found = _REAL.fullmatch(item)
    if found is None or abs(value := float(f"{found[1]}e{found[2] or found[3] or 0}")) == float("inf"):
        raise CardError(f"line {line}: {what} = {shown(item)} is not a number (fields have fixed widths)")
    return value


def cut(row: Row, *widths: int) -> list[str]:
    """Returns the fields of a line. Raises CardError for a tab, and for text after the last field."""
    line, text = row
    if "\t" in text:
        raise CardError(f"line {line}: a tab in a line with fixed columns; use blanks")
    found, at = [], 0
    for width in widths:
        found.append(text[at : at + width].strip())
        at += width
    if rest := text[at:].strip():
        raise CardError(f"line {line}: {shown(rest)} stands after the last field, beyond column {at}")
    return found


class Fields(fields.Fields[int]):
    """Named fields of the lines of an option."""

    def __init__(self, option: Option, entry: Entry, rows: Sequence[Row], layout: Sequence[str]) -> None:
        """Stores the fields; ``layout``: names of the fields of each line. A name with ``:`` at its end means a
        field of 10 columns, any other name a field of 20 columns; ``-`` means an unused field.
        """
        self.option = option
        found: dict[str, tuple[int, str]] = {}
        for row, names in zip(rows, layout, strict=False):
            words = names.split()
            items = zip(words, cut(row, *(10 if word.endswith(":") else 20 for word in words)), strict=True)
            found |= {name.strip(":"): (row[0], item) for name, item in items if name.strip(":") != "-"}
        super().__init__(entry, found, [number for number, text in rows[len(layout) :] if text.strip()])

    def _real(self, place: int, item: str, name: str) -> float:
        return real(place, item, name)

    def _whole(self, place: int, item: str, name: str) -> int:
        return whole(place, item, name)


def numbers(rows: Sequence[Row], what: str) -> list[int]:
    """Reads whole numbers from lines with ten fields of 10 columns. Raises CardError."""
    return [whole(row[0], item, what) for row in rows for item in cut(row, *(10,) * 10) if item]
