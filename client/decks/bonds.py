"""Bonds of a case between joined parts of a deck: parts with common nodes, or parts that a keyword ties."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from .account import Entry
from .draft import Body, Draft
from .topology import Topology
from .units import LENGTH

MOVED = "the deck keeps the distance between the tied surfaces; Conoid moves tied nodes onto the faces at the start"
"""Remark for ties that do not move nodes."""


@dataclass(frozen=True)
class Tie:
    """Two tied bodies of a deck."""

    pair: tuple[str, str]
    """Keys of the bodies."""
    entry: Entry
    """The keyword that ties the bodies."""
    gap: float = 0.0
    """Largest distance between tied surfaces, in the unit of the deck; 0 if the deck does not give it."""


def join(draft: Draft, topology: Topology, bodies: Sequence[Body], ties: Iterable[Tie]) -> None:
    """Adds a ``[[bond]]`` for each pair of joined bodies."""
    names = {body.key: body.name for body in bodies}
    shared = topology.joined() if len(bodies) > 1 else []
    rigid = {key for key, _ in draft.rigid_parts()}
    for one, other in shared:
        kind = "shared" if rigid.isdisjoint((one, other)) else "tied"
        draft.bonds.append({"kind": kind, "parts": [names[one], names[other]]})
        draft.account.remarks.append(f'{names[one]} and {names[other]} share nodes: [[bond]] kind = "{kind}"')
    places: dict[tuple[str, str], int] = {}
    for tie in ties:
        one, other = tie.pair
        if (one, other) in shared or (other, one) in shared:
            tie.entry.leave(f"{names[one]} and {names[other]} share nodes")
            continue
        table: dict[str, object] = {"kind": "tied", "parts": [names[one], names[other]]}
        if tie.gap > 0.0:
            table["gap"] = draft.quantity(tie.gap, LENGTH)
        if (one, other) not in places:
            places[one, other] = len(draft.bonds)
            draft.bonds.append(table)
        place = places[one, other]
        if draft.bonds[place].get("gap") != table.get("gap"):
            tie.entry.refuse(f"{names[one]} and {names[other]} are tied twice, with different tolerances")
        tie.entry.take(f"bond[{place}]")
