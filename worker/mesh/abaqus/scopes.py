"""Definitions of an Abaqus input file: nodes, elements and sets, each in its part, its instance or the model."""

from array import array
from dataclasses import dataclass, field

import numpy as np

from ..model import Floats, Ids
from ..named import refuse_repeated
from .elements import ElementType
from .labels import Label, Labelled

OWN = ""
"""Key, in the members of a set, of the scope in which the set is defined."""


class ElementSet:
    """Numbers of elements, or of nodes, for each instance. The key ``OWN`` is the scope of the set."""

    def __init__(self) -> None:
        """Create an object without members."""
        self.members: dict[str, array[int]] = {}

    def add(self, owner: str, numbers: "array[int]") -> None:
        """Add elements of one owner."""
        self.members.setdefault(owner, array("q")).extend(numbers)

    def include(self, other: "ElementSet", owner: str = OWN) -> None:
        """Add the present contents of ``other``. Elements of the scope of ``other`` become elements of ``owner`` in
        this object.
        """
        for place, numbers in list(other.members.items()):
            self.add(owner if place == OWN else place, array("q", numbers))


@dataclass
class Rows:
    """Elements of one type in a scope."""

    numbers: "array[int]" = field(default_factory=lambda: array("q"))
    nodes: "array[int]" = field(default_factory=lambda: array("q"))
    """Numbers of the nodes of each element, one element after the other."""
    lines: "array[int]" = field(default_factory=lambda: array("q"))

    def extend(self, other: "Rows") -> None:
        """Add elements of the type."""
        self.numbers.extend(other.numbers)
        self.nodes.extend(other.nodes)
        self.lines.extend(other.lines)


@dataclass
class Surface:
    """A ``*SURFACE`` as it is written in the file: each line has an element or a set of elements, and the name of a
    face.
    """

    name: Label
    line: int
    of_nodes: bool
    rows: list[tuple[int, list[str]]]
    """Number of the line, and its fields, for each line."""


@dataclass
class Scope:
    """A part, an instance or the whole model: the contents between its keyword and its end."""

    name: Label
    line: int
    """Number of the line of its keyword in the file."""
    nodes: "array[int]" = field(default_factory=lambda: array("q"))
    points: "array[float]" = field(default_factory=lambda: array("d"))
    solids: dict[ElementType, Rows] = field(default_factory=dict)
    """Volume elements, by type."""
    plates: dict[ElementType, Rows] = field(default_factory=dict)
    """Surface elements by type. The numbers of elements without volume are also in ``others``."""
    others: "dict[ElementType, array[int]]" = field(default_factory=dict)
    """Numbers of the elements without volume or with an unsupported type; the keys are the types."""
    sets: Labelled[ElementSet] = field(default_factory=Labelled)
    node_sets: Labelled[ElementSet] = field(default_factory=Labelled)
    node_sets_of: list[tuple[ElementSet, Label, int]] = field(default_factory=list)
    """Sets of nodes that are made from a set of elements: the set of nodes, the name of the set of elements, and the
    line number."""
    surfaces: list[Surface] = field(default_factory=list)

    @property
    def empty(self) -> bool:
        """True if the scope has neither nodes nor elements."""
        return not (self.nodes or self.solids or self.others)

    @property
    def volumes(self) -> int:
        """Number of volume elements of the scope."""
        return sum(len(rows.numbers) for rows in self.solids.values())

    def numbers(self) -> Ids:
        """Numbers of all elements, ordered by element type."""
        every = (*(rows.numbers for rows in self.solids.values()), *self.others.values())
        return np.concatenate([np.zeros(0, np.int64), *(np.array(each, np.int64) for each in every)])

    def named_set(self, name: Label, among: Labelled[ElementSet] | None = None) -> ElementSet:
        """Return the set ``name`` of ``among``, which are the sets of elements or the sets of nodes of the scope.

        If the name is new, an empty set is made. Therefore a second definition of a set adds members to the first.
        """
        sets = self.sets if among is None else among
        found = sets.get(name)
        return sets.add(name, ElementSet()) if found is None else found

    def check(self, where: str) -> None:
        """Raise MeshError if two nodes, or two elements, have the same number."""
        refuse_repeated("node", np.array(self.nodes, np.int64), where)
        refuse_repeated("element", self.numbers(), where)


@dataclass
class Instance(Scope):
    """A part in its position. The mesh of ``part``, or a mesh of the instance itself, is first translated and then
    rotated.
    """

    part: Scope = field(default_factory=lambda: Scope(Label("", ""), 0))
    move: tuple[float, ...] = (0.0, 0.0, 0.0)
    axis: tuple[float, ...] = ()
    """Two points of the axis of rotation and an angle in degrees; empty without rotation."""

    @property
    def mesh(self) -> Scope:
        """Scope that contains the nodes and elements of the instance."""
        return self.part if self.empty else self

    def set_named(self, name: Label, of_nodes: bool = False) -> ElementSet | None:
        """Return a set of the instance, or the set of its part if the instance has no set of this name."""
        if of_nodes:
            return self.node_sets.get(name) or self.part.node_sets.get(name)
        return self.sets.get(name) or self.part.sets.get(name)


@dataclass(frozen=True)
class Piece:
    """A body in the model: an instance, a part of a file without instances, or the model outside of parts."""

    scope: Scope
    mesh: Scope
    points: Floats
    """(n, 3) positions of the nodes, in the unit of the file."""
