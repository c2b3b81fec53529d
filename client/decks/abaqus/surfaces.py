"""Surfaces of an Abaqus input file, and the bodies to which they belong."""

from collections.abc import Callable, Sequence

from conoid.cases.reading.inp import InpError

from ..account import Entry
from ..topology import Topology
from .keyword import Keyword, joined
from .mesh import AbaqusMesh

_KINDS = ("ELEMENT", "NODE")


class Surfaces:
    """Surfaces of a deck by their names."""

    def __init__(
        self, surfaces: Sequence[Keyword], elsets: Sequence[Keyword], mesh: Callable[[], AbaqusMesh], topology: Topology
    ) -> None:
        """``surfaces``, ``elsets``: keywords that define them; ``mesh``: function that reads the mesh."""
        self._surfaces, self._elsets, self._mesh, self._topology = surfaces, elsets, mesh, topology

    def bodies(self, name: str, entry: Entry) -> frozenset[str]:
        """Returns the bodies that have elements or nodes of a surface. Raises InpError."""
        found = [each for each in self._surfaces if each.key("NAME") == joined(name)]
        rows = [(self._kind(each, name), items[0]) for each in found for _, items in each.lists()]
        for each in found:
            each.entry.take(f"of {entry.keyword}, {entry.place}")
        if not rows:
            raise InpError(f"the surface {name[:60]!r} is not defined, or has no elements")
        if any(not one for _, one in rows):
            return frozenset(self._topology.bodies)
        elements, nodes = (self._members(name, [one for of, one in rows if of == kind], kind) for kind in _KINDS)
        for each in self._elsets:
            if any(each.key("ELSET") == joined(one.rpartition(".")[2]) for of, one in rows if of == "ELEMENT"):
                each.entry.take(f"of the surface {name}")
        mesh = self._mesh()
        pairs = {key: key.partition("|") for key in self._topology.bodies}
        bodies = {key: mesh.body(scope, elset) for key, (scope, _, elset) in pairs.items()}
        return frozenset(
            key for key, (mine, its) in bodies.items() if not (mine.isdisjoint(elements) and its.isdisjoint(nodes))
        )

    def _kind(self, each: Keyword, name: str) -> str:
        kind = each.key("TYPE") or "ELEMENT"
        if kind not in _KINDS:
            raise InpError(f"the surface {name!r} is of the type {kind}; only ELEMENT and NODE are supported")
        return kind

    def _members(self, name: str, sets: Sequence[str], kind: str) -> set[int]:
        """Returns the elements or the nodes of the sets of a surface."""
        members = {one: self._mesh().named(one, f"{kind.lower()}_sets") for one in sets}
        if lost := [one for one, numbers in members.items() if not numbers]:
            raise InpError(f"the surface {name[:60]!r} uses the set {lost[0][:60]!r}, which has no {kind.lower()}s")
        return set().union(*(numbers or () for numbers in members.values()))
