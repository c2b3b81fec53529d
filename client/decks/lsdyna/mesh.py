"""Which nodes the parts of an LS-DYNA deck have, and where they are: a second reading, when somebody asks."""

from pathlib import Path

from conoid.cases.cards import Block, Card, Deck

from ..topology import Mesh, Point


def read_mesh(path: Path) -> Mesh:
    """Nodes of each part with solids, by its number as text. Raises CardError."""
    nodes: dict[str, set[int]] = {}
    points: dict[int, Point] = {}
    for block in Deck(path).blocks():
        if block.name == "NODE":
            for card in block.filled():
                number, x, y, z, *_ = block.fields(card, 8, 16, 16, 16, 8, 8)
                values = [block.real(card, item, "coordinate") for item in (x, y, z)]
                points[block.whole(card, number, "nid")] = (values[0], values[1], values[2])
        elif block.name.startswith("ELEMENT_SOLID"):
            _solids(block, nodes)
    return Mesh(nodes, points)


def parts_of(block: Block) -> set[str]:
    """Numbers of the parts that have elements in ``*ELEMENT_SOLID``, as text. Raises CardError."""
    cards = list(block.filled())
    two = bool(cards) and len(_items(block, cards[0])) <= 2
    if "," in cards[0].text if cards else False:
        return {str(block.whole(card, _items(block, card)[1], "pid")) for card in cards[:: 1 + two]}
    width = max(8, block.least)
    written = {card.text[width : 2 * width].strip(): card for card in cards[:: 1 + two]}
    return {str(block.whole(card, text, "pid")) for text, card in written.items()}


def _solids(block: Block, nodes: dict[str, set[int]]) -> None:
    """Solids on one line, or on two lines (``ten nodes format``): number and part, then the nodes."""
    cards = list(block.filled())
    if not cards:
        return
    two = len(_items(block, cards[0])) <= 2
    for head, tail in zip(cards[:: 1 + two], cards[1::2] if two else cards, strict=False):
        part, *corners = [*_items(block, head)[1:2], *_items(block, tail)[0 if two else 2 :]]
        nodes.setdefault(str(block.whole(head, part, "pid")), set()).update(
            block.whole(tail, item, "n") for item in corners if item.strip("0 ")
        )


def _items(block: Block, card: Card) -> list[str]:
    items = block.fields(card, *(8,) * 10)
    while items and not items[-1]:
        items.pop()
    return items
