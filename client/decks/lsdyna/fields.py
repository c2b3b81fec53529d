"""Cards with named fields: what was read of them, and what was not."""

from collections.abc import Sequence

from conoid.cases.cards import Block, Card, CardError

from ..account import Entry, Remark

_WIDTH = 10
"""Columns of a field of a card that is no node and no element (the manual, "Card format")."""


class Fields:
    """The fields of some cards of a keyword, by the names that the manual gives them.

    What is not 0 and was read by nobody is told at the end (``rest``): nothing is passed over in silence.
    """

    def __init__(self, block: Block, entry: Entry, cards: Sequence[Card], layout: Sequence[str]) -> None:
        """``layout``: names of the fields of each card, ``-`` for one without meaning."""
        self.block, self.entry = block, entry
        self._found: dict[str, tuple[Card, str]] = {}
        self._read: set[str] = set()
        for card, names in zip(cards, layout, strict=False):
            words = names.split()
            for name, item in zip(words, block.fields(card, *(_WIDTH,) * 8), strict=False):
                if name != "-":
                    self._found[name] = card, item
        self.more = list(cards[len(layout) :])
        """Cards behind the layout."""

    def given(self, name: str) -> bool:
        """Whether the field is there and not empty."""
        return bool(self._found.get(name, (None, ""))[1])

    def real(self, name: str, default: float = 0.0) -> float:
        """A number; ``default`` for an empty field. Raises CardError."""
        self._read.add(name)
        card, item = self._found.get(name, (None, ""))
        return default if card is None or not item else self.block.real(card, item, name)

    def nonzero(self, name: str, default: float) -> float:
        """A number of which 0 means the default. Raises CardError."""
        return self.real(name) or default

    def whole(self, name: str, default: int = 0) -> int:
        """A whole number; ``default`` for an empty field. Raises CardError."""
        self._read.add(name)
        card, item = self._found.get(name, (None, ""))
        return default if card is None or not item else self.block.whole(card, item, name)

    def text(self, name: str) -> str:
        """The text of a field."""
        self._read.add(name)
        return self._found.get(name, (None, ""))[1]

    def forgive(self, names: str, why: str) -> None:
        """Fields that are left out, and why; those that are 0 say nothing."""
        self._tell("left", names.split(), why)

    def refuse(self, names: str, why: str) -> None:
        """Fields without which the case would answer wrong."""
        self._tell("refused", names.split(), why)

    def differ(self, name: str, why: str) -> None:
        """A field whose meaning differs here."""
        self._read.add(name)
        self.entry.remark("differs", self._shown(name), why)

    def rest(self, kind: Remark, why: str = "not taken over") -> None:
        """Everything that is not 0 and nobody has read."""
        self._tell(kind, [name for name in self._found if name not in self._read], why)
        extra = [card.number for card in self.more if card.text.strip()]
        if extra:
            self.entry.remark(kind, f"line {extra[0]}", "a card that is not read here")

    def _tell(self, kind: Remark, names: list[str], why: str) -> None:
        for name in names:
            self._read.add(name)
            if not self._void(name):
                self.entry.remark(kind, self._shown(name), why)

    def _void(self, name: str) -> bool:
        card, item = self._found.get(name, (None, ""))
        try:
            return card is None or self.block.real(card, item, name) == 0.0
        except CardError:
            return False

    def _shown(self, name: str) -> str:
        return f"{name} = {self._found.get(name, (None, ''))[1] or '(empty)'}"


def trimmed(cards: Sequence[Card]) -> list[Card]:
    """The cards without empty ones at their end; an empty one between others has empty fields."""
    found = list(cards)
    while found and not found[-1].text.strip():
        found.pop()
    return found


def numbers(block: Block, cards: Sequence[Card], what: str, width: int = _WIDTH, count: int = 8) -> list[int]:
    """Whole numbers of many cards, without the empty ones. Raises CardError."""
    return [block.whole(card, item, what) for card in cards for item in block.fields(card, *(width,) * count) if item]
