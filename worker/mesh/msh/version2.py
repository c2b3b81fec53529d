"""Nodes and elements of the .msh format 2.2. An element with several physical groups is written once for each group."""

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from ..model import Floats, Ids
from .blocks import Block, Read, shape_of
from .sections import Numbers, Sections, Stored

_PARAMETERS = {0: 0, 1: 1, 2: 2, 3: 0}
"""Number of parametric coordinates of a node, for each dimension of the geometric entity on which the node lies."""


def read_version2(file: Sections) -> Read:
    """Read the file; return all nodes and elements. Raises MeshError."""
    if "ParametricNodes" in file.parts:
        nodes, points = _parametric(file.numbers("ParametricNodes"))
    else:
        nodes, points = _nodes(file.numbers("Nodes"))
    rows = _elements(file.numbers("Elements"))
    blocks = [
        Block(
            kind, np.array(numbers, np.int64), np.array(corners, np.int64).reshape(len(numbers), -1), frozenset(group)
        )
        for (kind, *group), (numbers, corners) in rows.items()
    ]
    return Read(nodes, points, blocks)


def _nodes(numbers: Numbers) -> tuple[Ids, Floats]:
    if isinstance(numbers, Stored):
        rows = numbers.rows(numbers.line(), [("number", "i4"), ("point", "f8", 3)])
        numbers.close()
        return rows["number"].astype(np.int64), rows["point"].astype(np.float64)
    many = numbers.count()
    values = numbers.floats(4 * many).reshape(-1, 4)
    numbers.close()
    return _tags(numbers, values[:, 0]), values[:, 1:]


def _parametric(numbers: Numbers) -> tuple[Ids, Floats]:
    """Read the nodes; each node has a geometric entity and parametric coordinates."""
    many = numbers.line() if isinstance(numbers, Stored) else numbers.count()
    tags, points = np.zeros(many, np.int64), np.zeros((many, 3))
    for i in range(many):
        tags[i] = numbers.ints(1)[0]
        points[i] = numbers.floats(3)
        dimension = int(numbers.ints(2)[0])
        if dimension not in _PARAMETERS:
            raise numbers.damaged(f"has a node on an entity of dimension {dimension}")
        numbers.floats(_PARAMETERS[dimension])
    numbers.close()
    return tags, points


def _tags(numbers: Numbers, values: Floats) -> Ids:
    if not (values == np.floor(values)).all():
        raise numbers.damaged("has a node whose number is not whole")
    return values.astype(np.int64)


Rows = dict[tuple[int, ...], tuple[list[int], list[list[int]]]]
"""Numbers and nodes of elements; the key is the element type and the physical group. An element without a group has no
group number."""


def _elements(numbers: Numbers) -> Rows:
    found: Rows = defaultdict(lambda: ([], []))
    many = numbers.line() if isinstance(numbers, Stored) else numbers.count()
    while many > 0:
        if isinstance(numbers, Stored):
            kind, following, tags = (int(each) for each in numbers.ints(3))
            rows = numbers.ints(following * (1 + tags + shape_of(kind)[1])).reshape(following, -1)
        else:
            number, kind, tags = (int(each) for each in numbers.ints(3))
            following, rest = 1, numbers.ints(tags + shape_of(kind)[1])
            rows = np.concatenate([[number], rest])[None]
        if following < 1 or following > many or tags < 0:
            raise numbers.damaged("has another number of elements than its count")
        _sort(found, kind, tags, rows)
        many -= following
    numbers.close()
    return found


def _sort(found: Rows, kind: int, tags: int, rows: NDArray[np.int64]) -> None:
    for row in rows.tolist():
        group = abs(row[1]) if tags else 0
        numbers, nodes = found[(kind, group) if group else (kind,)]
        numbers.append(row[0])
        nodes.append(row[1 + tags :])
