"""Element types of Abaqus and CalculiX: volumes that are read, volumes that are not read, and elements without volume.

The name of a type consists of a family, the number of nodes, and letters for variants (Abaqus Elements Guide).
"""

import re
from dataclasses import dataclass
from enum import Enum
from functools import cache

from ..cells import HEX8, HEX20, PYRAMID5, TET4, TET10, WEDGE6, WEDGE15, Form


class Kind(Enum):
    """Use of an element type in a mesh of tets: read, not read, or without volume."""

    SOLID = "a volume that is read"
    VOLUME = "another volume"
    EMPTY = "without volume"
    UNKNOWN = "unknown"


FORMS = {4: TET4, 5: PYRAMID5, 6: WEDGE6, 8: HEX8, 10: TET10, 15: WEDGE15, 20: HEX20}
"""Kinds of the volumes that are read; the keys are the numbers of nodes."""
FACES = {
    Form.TET: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    Form.PYRAMID: ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)),
    Form.WEDGE: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    Form.HEXAHEDRON: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
"""Corners of the faces S1, S2, ... of each element form (Elements Guide, "Three-dimensional solid element library")."""


@dataclass(frozen=True)
class ElementType:
    """An element type.

    ``name``: name in the file, in upper case; ``nodes``: number of nodes of one element, None if the name does not
    contain this number.
    """

    name: str
    kind: Kind
    nodes: int | None

    @property
    def corners(self) -> int | None:
        """Number of corners of a surface element, 3 or 4; None for elements that are not surface elements."""
        plate = self.kind is Kind.EMPTY and _PLATE.fullmatch(self.name)
        return {3: 3, 6: 3, 4: 4, 8: 4, 9: 4}.get(self.nodes or 0) if plate else None


_SOLID = re.compile(r"C3D(4|5|6|8|10|15|20)(?:E|S|HS|(?:I|M|R)?H?T?|(?:M|R)?P?H?T?|RE)")
_PLATE = re.compile(r"(?:STRI|S|DS|M3D|SFM3D|R3D|CPE|CPS|CAX)\d+[A-Z0-9]*")
_VOLUME = re.compile(r"(?:A?C3D|DC3D|DCC3D|EC3D|EMC3D|Q3D|CIN3D|CSS|SC|CCL|GK3D)(\d+)[A-Z]*")
_COUNTED = re.compile(
    r"(?:STRI|S|DS|M3D|MCL|SFM3D|SFMCL|R2D|R3D|RB2D|RB3D|T2D|T3D|CPE|CPEG|CPS|CAX|CGAX|DC1D|DC2D|DCAX|AC1D|AC2D|ACAX"
    r"|EMC2D|COH2D|COH3D|COHAX|CONN2D|CONN3D|DGAP|F2D|F3D|FAX|WARP2D|CINPE|CINPS|CINAX|MGAX|MAX|SFMGAX|SFMAX)(\d+)[A-Z]*"
)
_LINE = re.compile(r"(?:B|PIPE|ELBOW|FRAME|SAX|DSAX|RAX|SAXA)\d[A-Z0-9]*")
_SINGLE = re.compile(r"(?:MASS|ROTARYI|HEATCAP|SPRING1|DASHPOT1|DCOUP[23]D)")
_PAIR = re.compile(
    r"(?:SPRING2|SPRINGA|DASHPOT2|DASHPOTA|JOINTC|JOINT[23]D|GAPUNIT?|GAPCYL|GAPSPHER|ITSUNI|ITSCYL|DRAG[23]D|FLINK)"
)
_NODES = {"STRI65": 6, "S4R5": 4, "S8R5": 8, "S9R5": 9}
"""Families of element types with a name that ends with the number of degrees of freedom of a node."""


@cache
def element_type(name: str) -> ElementType:
    """Return the element type with this ``name``."""
    name = "".join(name.split()).upper()
    if found := _SOLID.fullmatch(name):
        return ElementType(name, Kind.SOLID, int(found[1]))
    if found := _VOLUME.fullmatch(name):
        return ElementType(name, Kind.VOLUME, int(found[1]))
    if name in _NODES:
        return ElementType(name, Kind.EMPTY, _NODES[name])
    if found := _COUNTED.fullmatch(name):
        return ElementType(name, Kind.EMPTY, int(found[1]))
    for pattern, nodes in ((_SINGLE, 1), (_PAIR, 2), (_LINE, None)):
        if pattern.fullmatch(name):
            return ElementType(name, Kind.EMPTY, nodes)
    return ElementType(name, Kind.UNKNOWN, None)
