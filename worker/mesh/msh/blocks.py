"""Nodes and blocks of elements, as a .msh file has them."""

from dataclasses import dataclass

from ...errors import MeshError
from ..model import Floats, Ids

TET = 4
"""gmsh's number of the 4-node tet."""
VOLUME = 3
"""Dimension of what has a volume."""

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
"""Nodes of the element types of gmsh by dimension (its source, GmshDefines.h)."""
_NAMES = {5: "hexahedron", 6: "prism", 7: "pyramid", 11: "tetrahedron of 10 nodes", 17: "hexahedron of 20 nodes"}


@dataclass(frozen=True)
class Block:
    """Elements of one type whose groups are the same."""

    kind: int
    numbers: Ids
    """(m,) of the elements."""
    nodes: Ids
    """(m, k) numbers of their nodes."""
    groups: frozenset[int]
    """Physical groups of the dimension of the elements."""

    @property
    def dimension(self) -> int:
        """0 to 3."""
        return shape_of(self.kind)[0]

    @property
    def name(self) -> str:
        """Of the type, for messages."""
        return _NAMES.get(self.kind, f"type {self.kind} of gmsh")


@dataclass(frozen=True)
class Content:
    """What a file has: ``nodes`` (n,) and ``points`` (n, 3), elements, and remarks on what is not in it."""

    nodes: Ids
    points: Floats
    blocks: list[Block]
    notes: tuple[str, ...] = ()


def shape_of(kind: int) -> tuple[int, int]:
    """Dimension and number of nodes of an element type. Raises MeshError."""
    for dimension, types in _TYPES.items():
        if kind in types:
            return dimension, types[kind]
    raise MeshError(f"it has elements of the type {kind} of gmsh, which is not read")
