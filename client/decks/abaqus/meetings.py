"""General contact, contact pairs and ties of an Abaqus input file."""

from collections.abc import Callable, Sequence

from conoid.cases.reading.inp import InpError, numbers

from ..account import Entry
from ..bonds import MOVED, Tie
from ..contacts import Meeting
from ..draft import Body
from .keyword import Keyword, joined

Surface = Callable[[str, Entry], frozenset[str]]


class Meetings:
    """Reader of the contacts and ties of a deck."""

    def __init__(self, keywords: Sequence[Keyword], bodies: Sequence[Body], surface: Surface) -> None:
        """Starts without contacts; ``surface``: function that returns the bodies of a surface by its name, or raises
        InpError.
        """
        self.made: list[Meeting] = []
        self.ties: list[Tie] = []
        self._every = frozenset(body.key for body in bodies)
        self._surface = surface
        self._frictions = self._interactions(keywords)
        self._general(keywords)
        for each in keywords:
            if each.word in ("CONTACT PAIR", "TIE"):
                self._guarded(self._pair if each.word == "CONTACT PAIR" else self._tie, each)

    def _guarded(self, do: Callable[[Keyword], None], each: Keyword) -> None:
        try:
            do(each)
        except (InpError, ValueError) as error:
            each.entry.refuse(str(error))

    def _interactions(self, keywords: Sequence[Keyword]) -> dict[str, tuple[float, list[Keyword]]]:
        """Friction coefficient of each ``*SURFACE INTERACTION``, and the keywords that belong to it."""
        found: dict[str, tuple[float, list[Keyword]]] = {}
        here = ""
        for each in keywords:
            if each.word == "SURFACE INTERACTION":
                here = each.key("NAME")
                found[here] = 0.0, [each]
            elif each.word == "FRICTION" and here:
                self._guarded(lambda one, name=here: found.update({name: (self._friction(one), found[name][1])}), each)  # type: ignore[misc]
                found[here][1].append(each)
        return found

    def _friction(self, each: Keyword) -> float:
        each.forgive("SLIP TOLERANCE, ELASTIC SLIP, SHEAR TRACTION SLOPE", "stiffness of sticking")
        each.rest()
        return each.single(1)[0]

    def _of(self, name: str | None, entry: Entry) -> float:
        if not name:
            return 0.0
        if joined(name) not in self._frictions:
            raise InpError(f"the surface interaction {name!r} is not defined")
        friction, keywords = self._frictions[joined(name)]
        for each in keywords:
            each.entry.take(f"of {entry.keyword}, {entry.place}")
        return friction

    # General contact --------------------------------------------------------------------------------------------------

    def _general(self, keywords: Sequence[Keyword]) -> None:
        heads = [each for each in keywords if each.word == "CONTACT"]
        friction, pairs = 0.0, list[tuple[frozenset[str], frozenset[str], float, Entry]]()
        for each in keywords:
            if each.word == "CONTACT PROPERTY ASSIGNMENT":
                try:
                    friction, pairs = self._assigned(each)
                except (InpError, ValueError) as error:
                    each.entry.refuse(str(error))
        for each in keywords:
            if each.word == "CONTACT INCLUSIONS":
                self._guarded(lambda one: self._included(one, friction), each)
        if self.made:
            self.made += [Meeting(one, other, mu, entry) for one, other, mu, entry in pairs]
        for head in heads:
            head.forgive("OP", "a case with one step has one contact definition")
            head.rest()
            head.entry.take("contact") if self.made else head.entry.leave("it includes nothing")

    def _included(self, each: Keyword, friction: float) -> None:
        if each.has("ALL EXTERIOR") or not each.lists():
            each.rest()
            self.made.append(Meeting(self._every, None, friction, each.entry))
            return
        each.rest()
        for _, items in each.lists():
            one, other = (*items, "")[:2]
            if not one and not other:
                self.made.append(Meeting(self._every, None, friction, each.entry))
                continue
            first = self._surface(one, each.entry) if one else self._every
            second = self._surface(other, each.entry) if other else first
            self.made.append(Meeting(first, None if second == first else second, friction, each.entry))

    def _assigned(self, each: Keyword) -> tuple[float, list[tuple[frozenset[str], frozenset[str], float, Entry]]]:
        """Reads the friction coefficient of general contact, and the coefficients of single pairs of surfaces."""
        friction, pairs = 0.0, []
        each.rest()
        for _, items in each.lists():
            one, other, name = (*items, "", "")[:3]
            value = self._of(name, each.entry)
            if not one and not other:
                friction = value
            else:
                first = self._surface(one, each.entry) if one else self._every
                pairs.append((first, self._surface(other, each.entry) if other else first, value, each.entry))
        each.entry.take("contact.friction")
        return friction, pairs

    # Pairs ------------------------------------------------------------------------------------------------------------

    def _pair(self, each: Keyword) -> None:
        friction = self._of(each.get("INTERACTION"), each.entry)
        each.forgive(
            "MECHANICAL CONSTRAINT, WEIGHT, CPSET, TYPE, OP, SMALL SLIDING",
            "setting of the contact algorithm of Abaqus",
        )
        each.rest()
        for _, items in each.lists():
            one = self._surface(items[0], each.entry)
            other = self._surface(items[1], each.entry) if len(items) > 1 and items[1] else None
            self.made.append(Meeting(one, other, friction, each.entry))

    def _tie(self, each: Keyword) -> None:
        gap = numbers(each.line, each.get("POSITION TOLERANCE") or "0")[0]
        if (each.get("ADJUST") or "").upper() == "NO":
            each.entry.remark("differs", "ADJUST=NO", MOVED)
        each.forgive("NAME, ADJUST, TYPE, NO ROTATION", "setting with which Abaqus finds the tied nodes")
        each.rest()
        for _, items in each.lists():
            pairs = Meeting(self._surface(items[0], each.entry), self._surface(items[1], each.entry), 0.0, each.entry)
            self.ties += [Tie(pair, each.entry, gap) for pair in sorted(pairs.pairs())]
