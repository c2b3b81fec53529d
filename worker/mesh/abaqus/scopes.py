"""What an Abaqus input file defines: nodes, elements and sets, each in the part, the instance or the model it is in."""

from array import array
from dataclasses import dataclass, field

import numpy as np

from ...errors import MeshError
from ..model import Floats, Ids
from .elements import ElementType
from .labels import Label, Labelled

OWN = ""
"""In the members of a set: the elements of the scope in which the set is defined."""


class ElementSet:
    """Numbers of elements, by the key of the instance whose they are (``OWN`` for those of its own scope)."""

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
class Scope:
    """A part, an instance or the whole model: what stands between its keyword and the end of it."""

    name: Label
    line: int
    """Of its keyword in the file."""
    nodes: "array[int]" = field(default_factory=lambda: array("q"))
    points: "array[float]" = field(default_factory=lambda: array("d"))
    tets: "array[int]" = field(default_factory=lambda: array("q"))
    corners: "array[int]" = field(default_factory=lambda: array("q"))
    """Four nodes of each tet."""
    others: "dict[ElementType, array[int]]" = field(default_factory=dict)
    """Numbers of the elements that are no tets, by type."""
    sets: Labelled[ElementSet] = field(default_factory=Labelled)

    @property
    def empty(self) -> bool:
        """Whether it has neither nodes nor elements."""
        return not (self.nodes or self.tets or self.others)

    def named_set(self, name: Label) -> ElementSet:
        """The set of this name, made where there is none: a second definition adds to the first."""
        return self.sets.get(name) or self.sets.add(name, ElementSet())

    def check(self, where: str) -> None:
        """Raises MeshError where two nodes, or two elements, have the same number."""
        for what, numbers in (("node", [self.nodes]), ("element", [self.tets, *self.others.values()])):
            every = np.concatenate([np.array(each, np.int64) for each in numbers])
            found, times = np.unique(every, return_counts=True)
            if len(found) < len(every):
                raise MeshError(f"{what} {found[times > 1][0]} is defined twice{where}")


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

    def set_named(self, name: Label) -> ElementSet | None:
        """A set of its own, else of its part."""
        return self.sets.get(name) or self.part.sets.get(name)


@dataclass(frozen=True)
class Piece:
    """A body as it stands in the model: an instance, a part of a file without instances, or what is in no part."""

    scope: Scope
    mesh: Scope
    points: Floats
    """(n, 3), in the unit of the file."""

    @property
    def numbers(self) -> Ids:
        """(m,) numbers of its tets."""
        return np.array(self.mesh.tets, np.int64)
