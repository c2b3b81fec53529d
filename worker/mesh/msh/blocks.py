"""Nodes and blocks of elements of a .msh file."""

from dataclasses import dataclass

from ...errors import MeshError
from ..cells import HEX8, PYRAMID5, TET4, WEDGE6, Form, Kind
from ..model import Floats, Ids

VOLUME = 3
"""Dimension of volumes in gmsh."""

_TYPES = {
    0: {15: 1},
    1: {1: 2, 8: 3, 26: 4, 27: 5, 28: 6, 62: 7, 63: 8, 64: 9, 65: 10, 66: 11},
    2: {2: 3, 3: 4, 9: 6, 10: 9, 16: 8, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21, 36: 16, 37: 25, 38: 36, 39: 12,
        40: 16, 41: 20, 42: 28, 43: 36, 44: 45, 45: 55, 46: 66, 47: 49, 48: 64, 49: 81, 50: 100, 51: 121},
    3: {4: 4, 5: 8, 6: 6, 7: 5, 11: 10, 12: 27, 13: 18, 14: 14, 17: 20, 18: 15, 19: 13, 29: 20, 30: 35, 31: 56, 32: 22,
        33: 28, 71: 84, 72: 120, 73: 165, 74: 220, 75: 286, 79: 34, 80: 40, 81: 46, 82: 52, 83: 58, 90: 40, 91: 75,
        92: 64, 93: 125, 94: 216, 95: 343, 96: 512, 97: 729, 98: 1000, 99: 32, 106: 126, 107: 196, 108: 288, 109: 405,
        110: 550, 111: 24, 118: 30, 119: 55, 120: 91, 121: 140, 122: 204, 123: 285, 124: 385, 125: 21, 132: 1},
}  # fmt: skip
"""Number of nodes of each element type of gmsh, for each dimension of the type (source of gmsh, GmshDefines.h)."""
_RING = ((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7))
_OF_WEDGE = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 5), (4, 5))
_OF_PYRAMID = ((0, 1), (0, 3), (0, 4), (1, 2), (1, 4), (2, 3), (2, 4), (3, 4))
KINDS = {
    4: TET4, 5: HEX8, 6: WEDGE6, 7: PYRAMID5,
    11: Kind(Form.TET, 10, ((0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3))),
    17: Kind(Form.HEXAHEDRON, 20, _RING), 12: Kind(Form.HEXAHEDRON, 27, _RING),
    18: Kind(Form.WEDGE, 15, _OF_WEDGE), 13: Kind(Form.WEDGE, 18, _OF_WEDGE),
    19: Kind(Form.PYRAMID, 13, _OF_PYRAMID), 14: Kind(Form.PYRAMID, 14, _OF_PYRAMID),
}  # fmt: skip
"""Kinds of volume elements that are read; their node order is given in the gmsh reference manual, "Node ordering"."""
TRIANGLES = frozenset((2, 9, 20, 21, 22, 23, 24, 25, 42, 43, 44, 45, 46))
QUADRILATERALS = frozenset((3, 10, 16, 36, 37, 38, 39, 40, 41, 47, 48, 49, 50, 51))
"""Numbers by which gmsh identifies triangles and quadrilaterals; the first three or four nodes of an element are its
corners."""


@dataclass(frozen=True)
class Block:
    """Elements of one type that belong to the same physical groups."""

    kind: int
    numbers: Ids
    """(m,) numbers of the elements."""
    nodes: Ids
    """(m, k) numbers of the nodes of each element."""
    groups: frozenset[int]
    """Physical groups of the elements."""

    @property
    def dimension(self) -> int:
        """Dimension of the elements, 0 to 3."""
        return shape_of(self.kind)[0]

    @property
    def name(self) -> str:
        """Name of the element type, for messages."""
        return f"type {self.kind} of gmsh"


@dataclass(frozen=True)
class Read:
    """Contents of a file: ``nodes`` (n,) are the numbers of its nodes, ``points`` (n, 3) their positions. The other
    fields are the elements, and remarks on omitted contents.
    """

    nodes: Ids
    points: Floats
    blocks: list[Block]
    notes: tuple[str, ...] = ()


def shape_of(kind: int) -> tuple[int, int]:
    """Return the dimension and the number of nodes of an element type. Raises MeshError if the type is unknown."""
    for dimension, types in _TYPES.items():
        if kind in types:
            return dimension, types[kind]
    raise MeshError(f"the file has elements of the type {kind} of gmsh, which is not supported")
