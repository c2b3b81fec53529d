"""Fields of LS-DYNA cards by their names in the manual."""

from collections.abc import Sequence

from conoid.cases.reading.cards import Block, Card

from .. import fields
from ..account import Entry

_WIDTH = 10
"""Width of a field, in columns, on all cards except those of nodes and elements (the manual, "Card format")."""


class Fields(fields.Fields[Card]):
    """The fields of some cards of a keyword."""

    def __init__(self, block: Block, entry: Entry, cards: Sequence[Card], layout: Sequence[str]) -> None:
        """``layout``: names of the fields of each card; ``-`` stands for an unused field."""
        self.block = block
        found: dict[str, tuple[Card, str]] = {}
        for card, names in zip(cards, layout, strict=False):
            items = zip(names.split(), block.fields(card, *(_WIDTH,) * 8), strict=False)
            found |= {name: (card, item) for name, item in items if name != "-"}
        super().__init__(entry, found, [card.number for card in cards[len(layout) :] if card.text.strip()])

    def _real(self, place: Card, item: str, name: str) -> float:
        return self.block.real(place, item, name)

    def _whole(self, place: Card, item: str, name: str) -> int:
        return self.block.whole(place, item, name)


def trimmed(cards: Sequence[Card]) -> list[Card]:
    """Returns the cards without the empty cards at the end; an empty card between other cards stays, with empty
    fields.
    """
    found = list(cards)
    while found and not found[-1].text.strip():
        found.pop()
    return found


def numbers(block: Block, cards: Sequence[Card], what: str, width: int = _WIDTH, count: int = 8) -> list[int]:
    """Reads whole numbers from many cards; empty fields are skipped. Raises CardError."""
    return [block.whole(card, item, what) for card in cards for item in block.fields(card, *(width,) * count) if item]
