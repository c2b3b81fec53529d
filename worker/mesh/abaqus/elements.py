"""The element types of Abaqus and CalculiX: tets that can be used, other volumes, and what carries no volume.

The names are those of the Elements Guide: a family, its number of nodes, and letters for variants.
"""

import re
from dataclasses import dataclass
from enum import Enum
from functools import cache


class Kind(Enum):
    """What an element is for a mesh of tets."""

    TET = "a 4-node tet"
    VOLUME = "another volume"
    EMPTY = "without volume"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class ElementType:
    """``name`` as in the file, in upper case; ``nodes``: of one element, None where the name does not say."""

    name: str
    kind: Kind
    nodes: int | None


_TET = re.compile(r"C3D4(E|H|HT|P|PH|PHT|PT|T)?")
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
"""Where the last figure of a name says the degrees of freedom of a node."""


@cache
def element_type(name: str) -> ElementType:
    """The type that a file calls ``name``."""
    name = "".join(name.split()).upper()
    if _TET.fullmatch(name):
        return ElementType(name, Kind.TET, 4)
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
