"""Parts that are taken from one file and have nodes of it in common: they would come apart where it joins them."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from conoid.cases.schema import Case

from .model import Floats, Origin

_SAME = 1e-9
"""Of the largest coordinate: nodes nearer than this are at one place. Chosen: rounding is a millionth of it."""

Placed = tuple[int, Origin, Floats]
"""Number of a part, where its mesh comes from, and its nodes (n, 3), m, as its part turns them."""


def shared_nodes(case: Case, parts: Sequence[Placed]) -> Iterator[str]:
    """A line for every two parts that share nodes of a file and have them at the same place."""
    for (i, one, x), (j, other, y) in combinations(parts, 2):
        if one.file != other.file:
            continue
        _, p, q = np.intersect1d(one.nodes, other.nodes, return_indices=True)
        near = np.abs(x[p] - y[q]).max(axis=1, initial=0.0) <= _SAME * np.abs(x).max(initial=0.0)
        if near.any():
            yield _refusal(case, i, j, int(near.sum()))


def _refusal(case: Case, i: int, j: int, many: int) -> str:
    path = getattr(case.parts[i].mesh, "path", "")
    both = f"{case.parts[i].name!r} and {case.parts[j].name!r}"
    return (
        f"parts: {both} share {many:,} nodes of {path!r}, but would be separate bodies that only touch: make one part "
        "of a group that has both, or, where bodies in contact are meant, give each of them nodes of its own"
    )
