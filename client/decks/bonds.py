"""Bonds of a case between joined parts of a deck: parts with common nodes, or parts that a keyword ties."""

from collections.abc import Iterable, Sequence

from .account import Entry
from .draft import Body, Draft
from .topology import Topology

Tie = tuple[tuple[str, str], Entry]
"""Keys of two tied bodies, and the keyword that ties these bodies."""


def join(draft: Draft, topology: Topology, bodies: Sequence[Body], ties: Iterable[Tie]) -> None:
    """Adds a ``[[bond]]`` for each pair of joined bodies."""
    names = {body.key: body.name for body in bodies}
    shared = topology.joined() if len(bodies) > 1 else []
    for one, other in shared:
        draft.bonds.append({"kind": "shared", "parts": [names[one], names[other]]})
        draft.account.remarks.append(f'{names[one]} and {names[other]} share nodes: [[bond]] kind = "shared"')
    for (one, other), entry in ties:
        if (one, other) in shared or (other, one) in shared:
            entry.leave(f"{names[one]} and {names[other]} share nodes")
            continue
        entry.take(f"bond[{len(draft.bonds)}]")
        draft.bonds.append({"kind": "tied", "parts": [names[one], names[other]]})
