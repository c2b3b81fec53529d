"""Which nodes the parts of a Radioss starter have, and where they are: a second reading, when somebody asks."""

from pathlib import Path

from ..topology import Mesh, Point
from .text import Option, Row, cut, numbers, options
from .words import SOLIDS


def read_mesh(path: Path) -> Mesh:
    """Nodes of each part with solids, by its number as text. Raises CardError."""
    nodes: dict[str, set[int]] = {}
    points: dict[int, Point] = {}
    for option in options(path):
        if option.words[0] == "NODE":
            for row in option.rows:
                if row[1].strip():
                    number, *place = cut(row, 10, 20, 20, 20)
                    x, y, z = (float(item or 0.0) for item in place)
                    points[int(number)] = x, y, z
        elif option.words[0] in SOLIDS:
            nodes.setdefault(str(option.number()), set()).update(_solids(option))
    return Mesh(nodes, points)


def _solids(option: Option) -> set[int]:
    """Nodes of elements of a fixed number of nodes, over as many lines as these take: a number, then the nodes."""
    count, found = SOLIDS[option.words[0]], set[int]()
    row: list[int] = []
    filled: list[Row] = [row for row in option.rows if row[1].strip()]
    for each in filled:
        row += numbers([each], "node")
        if len(row) > count:
            found.update(row[1 : count + 1])
            row = []
    return found - {0}
