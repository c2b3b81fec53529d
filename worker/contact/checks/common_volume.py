"""Common volume of bodies: the volume of tets that is inside of tets of another body or fragment.

Bodies may overlap although no node of one body is inside of the other (``inside``): their edges may cross, or their
faces may coincide. Every tet with a corner on the surface, or with a separated corner, is compared with all tets that
have no common node with it and whose part may be in contact with its part. In a part that breaks, tets of the same
fragment are excluded. The common volume of two tets is the volume of their intersection, exact except for round-off.
Tets of other ranks are exchanged by bounding boxes, so that the result does not depend on the partition.
"""

from dataclasses import dataclass

import numpy as np

from ...kernels.jit import njit
from ...mesh.faces import FACES
from ...model.state import Floats, Ints, Model
from ...parallel.comm import Comm
from ...parallel.fixed_point import exact_sums
from ..broad_phase import search
from ..broad_phase.boxes import Primitives
from ..geometry import at, cross, dot, minus
from ..stage import Contact
from .inside import outermost

LARGE = 0.1
"""Largest fraction of the volume of a tet that may lie in other tets. A tet with a larger fraction is counted. Chosen
value: where curved bodies of flat facets touch, their tets have about a hundredth of the volume in common."""
_SHARED, _MOST = 0.01, 0.5
"""Limits of the warning: ratio of the common volume to the volume of all tested tets, and largest ratio of the common
volume of one tet to its volume. Chosen values; the first limit is equal to the limit of the terms of the energy
ledger."""
_WORDS = 19
"""Number of words of a tet in a message: its id, its fragment, its part, the ids of its nodes, and the words of their
positions."""
_QUANTUM = 2.0**-40
"""Quantum in which the common volumes of a tet are summed, divided by the volume of the tet. Sums of quanta do not
depend on the order of summation."""
_PIECES = 81
"""Largest number of pieces of a tet after four cuts by planes. Each cut divides a piece into at most three pieces."""


@dataclass(frozen=True)
class CommonVolume:
    """Result of the check. All ranks have equal values."""

    tets: int
    """Number of tested tets."""
    large: int
    """Number of tets with more than the fraction LARGE of their volume in other tets."""
    largest: float
    """Largest fraction of the volume of one tet that lies in other tets."""
    share: float
    """Fraction of the volume of all tested tets that lies in other tets."""

    @property
    def warnings(self) -> list[str]:
        """Returns a warning if the common volume is above the limits."""
        if self.share <= _SHARED and self.largest <= _MOST:
            return []
        return [
            f"{self.large} of {self.tets} tets at surfaces lie in other bodies or fragments by more than a tenth of "
            f"their volume, one by {self.largest:.2g} of it, all together by {self.share:.2g}: "
            "compare with a finer mesh there"
        ]


def measure(contact: Contact, model: Model, labels: list[Ints] | None, comm: Comm) -> CommonVolume:
    """Measures the volume of tets at the surface inside of other tets, at the present positions. Collective.

    ``labels``: fragment of each tet, one array (n,) for each block; None if every part is one fragment.
    """
    fragments = labels or [np.full(block.n, block.part, np.int64) for block in model.blocks]
    own = _at_surface(contact, model, fragments)
    whole = exact_sums(comm, np.column_stack([_volumes(_corners(own)), np.ones(len(own))]))
    received = _reaching(own, model, comm)
    corners = _corners(received)
    points = np.concatenate([model.nodes.x, corners.reshape(-1, 3)])
    places = np.arange(model.nodes.n, len(points), dtype=np.int32).reshape(-1, 4)
    part = np.concatenate([model.nodes.part, np.repeat(received[:, 2].astype(np.int32), 4)])
    allowed = ~np.isnan(contact.searches.mu)
    quanta = np.zeros(len(received), np.int64)
    for block, fragment in zip(model.blocks, fragments, strict=True):
        tets = np.ascontiguousarray(block.tets, np.int32)
        one, other = (Primitives(each, np.zeros(len(each))) for each in (places, tets))
        pairs = search.find(one, other, points, np.zeros_like(points), part, allowed, 0.0, None)
        if len(block.bond):
            pairs = pairs[received[pairs[:, 0], 1] != fragment[pairs[:, 1]]]
        _cut(quanta, pairs, received[:, 3:7], corners, model.nodes.id[tets], model.nodes.x[tets])
    some = quanta > 0
    found = np.column_stack([received[some, 0], quanta[some], _volumes(corners[some]).view(np.int64)])
    found = comm.join(found.reshape(-1)).reshape(-1, 3)
    tets, of = np.unique(found[:, 0], return_inverse=True)
    shares, volumes = np.zeros(len(tets), np.int64), np.zeros(len(tets))
    np.add.at(shares, of, found[:, 1])
    volumes[of] = np.ascontiguousarray(found[:, 2]).view(np.float64)
    share = shares * _QUANTUM
    common = float((share * volumes).sum())
    return CommonVolume(
        int(whole[1]), int((share > LARGE).sum()), float(share.max(initial=0.0)),
        common / float(whole[0]) if whole[0] > 0.0 else 0.0,
    )  # fmt: skip


