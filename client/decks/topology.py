"""Which nodes a part of a deck has, and where they are: read only where a deck speaks of nodes that bodies share."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

Point = tuple[float, float, float]


class Mesh(NamedTuple):
    """Nodes of each part by its key, and the position of each node in the unit of the deck."""

    nodes: Mapping[str, set[int]]
    points: Mapping[int, Point]


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

    def __init__(self, bodies: Iterable[str], load: Callable[[], Mesh]) -> None:
        """``bodies``: keys of the parts that become parts of the case; ``load`` reads the mesh when it is needed."""
        self.bodies = list(bodies)
        self._load = load

    @cached_property
    def mesh(self) -> Mesh:
        """The nodes of the parts of the case."""
        found = self._load()
        return Mesh({key: found.nodes.get(key, set()) for key in self.bodies}, found.points)

    def nodes(self, chosen: Chosen) -> set[int]:
        """The nodes that are meant, of bodies or not."""
        if chosen.bodies is not None:
            return set().union(*(self.mesh.nodes.get(key, set()) for key in chosen.bodies))
        return chosen.nodes() if chosen.nodes is not None else set()

    def whole(self, chosen: Chosen) -> tuple[list[str], list[str]]:
        """The bodies all of whose nodes are meant, and those of which some are, in order."""
        if chosen.bodies is not None:
            return [key for key in self.bodies if key in chosen.bodies], []
        wanted = self.nodes(chosen)
        full = [key for key in self.bodies if self.mesh.nodes[key] and self.mesh.nodes[key] <= wanted]
        some = [key for key in self.bodies if key not in full and not self.mesh.nodes[key].isdisjoint(wanted)]
        return full, some

    def joined(self) -> list[tuple[str, str]]:
        """Pairs of bodies that have nodes in common."""
        return [
            (one, other) for i, one in enumerate(self.bodies) for other in self.bodies[i + 1 :]
            if not self.mesh.nodes[one].isdisjoint(self.mesh.nodes[other])
        ]  # fmt: skip
