"""Check of parts that share nodes of one file without a bond. Parts without a bond would separate at the shared
nodes.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from conoid.cases.model.bonds import TiedBond
from conoid.cases.model.joined import bodies
from conoid.cases.model.schema import Case

from .model import Floats, Ids, Origin

_SAME = 1e-9
"""Distance between two nodes, divided by the largest coordinate. Two nodes with a smaller distance count as coincident.
Chosen value: the round-off in files is a millionth."""

Placed = tuple[int, Origin, Floats]
"""Data of a part: its number, the origin of its mesh, and its nodes (n, 3), m, after its rotation."""


def shared_nodes(case: Case, parts: Sequence[Placed]) -> Iterator[str]:
    """Yield an error for every two parts of different bodies that share coincident nodes of a file.

    A tied bond between a rigid and a deformable part is allowed, because each of the two parts has its own copy of the
    nodes.
    """
    body, tied = bodies(case), {frozenset(bond.parts) for bond in case.bond if isinstance(bond, TiedBond)}
    for (i, one, x), (j, other, y) in combinations(parts, 2):
        pair = case.parts[i], case.parts[j]
        rigid = any(part.rigid is not None for part in pair)
        if body[i] == body[j] or (rigid and frozenset(part.name for part in pair) in tied):
            continue
        if many := len(same_places(one, x, other, y)[0]):
            yield _refusal(case, i, j, many)


def same_places(one: Origin, x: Floats, other: Origin, y: Floats) -> tuple[Ids, Ids]:
    """Return the common nodes of two meshes, as indices in each mesh. A common node has the same number in one file and
    the same position.
    """
    if one.file != other.file:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    _, p, q = np.intersect1d(one.nodes, other.nodes, return_indices=True)
    near = np.abs(x[p] - y[q]).max(axis=1, initial=0.0) <= _SAME * np.abs(x).max(initial=0.0)
    return p[near], q[near]


def _refusal(case: Case, i: int, j: int, many: int) -> str:
    path, (one, other) = getattr(case.parts[i].mesh, "path", ""), (case.parts[k].name for k in (i, j))
    kind = "tied" if case.parts[i].rigid is not None or case.parts[j].rigid is not None else "shared"
    return (
        f"parts: {one!r} and {other!r} share {many:,} nodes of {path!r}, but would be separate bodies that only touch: "
        f"give them a [[bond]] with parts = [{one!r}, {other!r}] and kind = '{kind}', make one part of a group that "
        "has both, or, where bodies in contact are meant, give each of them nodes of its own"
    )
