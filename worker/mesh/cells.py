"""Volume elements of files: tets, hexahedra, wedges and pyramids, of first or second order."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .model import Ids
from .patterns import QUADS

Edges = tuple[tuple[int, int], ...]


class Form(Enum):
    """Form of an element: its name in messages, its number of corners, and the position of each corner in a hexahedron
    (``patterns``).
    """

    TET = "tet", 4, (0, 1, 2, 2, 3, 3, 3, 3)
    HEXAHEDRON = "hexahedron", 8, (0, 1, 2, 3, 4, 5, 6, 7)
    WEDGE = "wedge", 6, (0, 1, 2, 2, 3, 4, 5, 5)
    PYRAMID = "pyramid", 5, (0, 1, 2, 3, 4, 4, 4, 4)

    def __init__(self, word: str, corners: int, inside: tuple[int, ...]) -> None:
        """Store the name, the number of corners, and their positions in a hexahedron."""
        self.word, self.corners, self.inside = word, corners, np.array(inside)

    @property
    def several(self) -> str:
        """Return the plural of the name: ``tets``, ``hexahedra``."""
        return "hexahedra" if self is Form.HEXAHEDRON else f"{self.word}s"


@dataclass(frozen=True)
class Kind:
    """Elements of one form and order.

    In elements of second order each of the ``edges`` has a midside node. The midside nodes follow the corners, in the
    order of ``edges``. ``nodes`` is the number of all nodes of an element. Nodes after the midside nodes are ignored.
    """

    form: Form
    nodes: int
    edges: Edges = ()


@dataclass(frozen=True, eq=False)
class Cells:
    """Elements of one kind."""

    kind: Kind
    numbers: Ids
    """(m,) numbers of the elements in the file."""
    nodes: Ids
    """(m, kind.nodes) tags of the nodes of each element."""
    lines: Ids
    """(m,) line of each element in the file; 0 if the format of the file has no line numbers."""

    @property
    def corners(self) -> Ids:
        """(m, corners) tags of the corners of each element."""
        return self.nodes[:, : self.kind.form.corners]

    @property
    def middles(self) -> Ids:
        """(m, edges) tags of the midside nodes of each element."""
        first = self.kind.form.corners
        return self.nodes[:, first : first + len(self.kind.edges)]

    def called(self, k: int) -> str:
        """Return the name of an element: ``tet 7 (line 12)``."""
        return f"{self.kind.form.word} {self.numbers[k]}" + (f" (line {self.lines[k]})" if self.lines[k] else "")

    def of(self, chosen: NDArray[np.bool_]) -> Self:
        """Return the elements ``chosen`` of this kind."""
        return type(self)(self.kind, self.numbers[chosen], self.nodes[chosen], self.lines[chosen])


def sides(form: Form) -> list[list[int]]:
    """Return the corners of the faces of a form. Each face has three or four corners, anticlockwise seen from
    outside.
    """
    found = []
    for quad in form.inside[QUADS].tolist():
        different = [node for k, node in enumerate(quad) if node != quad[k - 1]]
        if len(set(different)) > 2:
            found.append(different)
    return found


def cells(kind: Kind, numbers: Ids, nodes: Ids, lines: Iterable[int] | Ids = ()) -> Cells:
    """Return elements made from the data of a file; ``nodes`` is flat or has the shape (m, kind.nodes)."""
    known = np.asarray(lines, np.int64) if not isinstance(lines, tuple) else np.zeros(len(numbers), np.int64)
    return Cells(kind, numbers, nodes.reshape(-1, kind.nodes), known)


_RING, _UP = ((0, 1), (1, 2), (2, 3), (3, 0)), ((0, 4), (1, 5), (2, 6), (3, 7))
TET4, HEX8 = Kind(Form.TET, 4), Kind(Form.HEXAHEDRON, 8)
WEDGE6, PYRAMID5 = Kind(Form.WEDGE, 6), Kind(Form.PYRAMID, 5)
TET10 = Kind(Form.TET, 10, ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)))
HEX20 = Kind(Form.HEXAHEDRON, 20, (*_RING, (4, 5), (5, 6), (6, 7), (7, 4), *_UP))
WEDGE15 = Kind(Form.WEDGE, 15, ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)))
PYRAMID13 = Kind(Form.PYRAMID, 13, (*_RING, (0, 4), (1, 4), (2, 4), (3, 4)))
"""Pyramid of 13 nodes, in the node order of Abaqus, LS-DYNA, Radioss and VTK."""
