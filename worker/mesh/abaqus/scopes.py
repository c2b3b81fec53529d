"""What an Abaqus input file defines: nodes, elements and sets, each in the part, the instance or the model it is in."""

from array import array
from dataclasses import dataclass, field

import numpy as np

from ..model import Floats, Ids
from ..named import refuse_repeated
from .elements import ElementType
from .labels import Label, Labelled

OWN = ""
"""In the members of a set: the elements of the scope in which the set is defined."""


class ElementSet:
    """Numbers of elements, or of nodes, by the key of the instance whose they are (``OWN``: of its own scope)."""

    def __init__(self) -> None:
        """Holds nothing."""
        self.members: dict[str, array[int]] = {}

    def add(self, owner: str, numbers: "array[int]") -> None:
        """Adds elements of one owner."""
        self.members.setdefault(owner, array("q")).extend(numbers)

    def include(self, other: "ElementSet", owner: str = OWN) -> None:
        """Adds what ``other`` holds now; its own elements are those of ``owner`` here."""
        for place, numbers in list(other.members.items()):
            self.add(owner if place == OWN else place, array("q", numbers))


@dataclass
class Rows:
    """Elements of one type."""

    numbers: "array[int]" = field(default_factory=lambda: array("q"))
    nodes: "array[int]" = field(default_factory=lambda: array("q"))
    """Those of each element, one after the other."""
    lines: "array[int]" = field(default_factory=lambda: array("q"))

    def extend(self, other: "Rows") -> None:
        """Adds more of the type."""
        self.numbers.extend(other.numbers)
        self.nodes.extend(other.nodes)
        self.lines.extend(other.lines)


@dataclass
class Surface:
    """A ``*SURFACE`` as it is written: an element, or a set of them, and the name of a face in each line."""

    name: Label
    line: int
    of_nodes: bool
    rows: list[tuple[int, list[str]]]
    """Number and fields of each line."""


@dataclass
class Scope:
    """A part, an instance or the whole model: what stands between its keyword and the end of it."""

    name: Label
    line: int
    """Of its keyword in the file."""
    nodes: "array[int]" = field(default_factory=lambda: array("q"))
    points: "array[float]" = field(default_factory=lambda: array("d"))
    solids: dict[ElementType, Rows] = field(default_factory=dict)
    """Elements with a volume, by type."""
    plates: dict[ElementType, Rows] = field(default_factory=dict)
    """Elements of surfaces, which are among the others, by type."""
    others: "dict[ElementType, array[int]]" = field(default_factory=dict)
    """Numbers of the elements that carry no volume, or are not read, by type."""
    sets: Labelled[ElementSet] = field(default_factory=Labelled)
    node_sets: Labelled[ElementSet] = field(default_factory=Labelled)
    node_sets_of: list[tuple[ElementSet, Label, int]] = field(default_factory=list)
    """Sets of the nodes of a set of elements: both, and the line."""
    surfaces: list[Surface] = field(default_factory=list)

    @property
    def empty(self) -> bool:
        """Whether it has neither nodes nor elements."""
        return not (self.nodes or self.solids or self.others)

    @property
    def volumes(self) -> int:
        """How many elements with a volume it has."""
        return sum(len(rows.numbers) for rows in self.solids.values())

    def numbers(self) -> Ids:
        """Of all elements, in the order of types."""
        every = (*(rows.numbers for rows in self.solids.values()), *self.others.values())
        return np.concatenate([np.zeros(0, np.int64), *(np.array(each, np.int64) for each in every)])

    def named_set(self, name: Label, among: Labelled[ElementSet] | None = None) -> ElementSet:
        """The set of elements of this name, or that of nodes ``among`` these, made where there is none: a second
        definition adds to the first.
        """
        sets = self.sets if among is None else among
        found = sets.get(name)
        return sets.add(name, ElementSet()) if found is None else found

    def check(self, where: str) -> None:
        """Raises MeshError where two nodes, or two elements, have the same number."""
        refuse_repeated("node", np.array(self.nodes, np.int64), where)
        refuse_repeated("element", self.numbers(), where)


@dataclass
class Instance(Scope):
    """A part in its place: the mesh of ``part``, or one of its own, moved and then turned."""

    part: Scope = field(default_factory=lambda: Scope(Label("", ""), 0))
    move: tuple[float, ...] = (0.0, 0.0, 0.0)
    axis: tuple[float, ...] = ()
    """Two points of the axis and an angle in degrees; empty for no rotation."""

    @property
    def mesh(self) -> Scope:
        """Where its nodes and elements stand."""
        return self.part if self.empty else self

    def set_named(self, name: Label, of_nodes: bool = False) -> ElementSet | None:
        """A set of its own, else of its part."""
        if of_nodes:
            return self.node_sets.get(name) or self.part.node_sets.get(name)
        return self.sets.get(name) or self.part.sets.get(name)


@dataclass(frozen=True)
class Piece:
    """A body as it stands in the model: an instance, a part of a file without instances, or what is in no part."""

    scope: Scope
    mesh: Scope
    points: Floats
    """(n, 3), in the unit of the file."""
