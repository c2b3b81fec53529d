"""The text of an LS-DYNA keyword deck (input file): keywords, their cards, and the fields of a card.

The rules are those of the LS-DYNA Keyword User's Manual, "Getting started": a line that begins with ``*`` is a keyword,
a line that begins with ``$`` is a comment, every other line is a card of the last keyword. A card has fields of fixed
widths, or fields between commas. Every width below 20 becomes 20 in the long format (``*KEYWORD LONG=Y``, or ``+``
behind a keyword). Every width below 10 becomes 10 in the format I10 (``*KEYWORD I10=Y``, or ``%`` behind a keyword).
``-`` behind a keyword selects the standard format.
"""

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from . import parameters
from .included import Included, lines
from .problems import ConoidError, shown

Widths = tuple[int, ...]

_STANDARD, _I10, _LONG = 0, 10, 20
"""Smallest width of a field in each of the three formats (the manual, "General card format")."""
_SUFFIXES = {"+": _LONG, "%": _I10, "-": _STANDARD}
_KEYWORD = re.compile(r"\*\s*([A-Za-z0-9_\-/&.]*[A-Za-z0-9_/&.])\s*([+%-])?\s*(.*)", re.ASCII)
_REMARK = re.compile(r"\(.*\)")
_SETTING = re.compile(r"(LONG|I10)\s*=\s*([A-Za-z])", re.ASCII | re.IGNORECASE)
_WHOLE = re.compile(r"[+-]?[0-9]{1,18}(\.0*)?", re.ASCII)
_REAL = re.compile(r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?:[eEdD]([+-]?[0-9]{1,4})|([+-][0-9]{1,4}))?", re.ASCII)


class CardError(ConoidError, ValueError):
    """Error in an LS-DYNA keyword deck. The text of the error is one line that begins with the place in the deck."""


class Card(NamedTuple):
    """A line of a deck that is neither a keyword nor a comment."""

    number: int
    """Number of the line in its file."""
    text: str
    """Text of the line without its line end."""


@dataclass(frozen=True)
class Block:
    """A keyword and its cards, including empty cards."""

    name: str
    """Name of the keyword in upper case, without ``*``: ``ELEMENT_SOLID``, ``SET_NODE_LIST_TITLE``."""
    number: int
    """Number of the keyword's line in its file."""
    file: str = ""
    """Name of the included file in the deck; empty for the deck itself."""
    cards: list[Card] = field(default_factory=list)
    least: int = _STANDARD
    """Smallest width of a field: 0, 10 or 20 characters."""
    remark: str = ""
    """Text in brackets behind the keyword, such as ``ten nodes format``."""
    values: parameters.Values = field(default_factory=dict)
    """The parameters that the deck defines above this keyword."""

    def filled(self) -> Iterator[Card]:
        """The cards of the keyword that are not empty."""
        return (card for card in self.cards if card.text.strip())

    def parted(self, options: Collection[str]) -> tuple[str, frozenset[str]]:
        """Returns the name of the keyword without the words of ``options`` at its end, and these words: ``("SET_NODE",
        {"TITLE"})``.
        """
        name, found = self.name, set[str]()
        while (last := name.rpartition("_"))[2] in options and last[0]:
            name = last[0]
            found.add(last[2])
        return name, frozenset(found)

    def place(self, number: int | None = None) -> str:
        """Returns the place of line ``number`` as text: ``line 7`` or ``'sub/mesh.k', line 7``."""
        return placed(self.file, self.number if number is None else number)

    def error(self, card: Card | None, text: str) -> CardError:
        """Returns an error whose text gives the place of the card; without a card, the place of the keyword."""
        return CardError(f"{self.place(card.number if card else None)}: {text}")

    def fields(self, card: Card, *widths: int) -> list[str]:
        """Returns the fields of a card without outer blanks. A parameter is replaced by its value; a field beyond the
        end of the card is empty.

        Raises CardError if the card has more fields than ``widths``, or if a parameter is not defined.
        """
        found = self._between_commas(card, widths) if "," in card.text else self._cut(card, widths)
        return [self._valued(card, item) for item in found] if "&" in card.text or "<" in card.text else found

    def whole(self, card: Card, item: str, what: str) -> int:
        """Returns the whole number in a field; 0 for an empty field. Raises CardError if the field is not a whole
        number. ``what``: name of the field in the message.
        """
        if not item:
            return 0
        if not _WHOLE.fullmatch(item):
            raise self.error(card, f"{what} = {shown(item)} is not a whole number{_crossed(card)}")
        return int(item.partition(".")[0])

    def real(self, card: Card, item: str, what: str) -> float:
        """Returns the number in a field, also in the forms ``1.5-3`` and ``1D5``; 0 for an empty field. Raises
        CardError if the field is not a number.
        """
        if not item:
            return 0.0
        found = _REAL.fullmatch(item)
        if found is None or abs(value := float(f"{found[1]}e{found[2] or found[3] or 0}")) == float("inf"):
            raise self.error(card, f"{what} = {shown(item)} is not a number{_crossed(card)}")
        return -value if item[0] == "-" and value > 0 else value

    def _cut(self, card: Card, widths: Widths) -> list[str]:
        text, found, at = card.text, [], 0
        if "\t" in text:
            raise self.error(card, "a tab in a card of fixed widths; write blanks, or commas between the fields")
        for width in widths:
            end = at + max(width, self.least)
            found.append(text[at:end].strip())
            at = end
        if rest := text[at:].strip():
            raise self.error(card, f"{shown(rest)} is behind the last field, beyond column {at}")
        return found

    def _between_commas(self, card: Card, widths: Widths) -> list[str]:
        found = [item.strip() for item in card.text.split(",")]
        while len(found) > len(widths) and not found[-1]:
            found.pop()
        if len(found) > len(widths):
            raise self.error(card, f"{len(found)} fields between commas; *{self.name} has {len(widths)} here")
        return found + [""] * (len(widths) - len(found))

    def _valued(self, card: Card, item: str) -> str:
        if "&" not in item and not item.startswith("<"):
            return item
        try:
            return parameters.valued(item, self.values)
        except ValueError as error:
            raise self.error(card, str(error)) from None


