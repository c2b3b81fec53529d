"""Sets and curves of an LS-DYNA deck."""

from dataclasses import dataclass, field
from itertools import pairwise

from conoid.cases.reading.cards import Block, Card

from ..account import Entry
from .fields import Fields, numbers

Curve = tuple[tuple[float, float], ...]


@dataclass
class NodeSet:
    """Node set of ``*SET_NODE`` or ``*SET_SEGMENT``: nodes, and parts whose nodes belong to the set."""

    number: int
    title: str
    entry: Entry
    nodes: set[int] = field(default_factory=set)
    parts: set[int] = field(default_factory=set)
    sets: set[int] = field(default_factory=set)
    """Numbers of other sets that the set includes (option ``_ADD``)."""
    ranges: list[range] = field(default_factory=list)
    """Ranges of node numbers; not every number in a range needs to be a node."""
    everything: bool = False
    odd: str = ""
    """Reason why the nodes of the set are unknown; empty if the nodes are known."""


def titled(block: Block, options: frozenset[str]) -> tuple[str, list[Card]]:
    """Returns the title of a keyword with the option TITLE, and the cards after the title."""
    cards = list(block.cards)
    if "TITLE" in options and cards:
        return cards[0].text.strip(), cards[1:]
    return "", cards


def node_set(block: Block, options: frozenset[str], entry: Entry) -> NodeSet:
    """Reads a set of nodes. Raises CardError."""
    title, cards = titled(block, options)
    head = Fields(block, entry, cards, ("SID DA1 DA2 DA3 DA4 SOLVER",))
    found = NodeSet(head.whole("SID"), title, entry)
    rest = [card for card in cards[1:] if card.text.strip()]
    if "GENERAL" in options:
        _general(found, block, rest)
    elif "GENERATE" in options:
        ends = numbers(block, rest, "nid")
        for first, last in zip(ends[::2], ends[1::2], strict=False):
            if last < first:
                raise block.error(rest[0], f"the range from {first} to {last} has no numbers")
            found.ranges.append(range(first, last + 1))
    elif "ADD" in options and not options - {"TITLE", "ADD"}:
        found.sets.update(numbers(block, rest, "sid"))
    elif options - {"TITLE", "LIST"}:
        found.odd = f"*{block.name} is not supported"
    else:
        found.nodes.update(numbers(block, rest, "nid"))
    return found


def _general(found: NodeSet, block: Block, cards: list[Card]) -> None:
    for card in cards:
        word, *items = block.fields(card, *(10,) * 8)
        values = [block.whole(card, item, "id") for item in items if item]
        if word.upper() == "ALL":
            found.everything = True
        elif word.upper() == "NODE":
            found.nodes.update(values)
        elif word.upper() == "PART":
            found.parts.update(values)
        else:
            found.odd = f"{word} in *{block.name} is not supported"


def segment_set(block: Block, options: frozenset[str], entry: Entry) -> NodeSet:
    """Reads a set of faces as the set of the nodes of these faces. Raises CardError."""
    title, cards = titled(block, options)
    found = NodeSet(Fields(block, entry, cards, ("SID",)).whole("SID"), title, entry)
    if options - {"TITLE"}:
        found.odd = f"*{block.name} is not supported"
        return found
    for card in cards[1:]:
        found.nodes.update(block.whole(card, item, "n") for item in block.fields(card, *(10,) * 8)[:4] if item)
    return found


def curve(block: Block, options: frozenset[str], entry: Entry) -> tuple[int, Curve]:
    """Reads ``*DEFINE_CURVE``: the number of the curve, and its scaled and shifted points. Raises CardError."""
    _, cards = titled(block, options)
    head = Fields(block, entry, cards[:1], ("LCID SIDR SFA SFO OFFA OFFO DATTYP LCINT",))
    number = head.whole("LCID")
    along, across = head.nonzero("SFA", 1.0), head.nonzero("SFO", 1.0)
    right, up = head.real("OFFA"), head.real("OFFO")
    head.refuse("SIDR", "curve for the dynamic relaxation, which Conoid does not have")
    head.forgive("DATTYP LCINT", "no effect on a curve over time or strain")
    points = []
    for card in cards[1:]:
        if card.text.strip():
            x, y = (block.real(card, item, "value") for item in block.fields(card, 20, 20))
            points.append((along * (x + right), across * (y + up)))
    if any(a[0] >= b[0] for a, b in pairwise(points)):
        raise block.error(None, f"the abscissas of the curve {number} do not increase")
    return number, tuple(points)
