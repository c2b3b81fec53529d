"""Cuts of hexahedra, wedges and pyramids into tets with matching faces.

Each quadrilateral face is cut by the diagonal through the smallest of its four node numbers. Therefore the two elements
at a face cut it by one diagonal, on any rank. An element can be cut with the diagonals of its faces (Dompierre, Labbe,
Vallet, Camarero 1999, "How to subdivide pyramids, prisms and hexahedra into tetrahedra"). If an element has several
possible cuts, the cut with the longest stable step is chosen. If a node in the middle of the element gives a far longer
stable step than any cut, the node in the middle is added.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .model import FLAT, Floats, Ids, step_lengths, volume_and_area
from .patterns import QUADS, cuts, skin

_TOGETHER = 20_000
"""Number of elements that are processed at once. Chosen value: they need about 100 MB of memory."""
_NOTHING = np.zeros((0, 4), np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64)
_WORSE = 0.5
"""Ratio of the stable step of a cut to that of a cut with a node in the middle, below which the node in the middle is
used. Chosen value: twelve tets instead of five or six take less than twice the number of steps."""


@dataclass(frozen=True)
class Cut:
    """Tets made from elements.

    ``tets`` (k, 4): nodes of the tets; ``owner`` (k,): element of each tet. Numbers from the number of ``points`` on
    refer to the nodes ``middles`` (j, 3).
    """

    tets: Ids
    owner: Ids
    middles: Floats
    of: Ids
    """(j,) element of each middle node."""
    flat: Ids
    """Elements that have no cut into tets of positive volume."""


def cut(nodes: Ids, points: Floats, diagonals: Ids) -> Cut:
    """Cut elements (m, 8) with the given diagonals (m,) of their faces. ``points`` are the coordinates of the nodes.
    Repeated nodes are written as in ``cells.Form``.
    """
    made = [_cut_alike(nodes, points, each, diagonals) for each in _portions(diagonals)]
    tets, owner, poor = (np.concatenate(column) for column in zip(*made, strict=True)) if made else _NOTHING
    more, of, middles, centred, flat = _around(nodes, points, diagonals, np.sort(poor))
    return Cut(np.concatenate([tets, more]), np.concatenate([owner, of]), middles, centred, flat)


def pattern(nodes: Ids) -> Ids:
    """Return (m,) the diagonals of the faces (``patterns.cuts``). The diagonal of a face contains its smallest node
    number. If two node numbers are equal, the first of them is used.
    """
    rank = np.argsort(np.argsort(nodes, axis=1, kind="stable"), axis=1, kind="stable")
    second = rank[:, QUADS].argmin(axis=2) % 2
    return np.asarray((second << np.arange(len(QUADS))).sum(axis=1))


def halves(quads: Ids) -> Ids:
    """Return (2 n, 3) triangles. Each of the quadrilaterals (n, 4) is cut through the smallest of its four node
    numbers.
    """
    odd = (quads.argmin(axis=1) % 2 == 1)[:, None]
    rolled = np.where(odd, np.roll(quads, -1, axis=1), quads)
    return rolled[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)


def _portions(diagonals: Ids) -> Iterator[Ids]:
    """Yield groups of elements with one pattern of diagonals; a group has as many elements as fit into memory."""
    for each in np.unique(diagonals):
        chosen = np.flatnonzero(diagonals == each)
        yield from np.split(chosen, range(_TOGETHER, len(chosen), _TOGETHER))


def _cut_alike(nodes: Ids, points: Floats, some: Ids, diagonals: Ids) -> tuple[Ids, Ids, Ids]:
    """Return the tets of the elements ``some`` and the element of each tet; also return the elements for which a cut
    with a middle node is better.
    """
    table = cuts(int(diagonals[some[0]]))
    if not len(table):
        return np.zeros((0, 4), np.int64), np.zeros(0, np.int64), some
    every = nodes[some][:, table]
    length = _shortest(points, every, every)
    best = every[np.arange(len(some)), length.argmax(axis=1)]
    corners, spokes, names = _spoked(nodes[some], points, int(diagonals[some[0]]))
    good = length.max(axis=1) > np.maximum(_WORSE * _shortest(corners, spokes, names), 0.0)
    real = good[:, None] & ~_repeats(best)
    return best[real], np.broadcast_to(some[:, None], real.shape)[real], some[~good]


def _around(nodes: Ids, points: Floats, diagonals: Ids, poor: Ids) -> tuple[Ids, Ids, Floats, Ids, Ids]:
    """Cut the elements ``poor`` with a middle node. Return the tets, the element of each tet, the middle nodes, the
    element of each middle node, and the flat elements.
    """
    found = [_spoked(nodes[[each]], points, int(diagonals[each])) for each in poor]
    good = np.array([_shortest(*each)[0] > 0 for each in found], bool)
    middles = np.array([corners[8] for corners, _, _ in found]).reshape(-1, 3)[good]
    tets, of = [np.zeros((0, 4), np.int64)], [np.zeros(0, np.int64)]
    for k, each in enumerate(np.flatnonzero(good)):
        names = found[each][2][0]
        named = np.where(names < 0, len(points) + k, names)[~_repeats(names)]
        tets.append(named)
        of.append(np.full(len(named), poor[each]))
    return np.concatenate(tets), np.concatenate(of), middles, poor[good], poor[~good]


def _spoked(nodes: Ids, points: Floats, diagonals: int) -> tuple[Floats, Ids, Ids]:
    """Return corners and middle (9 s, 3) of each element, and the tets (s, 12, 4) between its faces and its middle.

    The tets are returned in two numberings: by indices of the returned points, and by nodes, with -1 for the middle.
    """
    wheel = np.array([(a, c, b, 8) for a, b, c in skin(diagonals)], np.int64)
    different = np.array([(nodes[:, :k] != nodes[:, k, None]).all(axis=1) for k in range(8)]).T[..., None]
    middle = (points[nodes] * different).sum(axis=1) / different.sum(axis=1)
    corners = np.concatenate([points[nodes], middle[:, None]], axis=1).reshape(-1, 3)
    names = np.column_stack([nodes, np.full(len(nodes), -1)])[:, wheel]
    return corners, 9 * np.arange(len(nodes))[:, None, None] + wheel, names


def _shortest(points: Floats, tets: Ids, names: Ids) -> Floats:
    """Return the shortest step length, m, of the tets (..., k, 4); 0 if a tet has no volume. Tets that repeat a node
    are ignored.
    """
    length = step_lengths(points, tets)
    volume, area = volume_and_area(points, tets)
    length[volume <= FLAT * area * np.sqrt(area)] = 0.0
    length[_repeats(names)] = np.inf
    shortest = length.min(axis=-1)
    return np.where(np.isfinite(shortest), shortest, 0.0)


def _repeats(tets: Ids) -> NDArray[np.bool_]:
    """Return flags of the tets (..., 4): True for each tet that contains a node twice."""
    ordered = np.sort(tets, axis=-1)
    return np.asarray((ordered[..., 1:] == ordered[..., :-1]).any(axis=-1))