def _crossed(card: Card) -> str:
    return "" if "," in card.text else " (fields have fixed widths)"


def placed(file: str, number: int) -> str:
    """Returns the place of a line as text: ``line 7`` or ``'sub/mesh.k', line 7``."""
    return f"{shown(file)}, line {number}" if file else f"line {number}"


class Deck:
    """The keywords of a deck and of the files that the deck includes, read once from the start."""

    def __init__(self, path: Path, without: Collection[str] = ()) -> None:
        """Creates the object without opening a file. ``without``: names of keywords whose cards are not stored."""
        self._without = without
        self.included = Included(path)
        """All files that have been read; the first one is the deck itself."""
        self.followed: list[Block] = []
        """Keywords that ``blocks`` has processed itself and does not yield: ``*COMMENT``, ``*INCLUDE``, ``*PARAMETER``
        and ``*END``."""
        self.ended = False
        """Whether the deck itself has ``*END``; a deck without it may be cut off."""
        self._parameters: parameters.Values = {}

    def blocks(self) -> Iterator[Block]:
        """Yields every keyword of the deck up to ``*END`` in the order of the deck, except ``*COMMENT``, ``*INCLUDE``
        and ``*PARAMETER``, which this function processes itself. Raises CardError; raises OSError if the deck itself
        cannot be opened.
        """
        return self._of(self.included.start(), "", _STANDARD)

    def _of(self, path: Path, file: str, least: int) -> Iterator[Block]:
        for block in self._plain(path, file, least):
            word, _, options = block.name.partition("_")
            if block.name in ("COMMENT", "INCLUDE") or word == "PARAMETER":
                self.followed.append(block)
            if block.name == "INCLUDE":
                for name, number in _names(block):
                    try:
                        entered = self.included.enter(name, path)
                    except ValueError as error:
                        raise CardError(f"{block.place(number)}: {error}") from None
                    yield from self._of(entered, name, block.least)
                    self.included.leave()
            elif word == "PARAMETER" and parameters.OPTIONS.issuperset(options.split("_") if options else ()):
                self._define(block, frozenset(options.split("_")))
            elif word in ("INCLUDE", "PARAMETER"):
                raise block.error(None, f"*{block.name} is not supported; write its contents into the deck")
            elif block.name != "COMMENT":
                yield block

    def _plain(self, path: Path, file: str, standing: int) -> Iterator[Block]:
        """Yields the keywords of one file. ``standing``: smallest width of a field of keywords without a suffix."""
        block: Block | None = None
        for number, text in _text(path, file):
            if text.startswith("*"):
                if block is not None:
                    yield block
                block = self._keyword(text, number, file, standing)
                standing = block.least if block.name == "KEYWORD" else standing
                if block.name == "END":
                    self.ended |= not file
                    self.followed.append(block)
                    return
            elif block is not None:
                if block.name not in self._without:
                    block.cards.append(Card(number, text))
            elif text.strip():
                raise CardError(f"{placed(file, number)}: {shown(text.strip())} is before the first keyword")
        if block is None:
            raise CardError(f"{placed(file, 1)}: the file has no keyword; this is no keyword deck")
        yield block

    def _keyword(self, text: str, number: int, file: str, standing: int) -> Block:
        found = _KEYWORD.fullmatch(text.partition("$")[0].strip())
        if found is None:
            raise CardError(f"{placed(file, number)}: {shown(text.strip())} is no keyword")
        name, suffix, rest = found[1].upper(), found[2], found[3]
        least = _SUFFIXES.get(suffix or "", standing)
        block = Block(name, number, file, [], least, rest[1:-1].strip(), self._parameters)
        if name == "KEYWORD":
            return _formatted(block, rest)
        if rest and not _REMARK.fullmatch(rest):
            raise block.error(None, f"{shown(rest)} is behind *{name}")
        return block

    def _define(self, block: Block, options: frozenset[str]) -> None:
        if "DUPLICATION" in options:
            return
        computed = "EXPRESSION" in options
        for card, name, text in _computed(block) if computed else _plain(block, options):
            try:
                self._parameters = parameters.defined(self._parameters, name, text, computed=computed)
            except ValueError as error:
                raise block.error(card, str(error)) from None


