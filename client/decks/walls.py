"""Conversion of rigid walls of a deck, which stop the nodes of a set, to walls of a case, which stop whole parts."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from .account import Entry
from .draft import Body, Draft
from .topology import Chosen, Topology


@dataclass(frozen=True)
class Stop:
    """A rigid wall of a deck: the nodes that it stops, and its table in the case without ``parts`` and ``name``."""

    chosen: Chosen
    table: dict[str, Any]
    entry: Entry
    more: list[Entry] = field(default_factory=list)
    """Further keywords that were translated into the table of this wall."""


def stand(draft: Draft, topology: Topology, bodies: Sequence[Body], stops: Sequence[Stop]) -> list[tuple[str, ...]]:
    """Adds walls to the case; returns, for each wall, the keys of the bodies that it stops."""
    names = {body.key: body.name for body in bodies}
    keys: list[tuple[str, ...]] = []
    for each in stops:
        full, some = topology.whole(each.chosen)
        stopped = tuple(key for key in topology.bodies if key in (*full, *some))
        if not stopped:
            for entry in (each.entry, *each.more):
                entry.leave(f"{each.chosen.what} has no node of a part of the case")
            continue
        if some:
            why = "in the deck the wall stops only some nodes of the parts, in Conoid all nodes"
            each.entry.remark("differs", each.chosen.what, why)
        table = {**each.table, "name": "wall" if not keys else f"wall_{len(keys) + 1}"}
        if len(stopped) < len(names):
            table["parts"] = [names[key] for key in stopped]
        keys.append(stopped)
        draft.add_boundary(table, each.entry, *each.more)
    return keys
