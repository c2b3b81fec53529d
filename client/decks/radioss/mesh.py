"""Nodes of the parts of a Radioss starter and their positions. The import reads the starter a second time if
keywords need the nodes.
"""

from pathlib import Path

from conoid.cases.reading.included import Included

from ..topology import Point
from .text import Option, Row, cut, numbers, options, real, whole
from .words import SOLIDS


def read_points(path: Path) -> dict[int, Point]:
    """Returns the positions of nodes, by their numbers. Raises CardError."""
    points: dict[int, Point] = {}
    for option in options(Included(path)):
        if option.words[0] == "NODE":
            for row in option.rows:
                if row[1].strip():
                    number, *place = cut(row, 10, 20, 20, 20)
                    x, y, z = (real(row[0], item, "coordinate") if item else 0.0 for item in place)
                    points[whole(row[0], number, "node")] = x, y, z
    return points


def read_nodes(path: Path) -> dict[str, set[int]]:
    """Returns the nodes of each part with solids; the keys are part numbers as text. Raises CardError."""
    nodes: dict[str, set[int]] = {}
    for option in options(Included(path)):
        if option.words[0] in SOLIDS:
            nodes.setdefault(str(option.number()), set()).update(_solids(option))
    return nodes


def _solids(option: Option) -> set[int]:
    """Returns the nodes of all elements of an option. An element takes as many lines as needed: first its number, then
    its nodes.
    """
    count, found = SOLIDS[option.words[0]], set[int]()
    row: list[int] = []
    filled: list[Row] = [row for row in option.rows if row[1].strip()]
    for each in filled:
        row += numbers([each], "node")
        if len(row) > count:
            found.update(row[1 : count + 1])
            row = []
    return found - {0}
