"""Nodes of the parts of an LS-DYNA deck and their positions. The import reads the deck a second time if keywords
need the nodes.
"""

from pathlib import Path

from conoid.cases.reading.cards import Block, Card, Deck

from ..topology import Point

_NODE, _SOLID = (8, 16, 16, 16, 8, 8), (8,) * 10
"""Widths of the fields, in columns (LS-DYNA Keyword User's Manual I, *NODE and *ELEMENT_SOLID)."""


def read_points(path: Path) -> dict[int, Point]:
    """Returns the positions of nodes, by their numbers. Raises CardError."""
    points: dict[int, Point] = {}
    for block in Deck(path).blocks():
        if block.name == "NODE":
            for card in block.filled():
                number, point = _point(block, card)
                points[number] = point
    return points


def _point(block: Block, card: Card) -> tuple[int, Point]:
    text = card.text
    if block.least <= _NODE[0] and "," not in text:
        try:  # Ten times as fast as the general reader.
            return int(text[:8]), (float(text[8:24]), float(text[24:40]), float(text[40:56]))
        except ValueError:
            pass
    number, *place = block.fields(card, *_NODE)[:4]
    x, y, z = (block.real(card, item, "coordinate") for item in place)
    return block.whole(card, number, "nid"), (x, y, z)


def held_of(block: Block) -> dict[int, set[int]]:
    """Returns the nodes that ``*NODE`` itself fixes, by the code of the fixed translations (TC). Raises CardError."""
    found: dict[int, set[int]] = {}
    start = sum(max(width, block.least) for width in _NODE[:4])
    for card in block.filled():
        text = card.text
        if text.count(",") < 4 if "," in text else not text[start:].strip(" 0"):
            continue
        number, _, _, _, code, _ = block.fields(card, *_NODE)
        if block.whole(card, code, "tc"):
            found.setdefault(block.whole(card, code, "tc"), set()).add(block.whole(card, number, "nid"))
    return found


def read_nodes(path: Path) -> dict[str, set[int]]:
    """Returns the nodes of each part with solids; the keys are part numbers as text. Raises CardError."""
    nodes: dict[str, set[int]] = {}
    for block in Deck(path, without=("NODE",)).blocks():
        if block.name == "ELEMENT_SOLID":
            _solids(block, nodes)
    return nodes


def parts_of(block: Block) -> set[str]:
    """Returns the numbers, as text, of the parts that have elements in ``*ELEMENT_SOLID``. Raises CardError."""
    heads = _heads(block)
    if any("," in card.text for card in heads[:1]):
        return {str(block.whole(card, "".join(_items(block, card)[1:2]), "pid")) for card in heads}
    width = max(8, block.least)
    written = {card.text[width : 2 * width].strip(): card for card in heads}
    return {str(block.whole(card, text, "pid")) for text, card in written.items()}


def _heads(block: Block) -> list[Card]:
    """Returns the cards with the numbers of element and part: each card, or each second card if the nodes are on a card
    of their own.
    """
    cards = list(block.filled())
    two = bool(cards) and len(_items(block, cards[0])) <= 2
    return cards[:: 1 + two]


def _solids(block: Block, nodes: dict[str, set[int]]) -> None:
    heads, cards = _heads(block), list(block.filled())
    two = len(heads) < len(cards)
    plain = block.least <= _SOLID[0]
    for head, tail in zip(heads, cards[1::2] if two else cards, strict=False):
        if plain and not two and "," not in head.text and (quick := _quick(head.text)) is not None:
            nodes.setdefault(quick[0], set()).update(quick[1])
            continue
        part = block.whole(head, "".join(_items(block, head)[1:2]), "pid")
        corners = _items(block, tail)[0 if two else 2 :]
        nodes.setdefault(str(part), set()).update(block.whole(tail, item, "n") for item in corners if item.strip("0 "))


def _quick(text: str) -> tuple[str, list[int]] | None:
    """Returns part and nodes of an element card in the plain format without empty fields; None for a card in another
    format.
    """
    items = text.split()
    if len(items) * 8 < len(text.rstrip()) or len(items) < 6:
        return None
    try:
        return str(int(items[1])), [int(item) for item in items[2:] if item != "0"]
    except ValueError:
        return None


def _items(block: Block, card: Card) -> list[str]:
    items = block.fields(card, *_SOLID)
    while items and not items[-1]:
        items.pop()
    return items
