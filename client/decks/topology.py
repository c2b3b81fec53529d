"""Which nodes a part of a deck has, and where they are: read only where a deck speaks of nodes that bodies share."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Chosen:
    """What a load or a motion acts on: whole parts, or nodes."""

    what: str
    """As messages call it: ``node set 3``."""
    bodies: frozenset[str] | None = None
    """Keys of whole parts; None where nodes are meant."""
    nodes: Callable[[], set[int]] | None = None
    """The nodes that are meant, read when they are asked for."""
    on: str | None = None
    """The name of the set by which a case finds it in the mesh file; None where it has none."""


class Topology:
    """The parts of a deck by their nodes."""

    def __init__(
        self,
        bodies: Iterable[str],
        nodes: Callable[[], Mapping[str, set[int]]],
        points: Callable[[], Mapping[int, Point]],
    ) -> None:
        """``bodies``: keys of the parts that become parts of the case. ``nodes`` reads the nodes of each part, and
        ``points`` where nodes are, in the unit of the deck, when they are asked for.
        """
        self.bodies = list(bodies)
        self._read_nodes, self._read_points = nodes, points

    @cached_property
    def of(self) -> dict[str, set[int]]:
        """The nodes of each body, by its key."""
        found = self._read_nodes()
        return {key: found.get(key, set()) for key in self.bodies}

    @cached_property
    def points(self) -> Mapping[int, Point]:
        """Where nodes are."""
        return self._read_points()

    def nodes(self, chosen: Chosen) -> set[int]:
        """The nodes that are meant, of bodies or not."""
        if chosen.bodies is not None:
            return set().union(*(self.of.get(key, set()) for key in chosen.bodies))
        return chosen.nodes() if chosen.nodes is not None else set()

    def whole(self, chosen: Chosen) -> tuple[list[str], list[str]]:
        """The bodies all of whose nodes are meant, and those of which some are, in order."""
        if chosen.bodies is not None:
            return [key for key in self.bodies if key in chosen.bodies], []
        wanted = self.nodes(chosen)
        full = [key for key in self.bodies if self.of[key] and self.of[key] <= wanted]
        some = [key for key in self.bodies if key not in full and not self.of[key].isdisjoint(wanted)]
        return full, some

    def joined(self) -> list[tuple[str, str]]:
        """Pairs of bodies that have nodes in common."""
        return [
            (one, other) for i, one in enumerate(self.bodies) for other in self.bodies[i + 1 :]
            if not self.of[one].isdisjoint(self.of[other])
        ]  # fmt: skip