def _at_surface(contact: Contact, model: Model, fragments: list[Ints]) -> Ints:
    """(n, _WORDS) words of the tets of this rank that have a corner on the surface or a separated corner."""
    outer, found = outermost(contact), [np.zeros((0, _WORDS), np.int64)]
    for block, fragment in zip(model.blocks, fragments, strict=True):
        some = np.flatnonzero(outer[block.tets].any(axis=1))
        ids, corners = model.nodes.id[block.tets[some]], model.nodes.x[block.tets[some]].reshape(-1, 12)
        part = np.full(len(some), block.part)
        found.append(np.column_stack([block.id[some], fragment[some], part, ids, corners.view(np.int64)]))
    return np.concatenate(found)


def _reaching(own: Ints, model: Model, comm: Comm) -> Ints:
    """(n, _WORDS) words of the surface tets of all ranks that touch the bounding box of this rank's nodes."""
    hulls = comm.join(_hull(model.nodes.x[None]).view(np.int64)).view(np.float64).reshape(-1, 6)
    low, high = np.split(_hull(_corners(own)), 2, axis=1)
    touch = [((low <= hull[3:]) & (high >= hull[:3])).all(axis=1) for hull in hulls]
    received = comm.swap({rank: own[some].reshape(-1) for rank, some in enumerate(touch) if some.any()})
    return np.concatenate([np.zeros(0, np.int64), *received.values()]).reshape(-1, _WORDS)


def _hull(points: Floats) -> Floats:
    """(n, 6) lowest and highest corner of sets of points (n, k, 3)."""
    least, most = points.min(axis=1, initial=np.inf), points.max(axis=1, initial=-np.inf)
    return np.concatenate([least, most], axis=1)


def _corners(received: Ints) -> Floats:
    """(n, 4, 3) corners of the received tets, m."""
    return np.ascontiguousarray(received[:, 7:]).view(np.float64).reshape(-1, 4, 3)


def _volumes(corners: Floats) -> Floats:
    """(n,) volumes of tets (n, 4, 3), m^3; 0 for inverted tets."""
    return np.asarray(np.maximum(np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0, 0.0))


@njit("float64(float64[:, :], int64, int64, int64, float64[:, :], int64)", cache=True)
def _triple(tet, a, b, c, other, k):  # type: ignore[no-untyped-def]
    """Six times the signed volume, m^3, of the tet that consists of three corners of one tet and corner ``k`` of
    another tet.
    """
    start = at(tet, a)
    return dot(cross(minus(at(tet, b), start), minus(at(tet, c), start)), minus(at(other, k), start))


@njit("float64(float64[:, :])", cache=True)
def _determinant(tet):  # type: ignore[no-untyped-def]
    return _triple(tet, 0, 1, 2, tet, 3)


@njit("float64(float64[:, :], int64, float64[:, :], int64)", cache=True)
def _height(tet, face, other, k):  # type: ignore[no-untyped-def]
    """Returns the result of ``_triple`` for corner ``k`` of the tet ``other`` and the face of a tet that is opposite to
    one of its corners. The returned volume is positive if the corner is on the inner side of the face.
    """
    return -_triple(tet, FACES[face, 0], FACES[face, 1], FACES[face, 2], other, k)


@njit("boolean(float64[:, ::1], float64[:, ::1])", cache=True)
def _apart(one, other):  # type: ignore[no-untyped-def]
    """Returns True if one of the two tets lies entirely on the outer side of a face of the other tet."""
    for face in range(4):
        behind = True
        for k in range(4):
            behind &= _height(one, face, other, k) <= 0.0
        if behind:
            return True
    return False


