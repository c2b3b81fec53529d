"""Sets of a keyword deck: ``*SET_NODE``, ``*SET_SEGMENT``, ``*SET_PART`` and ``*SET_SOLID``."""

from dataclasses import dataclass, field

from conoid.cases.reading.cards import Block, Card

_WIDTHS = (10,) * 8
_KINDS = ("NODE", "SEGMENT", "PART", "SOLID")
_OPTIONS = ("TITLE", "LIST", "GENERATE", "INCREMENT", "COLUMN", "GENERAL", "ADD", "COLLECT", "SMOOTH")
_FIRST = 1
"""Number of cards before the members of a set. The card has the id of the set and its attributes."""
_GENERAL = {"NODE": ("ALL", "NODE", "DNODE", "PART", "DPART"), "PART": ("ALL", "PART", "DPART"),
            "SOLID": ("ALL", "ELEM", "DELEM", "PART", "DPART"), "SEGMENT": ("SEG",)}  # fmt: skip
"""First words of the cards of a set with the option ``_GENERAL`` that are supported. A word that begins with ``D``
removes members."""
MOST = 20_000_000
"""Largest count of the numbers of one range. Chosen value: it is more than the number of elements of a mesh that fits
into about 100 GB of memory."""


@dataclass
class Set:
    """A set as the deck defines it: an ordered list of steps that add or remove members."""

    id: int
    title: str
    steps: list[tuple[str, list[int]]] = field(default_factory=list)
    """Steps that add or remove members: a word (``NODE``, ``DNODE``, ``RANGE``, ``PART``, ``ALL``, ``SET``, ``SEG``)
    and its numbers."""
    unread: str = ""
    """Reason why the set is not read; empty if the set is read."""


class Sets:
    """Sets of a deck; the key of a set is its kind and id."""

    def __init__(self) -> None:
        """Create an object without sets."""
        self.found: dict[str, dict[int, Set]] = {kind: {} for kind in _KINDS}

    def take(self, block: Block) -> bool:
        """Read a block. Return True if the block belongs to a set. Raises CardError."""
        name, options = block.parted(_OPTIONS)
        kind = name.removeprefix("SET_")
        if not name.startswith("SET_") or kind not in _KINDS:
            return False
        rows = list(block.filled()) if "TITLE" not in options else block.cards
        title = rows.pop(0).text.strip() if "TITLE" in options and rows else ""
        rows = [card for card in rows if card.text.strip()]
        if not rows:
            raise block.error(None, f"*{block.name} has no id")
        number = block.whole(rows[0], block.fields(rows[0], *_WIDTHS)[0], "sid")
        if number < 1:
            raise block.error(rows[0], "sid is not above 0")
        one = self.found[kind].get(number)
        if one is not None and "COLLECT" not in options:
            raise block.error(rows[0], f"the set {number} of *SET_{kind} is defined twice")
        one = one or self.found[kind].setdefault(number, Set(number, title))
        for card in rows[_FIRST:]:
            _step(one, block, card, kind, options)
        return True


def _step(one: Set, block: Block, card: Card, kind: str, options: frozenset[str]) -> None:
    items = block.fields(card, *_WIDTHS)
    if "GENERAL" in options:
        word, items = items[0].upper(), items[1:]
        if word not in _GENERAL[kind]:
            one.unread = f"{block.place(card.number)}: the option {word!r} is not supported"
            return
    elif "ADD" in options:
        word = "SET"
    elif kind == "SEGMENT":
        word, items = "SEG", items[:4]
        if "GENERATE" in options:
            one.unread = f"{block.place(card.number)}: *{block.name} is not supported"
            return
    else:
        word = "RANGE" if "GENERATE" in options else "MEMBER"
        items = items[:1] if "COLUMN" in options else items
    numbers = [block.whole(card, item, "member") for item in items]
    if word == "SEG":
        numbers = numbers[:4]
    elif word == "RANGE":
        step = 3 if "INCREMENT" in options else 2
        _ranges(block, card, numbers, step)
        numbers = [step, *numbers]
    else:
        numbers = [number for number in numbers if number]
    one.steps.append((word, numbers))


def _ranges(block: Block, card: Card, numbers: list[int], step: int) -> None:
    for k in range(0, len(numbers) - step + 1, step):
        first, last = numbers[k : k + 2]
        if ((first or last) and not 0 < first <= last) or last - first > MOST:
            raise block.error(card, f"no numbers lead from {first} to {last}")
