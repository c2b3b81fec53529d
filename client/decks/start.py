"""Conversion of initial velocities of nodes or parts of a deck to initial velocities of the parts of a case."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from .account import Entry
from .draft import Body, Draft
from .topology import Chosen, Point, Topology
from .units import LENGTH


@dataclass
class Start:
    """Initial velocity that a keyword gives to nodes, in units of the deck. A keyword further down in the deck adds
    components or replaces the velocity.
    """

    chosen: Chosen
    entry: Entry
    velocity: dict[int, float] = field(default_factory=dict)
    """Initial velocity by axis; the axes are 0, 1 and 2."""
    rate: Point = (0.0, 0.0, 0.0)
    """Rotation vector in radians per unit of time of the deck."""
    centre: Point = (0.0, 0.0, 0.0)
    rank: int = 0
    """Priority of the velocity: it replaces velocities of a lower rank, also those further down in the deck."""


def begin(draft: Draft, topology: Topology, bodies: Sequence[Body], starts: Sequence[Start]) -> None:
    """Sets the initial velocity and the spin of each body."""
    by_key = {body.key: body for body in bodies}
    for each in sorted(starts, key=lambda start: start.rank):
        full, some = topology.whole(each.chosen)
        if some:
            names = ", ".join(by_key[key].name for key in some)
            each.entry.refuse(f"{each.chosen.what} has only some nodes of {names}; only whole parts have a velocity")
            continue
        if not full:
            each.entry.leave(f"{each.chosen.what} has no node of a part of the case")
        for key in full:
            _give(draft, by_key[key], each)
            each.entry.take(f"parts[{list(by_key).index(key)}].velocity")
            if any(each.rate):
                each.entry.take(f"parts[{list(by_key).index(key)}].spin")


def _give(draft: Draft, body: Body, start: Start) -> None:
    if body.spin or (any(start.rate) and body.velocity is not None):
        why = f"{body.name} already has an initial velocity; two initial velocities with a rotation are not translated"
        start.entry.remark("refused", start.chosen.what, why)
    old = body.velocity or (0.0, 0.0, 0.0)
    if any(old[axis] not in (0.0, value) for axis, value in start.velocity.items()):
        why = f"replaces the velocity that another keyword gives to {body.name}"
        start.entry.remark("differs", start.chosen.what, why)
    x, y, z = (start.velocity.get(axis, old[axis]) for axis in range(3))
    body.velocity = (x, y, z)
    if any(start.rate):
        body.spin = {"centre": draft.vector(start.centre, LENGTH), "rate": draft.vector(start.rate, (0, 0, -1, 0))}