def _computed(block: Block) -> Iterator[tuple[Card, str, str]]:
    found = parameters.expressions([card.text for card in block.cards], block.least)
    return ((block.cards[index], name, text) for index, name, text in found)


def _plain(block: Block, options: frozenset[str]) -> Iterator[tuple[Card, str, str]]:
    for card in block.filled():
        for name, value in parameters.pairs(block.fields(card, *(10,) * 8), options):
            yield card, name, value


def _formatted(block: Block, rest: str) -> Block:
    """Returns the block with the smallest width that a line ``*KEYWORD`` sets: ``LONG=Y`` and ``LONG=K`` mean long
    input; ``LONG=S`` means standard input and long output.
    """
    found = {word.upper(): letter.upper() for word, letter in _SETTING.findall(rest)}
    if found.get("LONG", "S") not in "YKS" or found.get("I10", "Y") not in "YN":
        raise block.error(None, f"*KEYWORD {rest}: expected LONG = Y, K or S, and I10 = Y or N")
    if found.get("LONG", "S") != "S":
        return replace(block, least=_LONG)
    return replace(block, least=_I10 if found.get("I10") == "Y" else _STANDARD)


def _names(block: Block) -> Iterator[tuple[str, int]]:
    """Yields the file names in the cards of a keyword with the numbers of their lines. A name that ends with `` +``
    continues in the next line.
    """
    whole, first = "", 0
    for card in block.filled():
        first = first if whole else card.number
        whole += card.text.strip()
        if whole.endswith(" +"):
            whole = whole[:-2].rstrip()
            continue
        yield whole, first
        whole = ""
    if whole or not first:
        raise block.error(None, "*INCLUDE names no file, or half of a name")


def _text(path: Path, file: str) -> Iterator[tuple[int, str]]:
    """Yields the lines of a file that are not comments, with their numbers."""
    try:
        for number, text in lines(path):
            if not text.startswith("$"):
                yield number, text
    except ValueError as error:
        raise CardError(f"{shown(file)}: {error}" if file else str(error)) from None
    except OSError as error:
        if not file:
            raise
        raise CardError(f"{shown(file)}: {error.strerror}") from None
