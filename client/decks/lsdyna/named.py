"""Objects that keywords of an LS-DYNA deck refer to by numbers: node sets, parts, curves, surfaces."""

from functools import partial

from ..account import Entry
from ..topology import Chosen, Topology
from . import sets


class Numbered:
    """Sets and curves of a deck by their numbers. When a set or curve is used, its keyword is marked as translated."""

    topology: Topology

    def __init__(self) -> None:
        """Starts without sets and curves; ``topology`` must be set before the first use."""
        self.node_sets: dict[int, sets.NodeSet] = {}
        self.segments: dict[int, sets.NodeSet] = {}
        self.part_sets: dict[int, tuple[set[int], Entry]] = {}
        self.curves: dict[int, tuple[sets.Curve, Entry]] = {}

    def leave_rest(self) -> None:
        """Records that all sets and curves that were not used are omitted."""
        for number, found in (*self.node_sets.items(), *self.segments.items()):
            if not found.entry.decided:
                found.entry.leave(f"set {number} is not used by any translated keyword")
        for _, entry in (*self.part_sets.values(), *self.curves.values()):
            if not entry.decided:
                entry.leave("not used by any translated keyword")

    def nodes(self, number: int, entry: Entry) -> Chosen:
        """Returns the nodes of a set by the number of the set; 0 means all nodes. Raises ValueError."""
        if number == 0:
            return Chosen("everything", bodies=frozenset(self.topology.bodies))
        found = self._node_set(number, entry)
        if found.everything:
            return Chosen(f"node set {number}", bodies=frozenset(self.topology.bodies))
        on = f"nodes:{number}" if number in self.segments else str(number)
        return Chosen(f"node set {number}", nodes=partial(self._members, found), on=on)

    def _node_set(self, number: int, entry: Entry, within: tuple[int, ...] = ()) -> sets.NodeSet:
        """Returns a node set by its number, merged with the sets that it includes. Raises ValueError."""
        found = self.node_sets.get(number)
        if found is None:
            raise ValueError(f"the node set {number} is not defined")
        if number in within:
            raise ValueError(f"the node set {number} has itself among its members")
        if found.odd:
            raise ValueError(f"the node set {number}: {found.odd}")
        found.entry.take(f"of {entry.keyword}, {entry.place}")
        for other in sorted(found.sets):
            one = self._node_set(other, found.entry, (*within, number))
            found.everything |= one.everything
            found.nodes |= one.nodes
            found.parts |= one.parts
            found.ranges += one.ranges
        found.sets.clear()
        return found

    def _members(self, found: sets.NodeSet) -> set[int]:
        every = self.topology.of
        within = (node for nodes in every.values() for node in nodes if any(node in each for each in found.ranges))
        parts = (every.get(str(part), set()) for part in found.parts)
        return found.nodes.union(within if found.ranges else (), *parts)

    def group(self, nodes: set[int]) -> Chosen:
        """Returns single nodes as the target of a load: the set with exactly these nodes if the deck has one, because
        a boundary of a case selects nodes by the name of a set.
        """
        what = f"node {min(nodes)}" if len(nodes) == 1 else f"the group of {len(nodes)} nodes"
        for number, found in self.node_sets.items():
            plain = not (found.odd or found.everything or found.sets or found.parts or found.ranges)
            if plain and found.nodes == nodes:
                found.entry.take(f"set with the nodes of {what}")
                return Chosen(what, nodes=lambda: nodes, on=str(number))
        return Chosen(what, nodes=lambda: nodes)

    def part(self, number: int) -> Chosen:
        """Returns a part by its number, as the target of a load."""
        return Chosen(f"part {number}", bodies=frozenset({str(number)}))

    def part_set(self, number: int, entry: Entry) -> Chosen:
        """Returns a part set by its number, as the target of a load. Raises ValueError."""
        if number not in self.part_sets:
            raise ValueError(f"the part set {number} is not defined")
        parts, own = self.part_sets[number]
        own.take(f"of {entry.keyword}, {entry.place}")
        return Chosen(f"part set {number}", bodies=frozenset(map(str, parts)))

    def curve(self, number: int) -> sets.Curve:
        """Returns a curve by its number. Raises ValueError."""
        if number not in self.curves:
            raise ValueError(f"the curve {number} is not defined")
        curve, entry = self.curves[number]
        entry.take("courses")
        return curve

    def surface(self, number: int, kind: int, entry: Entry) -> frozenset[str]:
        """Returns the bodies of a surface by the number and the type of the surface (the manual, *CONTACT, SSTYP).
        Raises ValueError.
        """
        every = frozenset(self.topology.bodies)
        if kind == 5 or (number == 0 and kind in (0, 2, 3)):
            return every
        if kind == 2:
            return (self.part_set(number, entry).bodies or frozenset()) & every
        if kind == 3:
            return frozenset({str(number)}) & every
        if kind in (0, 4):
            return self._of_nodes(number, kind, entry)
        raise ValueError(f"a surface of the type {kind} is not supported; allowed: 0, 2, 3, 4 and 5")

    def _of_nodes(self, number: int, kind: int, entry: Entry) -> frozenset[str]:
        found = self.segments.get(number) if kind == 0 else self._node_set(number, entry)
        if found is None or found.odd:
            raise ValueError(f"the set {number}: {found.odd if found else 'it is not defined'}")
        found.entry.take(f"of {entry.keyword}, {entry.place}")
        entry.remark(
            "differs",
            f"set {number}",
            "in Conoid the whole surfaces of the parts are in contact, not only the faces of the set",
        )
        members = self._members(found)
        return frozenset(key for key in self.topology.bodies if not self.topology.of[key].isdisjoint(members))
