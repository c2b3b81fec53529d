"""Parts that bonds join by shared nodes. Two coincident nodes become one node, and two coincident faces become an
interface.
"""

from collections.abc import Container, Mapping
from itertools import combinations

import numpy as np

from conoid.cases.model.joined import bodies, shared_bonds
from conoid.cases.model.schema import Case

from ..errors import InputError
from .model import Floats, Ids, Ints, Origin
from .sharing import same_places

_SAME = 1e-9
"""Distance between two nodes, divided by the size of a body. Nodes of structured meshes with a smaller distance are
merged. Chosen value: far above round-off."""

Placed = tuple[int, Origin | None, Floats]
"""Data of a part: the index of its first node, the origin of its mesh, and its nodes (n, 3), m, after its rotation."""


def joined(case: Case, placed: Mapping[int, Placed], n: int) -> Ids:
    """Return (n,) the number of the node that replaces each of the ``n`` nodes of the ``placed`` parts.

    If bonds merge several nodes, the first of these nodes replaces all others. Raises InputError if a bond has no
    common nodes.
    """
    edges = [np.zeros((0, 2), np.int64)]
    for k, _, i, j in shared_bonds(case):
        if i in placed and j in placed:
            (first, one, x), (second, other, y) = placed[i], placed[j]
            p, q = _common(one, x, other, y)
            if not len(p):
                raise InputError(_apart(case, k))
            edges.append(np.column_stack([first + p, second + q]))
    every = np.concatenate(edges)
    from ..fracture.connectivity import components  # numba reads the folder of its cache at its import

    if not len(every):
        return np.arange(n)
    stands = np.asarray(components(n, every))
    _refuse_open(case, placed, stands)
    return stands


def _refuse_open(case: Case, placed: Mapping[int, Placed], stands: Ids) -> None:
    """Raise InputError if two parts of one body have coincident faces but no bond.

    Without a bond the parts would separate at their coincident faces, and no contact would act between them.
    ``stands``: the result of ``joined``.
    """
    body = bodies(case)
    numbers = {part.name: i for i, part in enumerate(case.parts)}
    every = {(min(i, j), max(i, j)) for i, j in ([numbers[name] for name in bond.parts] for bond in case.bond)}
    for i, j in combinations(sorted(placed), 2):
        if body[i] == body[j] and (i, j) not in every:
            (first, one, x), (second, other, y) = placed[i], placed[j]
            p, q = _common(one, x, other, y)
            if _wide(x[p[stands[first + p] != stands[second + q]]]):
                raise InputError(_unbonded(case, i, j))


def _wide(x: Floats) -> bool:
    """Return True if points (n, 3) span a plane, that is, if they are neither coincident nor collinear."""
    if len(x) < 3:
        return False
    d = x - x[0]
    far = d[int(np.argmax((d * d).sum(axis=1)))]
    return bool((np.cross(d, far) ** 2).sum(axis=1).max() > _SAME * float((far * far).sum()) ** 2)


def _common(one: Origin | None, x: Floats, other: Origin | None, y: Floats) -> tuple[Ids, Ids]:
    """Return the common nodes of two parts. Common nodes have equal numbers in one mesh file or, in structured meshes,
    equal positions.
    """
    if one is not None and other is not None:
        return same_places(one, x, other, y)
    labels = np.column_stack([_lines(np.concatenate([a, b])) for a, b in zip(x.T, y.T, strict=True)])
    _, at, times = np.unique(labels, axis=0, return_inverse=True, return_counts=True)
    at, first = at.reshape(-1), np.full(len(times), -1)
    first[at[: len(x)]] = np.arange(len(x))
    p = first[at[len(x) :]]
    return p[p >= 0], np.flatnonzero(p >= 0)


def _lines(values: Floats) -> Ids:
    """Return (n,) integers. Coordinates that are equal within round-off get equal integers."""
    order = np.argsort(values, kind="stable")
    steps = np.diff(values[order], prepend=values[order[:1]])
    numbers = np.empty(len(values), np.int64)
    numbers[order] = np.cumsum(steps > _SAME * float(np.ptp(values)))
    return numbers


def require_faces(case: Case, there: Container[int], across: Ints, tet_part: Ints) -> None:
    """Raise InputError if a bond has no common face, or if two parts of one body have a common face but no bond.

    Only the parts whose numbers are in ``there`` are checked. ``across``: (tets, 4) neighbours of all tets
    (``faces.across``).
    """
    tet, face = np.nonzero(across >= 0)
    pairs = np.column_stack([tet_part[tet], tet_part[across[tet, face] // 4]])
    found = {(int(i), int(j)) for i, j in np.unique(pairs[pairs[:, 0] < pairs[:, 1]], axis=0)}
    bonded = {(i, j): k for k, _, i, j in shared_bonds(case) if i in there and j in there}
    for pair, k in bonded.items():
        if pair not in found:
            raise InputError(_apart(case, k))
    for i, j in sorted(found - bonded.keys()):
        raise InputError(_unbonded(case, i, j))


def _unbonded(case: Case, i: int, j: int) -> str:
    one, other = case.parts[i].name, case.parts[j].name
    return (
        f"parts: {one!r} and {other!r} have faces of one body in common and no bond; give them a [[bond]] with "
        f"parts = [{one!r}, {other!r}] and kind = 'shared'"
    )


def _apart(case: Case, k: int) -> str:
    one, other = case.bond[k].parts
    return (
        f"bond[{k}].parts = '{one}, {other}': the meshes of the two parts have no face in common; let them touch, take "
        "both from one file in which they share nodes, or set kind = 'tied'"
    )