@njit("void(float64[::1], float64[:, ::1], float64[::1], int64, int64)", cache=True)
def _meet(point, tet, height, a, b):  # type: ignore[no-untyped-def]
    """Sets ``point`` to the intersection of the edge from corner a to corner b with the plane to which the heights
    refer.
    """
    share = height[a] / (height[a] - height[b])
    for i in range(3):
        point[i] = tet[a, i] + share * (tet[b, i] - tet[a, i])


@njit(
    "int64(float64[:, :, ::1], int64, float64[:, ::1], float64[::1], float64[:, ::1], int64[::1])",
    cache=True, _nrt=True,
)  # fmt: skip
def _in_front(out, n, tet, height, wedge, order):  # type: ignore[no-untyped-def]
    """Cuts a tet by a plane, which is given by the heights of the corners above it. Writes the pieces in front of the
    plane to ``out`` from row ``n`` on. Returns the new number of pieces. With one corner in front of the plane the
    result is a tet; with two or three corners it is a wedge, made of three tets. ``wedge`` (6, 3), ``order`` (4,):
    working arrays.
    """
    before, end = 0, 4
    for k in range(4):
        if height[k] > 0.0:
            order[before] = k
            before += 1
        else:
            end -= 1
            order[end] = k
    if before == 4:
        out[n] = tet
        return n + 1
    if before == 1:
        out[n, 0] = tet[order[0]]
        for k in range(1, 4):
            _meet(out[n, k], tet, height, order[0], order[k])
        return n + 1
    if before == 0:
        return n
    for k in range(before):
        if before == 2:  # an edge of the tet joins the two end triangles of the wedge
            wedge[3 * k] = tet[order[k]]
            _meet(wedge[3 * k + 1], tet, height, order[k], order[2])
            _meet(wedge[3 * k + 2], tet, height, order[k], order[3])
        else:
            wedge[k] = tet[order[k]]
            _meet(wedge[3 + k], tet, height, order[k], order[3])
    for k in range(3):
        out[n + k] = wedge[k : k + 4]
    return n + 3


@njit("float64(float64[:, :, ::1], float64[:, :, ::1], float64[:, ::1], float64[:, ::1])", cache=True)
def intersection(pieces, others, one, other):  # type: ignore[no-untyped-def]
    """Six times the common volume, m^3, of two tets (4, 3). Neither of the two tets is inverted. The first tet is cut
    by the face planes of the second tet, one after the other. ``pieces``, ``others`` (_PIECES, 4, 3): working arrays.
    """
    n, height, wedge, order = 1, np.empty(4), np.empty((6, 3)), np.empty(4, np.int64)
    pieces[0] = one
    for face in range(4):
        kept = 0
        for piece in range(n):
            for k in range(4):
                height[k] = _height(other, face, pieces[piece], k)
            kept = _in_front(others, kept, pieces[piece], height, wedge, order)
        pieces, others, n = others, pieces, kept
    common = 0.0
    for piece in range(n):
        common += abs(_determinant(pieces[piece]))
    return common


@njit(
    "void(int64[::1], int32[:, ::1], int64[:, :], float64[:, :, ::1], int64[:, ::1], float64[:, :, ::1])",
    cache=True,
    error_model="numpy",
)
def _cut(quanta, pairs, ids, ones, other_ids, others):  # type: ignore[no-untyped-def]
    """Adds to ``quanta`` (n,) the fraction of each tet of ``ones`` (n, 4, 3) that is inside of tets of ``others`` (m,
    4, 3). Only the pairs (p, 2) without a common node are used. ``ids`` (n, 4), ``other_ids`` (m, 4): global ids of the
    nodes of the tets.
    """
    pieces, next_pieces = np.empty((_PIECES, 4, 3)), np.empty((_PIECES, 4, 3))
    for p in range(len(pairs)):
        a, b = pairs[p, 0], pairs[p, 1]
        one, other, neighbours = ones[a], others[b], False
        for j in range(4):
            for k in range(4):
                neighbours |= ids[a, j] == other_ids[b, k]
        whole = _determinant(one)
        if neighbours or whole <= 0.0 or _determinant(other) <= 0.0 or _apart(one, other) or _apart(other, one):
            continue
        share = intersection(pieces, next_pieces, one, other) / whole
        if share > 0.0:
            quanta[a] += np.int64(min(share, 1.0) / _QUANTUM)
