"""The table ``contact`` of a case from the contacts of a deck: parts in contact and their friction."""

import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .account import Entry
from .draft import Body, Draft


@dataclass(frozen=True)
class Meeting:
    """A contact of a deck: the keys of its bodies, which are in contact with ``other``. If ``other`` is None, the
    bodies are in contact with each other and with themselves.
    """

    one: frozenset[str]
    other: frozenset[str] | None
    friction: float
    entry: Entry

    @property
    def meets(self) -> bool:
        """True if the contact has bodies on both sides."""
        return bool(self.one) and self.other != frozenset()

    def pairs(self) -> set[tuple[str, str]]:
        """Pairs of different bodies in contact; the two keys of a pair are sorted."""
        every = itertools.combinations(self.one, 2) if self.other is None else itertools.product(self.one, self.other)
        return {(min(pair), max(pair)) for pair in every if pair[0] != pair[1]}


def meet(draft: Draft, bodies: Sequence[Body], meetings: Sequence[Meeting]) -> None:
    """Writes the table ``contact`` of the case: "none" if the deck has no contact."""
    for each in meetings:
        if not each.meets:
            each.entry.leave("one of its surfaces has no part of the case")
    meetings = [each for each in meetings if each.meets]
    if not meetings:
        if len(bodies) > 1:
            draft.account.remarks.append('the deck has no contact: contact = "none", bodies pass through each other')
        return
    names = {body.key: body.name for body in bodies}
    met = _frictions(meetings)
    inside = [body for body in bodies if any(body.key in m.one or body.key in (m.other or ()) for m in meetings)]
    table: dict[str, Any] = {}
    if len(inside) < len(bodies):
        table["parts"] = [body.name for body in inside]
    rigid = {key for key, _ in draft.rigid_parts()}
    alone = {key for each in meetings if each.other is None for key in each.one} - rigid
    if alone:
        table["self_contact"] = [body.name for body in bodies if body.key in alone]
    common = Counter(met.values()).most_common(1)[0][0] if met else meetings[0].friction
    table["friction"] = common
    if other := [
        {"parts": [names[a], names[b]], "friction": value} for (a, b), value in sorted(met.items()) if value != common
    ]:
        table["pairs"] = other
    draft.contact = table
    for each in meetings:
        each.entry.take("contact")
    _more(meetings, met, [body.key for body in inside], names)


def _frictions(meetings: Sequence[Meeting]) -> dict[tuple[str, str], float]:
    """Returns the friction coefficient of each pair. A contact between two named bodies has priority over a contact
    of all bodies.
    """
    met: dict[tuple[str, str], float] = {}
    for each in sorted(meetings, key=lambda one: one.other is not None):
        for pair in each.pairs():
            met[pair] = each.friction
    return met


def _more(
    meetings: Sequence[Meeting], met: dict[tuple[str, str], float], inside: list[str], names: dict[str, str]
) -> None:
    """Adds a remark to the account about pairs of bodies that are in contact in the case but not in the deck."""
    extra = [(a, b) for a, b in itertools.combinations(sorted(inside), 2) if (a, b) not in met]
    if extra:
        shown = ", ".join(f"{names[a]} and {names[b]}" for a, b in extra[:3]) + (" ..." if len(extra) > 3 else "")
        meetings[0].entry.remark("differs", "pairs", f"{shown} are in contact in Conoid, but not in the deck")
