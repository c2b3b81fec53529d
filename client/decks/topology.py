"""Nodes of the parts of a deck and their positions. Nodes and positions are read only if a keyword needs the common
nodes of bodies.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Chosen:
    """Target of a load or a motion: whole parts, or nodes."""

    what: str
    """Name of the target in messages, such as ``node set 3``."""
    bodies: frozenset[str] | None = None
    """Keys of the parts of a target; None if the target consists of nodes."""
    nodes: Callable[[], set[int]] | None = None
    """Function that reads the nodes of the target."""
    on: str | None = None
    """Name of the target's set in the mesh file; None if the mesh file has no such set."""


class Topology:
    """Parts of a deck with their nodes."""

    def __init__(
        self,
        bodies: Iterable[str],
        nodes: Callable[[], Mapping[str, set[int]]],
        points: Callable[[], Mapping[int, Point]],
    ) -> None:
        """``bodies``: keys of the parts that become parts of the case. ``nodes``: function that reads the nodes of each
        part. ``points``: function that reads the positions of nodes, in the unit of the deck. The functions ``nodes``
        and ``points`` are called when their results are used first.
        """
        self.bodies = list(bodies)
        self._read_nodes, self._read_points = nodes, points

    @cached_property
    def of(self) -> dict[str, set[int]]:
        """Nodes of each body; the keys are the keys of the bodies."""
        found = self._read_nodes()
        return {key: found.get(key, set()) for key in self.bodies}

    @cached_property
    def points(self) -> Mapping[int, Point]:
        """Positions of the nodes."""
        return self._read_points()

    def nodes(self, chosen: Chosen) -> set[int]:
        """Returns the nodes of a target, including nodes that belong to no body."""
        if chosen.bodies is not None:
            return set().union(*(self.of.get(key, set()) for key in chosen.bodies))
        return chosen.nodes() if chosen.nodes is not None else set()

    def whole(self, chosen: Chosen) -> tuple[list[str], list[str]]:
        """Returns the keys of the bodies with all nodes in the target, and of the bodies with only some nodes in the
        target; both lists are sorted.
        """
        if chosen.bodies is not None:
            return [key for key in self.bodies if key in chosen.bodies], []
        wanted = self.nodes(chosen)
        full = [key for key in self.bodies if self.of[key] and self.of[key] <= wanted]
        some = [key for key in self.bodies if key not in full and not self.of[key].isdisjoint(wanted)]
        return full, some

    def joined(self) -> list[tuple[str, str]]:
        """Returns the pairs of bodies with common nodes."""
        return [
            (one, other) for i, one in enumerate(self.bodies) for other in self.bodies[i + 1 :]
            if not self.of[one].isdisjoint(self.of[other])
        ]  # fmt: skip
