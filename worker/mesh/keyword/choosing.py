"""Contents of the sets of a keyword deck, and selection of the elements to which a name in a case refers."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...errors import MeshError
from ..model import Ids
from .deck import Deck
from .sets import Set

DEEPEST = 20
"""Largest depth of sets that contain sets. Chosen value: above the three levels that decks have."""
_KINDS = {"part": "PART", "set_part": "PART", "set_solid": "SOLID"}
"""Words before a colon, in a name such as ``part:NAME``, that select what the name refers to."""


@dataclass(frozen=True, eq=False)
class Content:
    """Arrays of a deck: numbers ``tags`` (n,) of the nodes; and numbers, parts (m,) and nodes of the elements."""

    deck: Deck
    tags: Ids
    numbers: Ids
    parts: Ids
    of_part: Callable[[Ids], Ids] = field(repr=False)
    """Function that returns the nodes of the given parts."""

    def members(self, kind: str, number: int, depth: int = 0) -> Ids:
        """Return those ids in a set that are ids of defined nodes, parts or elements. Raises MeshError."""
        one = self.deck.sets.found[kind].get(number)
        if one is None or depth > DEEPEST or one.unread:
            why = "is not defined" if one is None else one.unread or "has itself among its members"
            raise MeshError(f"the set {number} of *SET_{kind} {why}")
        every = {"NODE": self.tags, "PART": self._parts(), "SOLID": self.numbers}[kind]
        found = np.zeros(len(every), bool)
        for word, numbers in one.steps:
            bare = word.removeprefix("D")
            some = self._step(kind, bare, np.array(numbers, np.int64), every, depth)
            found = found & ~np.isin(every, some) if word != bare else found | np.isin(every, some)
        return every[found]

    def undefined(self) -> dict[str, Ids]:
        """Return, for each set, its members that are not defined as nodes, parts or solid elements."""
        known = {"NODE": self.tags, "PART": self._parts(), "ELEM": self.numbers}
        found = dict[str, Ids]()
        for kind, own in (("NODE", "NODE"), ("PART", "PART"), ("SOLID", "ELEM")):
            for number, one in self.deck.sets.found[kind].items():
                steps = [(own if word == "MEMBER" else word, numbers) for word, numbers in one.steps]
                lost = [np.setdiff1d(numbers, known[word]) for word, numbers in steps if word in known]
                some = np.concatenate([np.zeros(0, np.int64), *lost])
                found[f"*SET_{kind} {one.title or number}"] = some[some > 0]
        return found

    def _step(self, kind: str, word: str, numbers: Ids, every: Ids, depth: int) -> Ids:
        if word == "ALL":
            return every
        if word == "SET":
            return np.concatenate([np.zeros(0, np.int64), *(self.members(kind, int(n), depth + 1) for n in numbers)])
        if word == "RANGE":
            return _ranged(numbers, every)
        if word == "PART" and kind == "NODE":
            return self.of_part(numbers)
        if word == "PART" and kind == "SOLID":
            return self.numbers[np.isin(self.parts, numbers)]
        return numbers

    def _parts(self) -> Ids:
        return np.union1d(np.array(list(self.deck.titles), np.int64), self.parts)

    def chosen(self, group: str, key: str) -> "np.ndarray":
        """Return (m,) True for each element that belongs to ``group``. The group is the title or id of a part, of a set
        of parts or of a set of solids.
        """
        meant = list(self._meant(group))
        if not meant:
            raise MeshError(f"{key}.group = {group!r}: no such part or set; known: {self._known()}")
        for what, found in meant[1:]:
            if not np.array_equal(found, meant[0][1]):
                raise MeshError(
                    f"{key}.group = {group!r}: may be {meant[0][0]} or {what}, which differ; write 'part:{group}', "
                    f"'set_part:{group}' or 'set_solid:{group}'"
                )
        return meant[0][1]

    def _meant(self, group: str) -> "list[tuple[str, np.ndarray]]":
        word, colon, name = group.partition(":")
        if colon and word in _KINDS:
            return self._of(word, name)
        if group.isdecimal() and (found := self._of("part", group)):
            return found
        return [each for kind in _KINDS for each in self._of(kind, group)]

    def _of(self, word: str, name: str) -> "list[tuple[str, np.ndarray]]":
        titles = self.deck.titles if word == "part" else {n: one.title for n, one in self._sets(word).items()}
        if word == "part":
            titles = dict.fromkeys(np.unique(self.parts).tolist(), "") | titles
        exact = [number for number, title in titles.items() if name in (title, str(number))]
        if word == "part":
            exact = [number for number in exact if str(number) == name] or exact
        alike = exact or [number for number, title in titles.items() if name.casefold() == title.casefold()]
        return [(f"the {word} {number}", self._elements(word, number)) for number in alike]

    def _sets(self, word: str) -> dict[int, Set]:
        return self.deck.sets.found[_KINDS[word]]

    def _elements(self, word: str, number: int) -> "np.ndarray":
        if word == "part":
            return np.asarray(self.parts == number)
        members = self.members(_KINDS[word], number)
        return np.isin(self.parts if word == "set_part" else self.numbers, members)

    def _known(self) -> str:
        names = [title or str(number) for number, title in self.deck.titles.items()]
        for kind in ("set_part", "set_solid"):
            names += [f"{kind}:{one.title or number}" for number, one in self._sets(kind).items()]
        return ", ".join(names) or "none"


def _ranged(numbers: Ids, every: Ids) -> Ids:
    """Return the ids of ``every`` that are in the ranges of the list ``numbers``. Each range begins with the count of
    its numbers, which is two or three.
    """
    step, found = int(numbers[0]), np.zeros(len(every), bool)
    for k in range(1, len(numbers) - step + 1, step):
        first, last, *by = numbers[k : k + step]
        if last:
            found |= (every >= first) & (every <= last) & ((every - first) % max(int(by[0]) if by else 1, 1) == 0)
    return every[found]
