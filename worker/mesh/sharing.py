"""Parts that are taken from one file and have nodes of it in common: they would come apart where it joins them."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from conoid.cases.model.joined import bodies
from conoid.cases.model.schema import Case

from .model import Floats, Ids, Origin

_SAME = 1e-9
"""Of the largest coordinate: nodes nearer than this are at one place. Chosen: rounding is a millionth of it."""

Placed = tuple[int, Origin, Floats]
"""Number of a part, where its mesh comes from, and its nodes (n, 3), m, as its part turns them."""


def shared_nodes(case: Case, parts: Sequence[Placed]) -> Iterator[str]:
    """A line for every two parts of different bodies that share nodes of a file and have them at the same place."""
    body = bodies(case)
    for (i, one, x), (j, other, y) in combinations(parts, 2):
        if body[i] == body[j]:
            continue
        if many := len(same_places(one, x, other, y)[0]):
            yield _refusal(case, i, j, many)


def same_places(one: Origin, x: Floats, other: Origin, y: Floats) -> tuple[Ids, Ids]:
    """The nodes of two meshes, by their places in either, that have one number in one file and are at one place."""
    if one.file != other.file:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    _, p, q = np.intersect1d(one.nodes, other.nodes, return_indices=True)
    near = np.abs(x[p] - y[q]).max(axis=1, initial=0.0) <= _SAME * np.abs(x).max(initial=0.0)
    return p[near], q[near]


def _refusal(case: Case, i: int, j: int, many: int) -> str:
    path, (one, other) = getattr(case.parts[i].mesh, "path", ""), (case.parts[k].name for k in (i, j))
    return (
        f"parts: {one!r} and {other!r} share {many:,} nodes of {path!r}, but would be separate bodies that only touch: "
        f"give them a [[bond]] with parts = [{one!r}, {other!r}] and kind = 'shared', make one part of a group that "
        "has both, or, where bodies in contact are meant, give each of them nodes of its own"
    )
