"""Definitions of a keyword deck: nodes, solid elements, parts and sets."""

from array import array
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from conoid.cases.reading import cards
from conoid.cases.reading.cards import Block, Card

from .families import FURTHER, JOINING, SOLIDS, VOLUMES, refuse
from .sets import Sets

_NODE = (8, 16, 16, 16, 8, 8)
_TEN = (8,) * 10
_EIGHT = (10,) * 8
"""Widths of the fields of a node, of the nodes of an element, and of other cards (LS-DYNA manual, "*NODE",
"*ELEMENT_SOLID")."""
_OPTIONS = ("INERTIA", "CONTACT", "PRINT", "REPOSITION", "ATTACHMENT_NODES", "FIELD")
"""Options of ``*PART`` that add cards to the two cards of a part."""
_MOST = 2**53
"""Upper bound of the number that identifies a node or an element."""


@dataclass
class Solids:
    """Elements with the same number of nodes."""

    numbers: "array[int]" = field(default_factory=lambda: array("q"))
    parts: "array[int]" = field(default_factory=lambda: array("q"))
    nodes: "array[int]" = field(default_factory=lambda: array("q"))
    lines: "array[int]" = field(default_factory=lambda: array("q"))
    """Line of each element in the file; 0 in an included file."""


class Deck:
    """Definitions of a deck and of the files that it includes."""

    def __init__(self, path: Path) -> None:
        """Read the deck. Raises MeshError with a line that cannot be read, or CardError."""
        self.nodes, self.points = array("q"), array("d")
        self.solids: dict[int, Solids] = {}
        """Solid elements; the keys are the numbers of their nodes: 4, 8, 10, 20, 27."""
        self.titles: dict[int, str] = {}
        """Dictionary from the ids of the parts to their titles."""
        self.sets = Sets()
        self.passed, self.volumes, self.joining = Counter[str](), Counter[str](), Counter[str]()
        """Two counts for each keyword: of element cards that are not read, and of keywords that join bodies."""
        self.held = 0
        """Number of nodes that have constraints on their own card."""
        self.length = ""
        """Unit of length that the deck gives (LS-DYNA manual, "*CONTROL_UNITS"); empty if the deck gives no unit."""
        deck = cards.Deck(path)
        for block in deck.blocks():
            self._take(block)
        self.files, self.ended = deck.included.files, deck.ended

    def _take(self, block: Block) -> None:
        name, options = block.parted(_OPTIONS)
        if block.name == "NODE":
            self._node(block)
        elif block.name.startswith("ELEMENT_SOLID") and block.name[14:] in SOLIDS and block.name[13:14] in ("", "_"):
            self._solid(block, block.name[14:])
        elif name == "PART":
            self._part(block, bool(options))
        elif block.name == "CONTROL_UNITS":
            self.length = next((block.fields(card, *_EIGHT)[0].strip() for card in block.filled()), "")
        elif not self.sets.take(block):
            refuse(block, ())
            self._count(block)

    def _count(self, block: Block) -> None:
        many = sum(1 for _ in block.filled())
        if block.name.startswith(VOLUMES):
            self.volumes[block.name] += many
        elif block.name.startswith(JOINING):
            self.joining[block.name] += 1
        elif block.name.startswith("ELEMENT_"):
            self.passed[block.name] += many

    def _node(self, block: Block) -> None:
        for card in block.filled():
            number, x, y, z, tc, rc = block.fields(card, *_NODE)
            self.nodes.append(_number(block, card, number, "nid"))
            self.points.extend(block.real(card, text, axis) for text, axis in ((x, "x"), (y, "y"), (z, "z")))
            self.held += bool(block.real(card, tc, "tc") or block.real(card, rc, "rc"))

    def _solid(self, block: Block, option: str) -> None:
        rest = block.filled() if not option else iter(block.cards)
        for card in rest:
            if not card.text.strip():
                continue
            number, part, *nodes = block.fields(card, *_TEN)
            if not any(nodes):
                nodes = [each for _ in range(-(-SOLIDS[option] // 10)) for each in self._row(block, card, rest)]
            elif option in ("H20", "H27"):
                raise block.error(card, f"the nodes of *{block.name} are in the cards after the card with the number")
            for _ in range(FURTHER.get(option, 0)):
                if next(rest, None) is None:
                    raise block.error(card, "the cards of this element are cut off")
            self._keep(block, card, number, part, nodes, SOLIDS[option])

    def _row(self, block: Block, card: Card, rest: Iterator[Card]) -> list[str]:
        following = next(rest, None)
        if following is None:
            raise block.error(card, "the nodes of this element are missing")
        return block.fields(following, *_TEN)

    def _keep(self, block: Block, card: Card, number: str, part: str, texts: list[str], most: int) -> None:
        nodes = [block.whole(card, text, "node") for text in texts]
        while nodes and not nodes[-1]:
            nodes.pop()
        allowed = (4, 8, 10) if most == 8 else (most,)
        if len(nodes) not in allowed or not all(0 < node < _MOST for node in nodes):
            raise block.error(card, f"an element with {len(nodes)} nodes; expected {' or '.join(map(str, allowed))}")
        rows = self.solids.setdefault(len(nodes), Solids())
        rows.numbers.append(_number(block, card, number, "eid"))
        rows.parts.append(_number(block, card, part, "pid"))
        rows.nodes.extend(nodes)
        rows.lines.append(0 if block.file else card.number)

    def _part(self, block: Block, single: bool) -> None:
        """Read parts. A part has two cards. If the block has options, the part has further cards, and the block has one
        part only.
        """
        rows = list(block.cards)
        while rows and not rows[-1].text.strip():
            rows.pop()
        if len(rows) < 2 or (len(rows) % 2 and not single):
            raise block.error(None, "*PART has two cards for each part: a title, and its numbers")
        for title, card in zip(rows[::2][: 1 if single else None], rows[1::2], strict=False):
            number = _number(block, card, block.fields(card, *_EIGHT)[0], "pid")
            if number in self.titles:
                raise block.error(card, f"the part {number} is defined twice")
            self.titles[number] = title.text.strip()


def _number(block: Block, card: Card, text: str, what: str) -> int:
    found = block.whole(card, text, what)
    if not 0 < found < _MOST:
        raise block.error(card, f"{what} = {text!r} is no number of a node, an element or a part; the smallest is 1")
    return found
