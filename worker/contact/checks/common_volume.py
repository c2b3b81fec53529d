"""What contact has not held: tets that lie in tets of another body or fragment, by the volume that they have in common.

Bodies may reach into each other without a node of one inside of the other (``inside``): by their edges, or face on
face. Every tet that has a corner on the surface, or one that has separated, is cut by all tets that may meet it and
have no node with it in common, but in a part that breaks those that hold together with it. What two tets have in common
is their intersection, exact but for rounding. Tets of other ranks come along by the boxes of what they reach, so that
no cut of the domain changes what is found.
"""

from dataclasses import dataclass

import numpy as np

from ...kernels.jit import njit
from ...mesh.faces import FACES
from ...model.state import Floats, Ints, Model
from ...parallel.comm import Comm
from ...parallel.fixed_point import exact_sums
from ..broad_phase import search
from ..broad_phase.search import Primitives
from ..geometry import at, cross, dot, minus
from ..stage import Contact
from .inside import outermost

LARGE = 0.1
"""Of the volume of a tet: a tet of which more lies in others is counted. Chosen: what bodies of facets that touch have
in common is a hundredth."""
_TOLD, _MOST = 0.01, 0.5
"""Of the volume of all these tets, as the lines of the ledger, and of one of them: what lies in others and is worth a
warning. Chosen."""
_WORDS = 19
"""Of what is told of a tet: its id, its fragment, its part, its nodes' ids and the words of their places."""
_QUANTUM = 2.0**-40
"""Of the volume of a tet, in which its shares are added up, so that their sum does not depend on their order."""
_PIECES = 81
"""Most that four planes leave of a tet: of each piece at most three."""


@dataclass(frozen=True)
class CommonVolume:
    """Equal on all ranks."""

    tets: int
    """That were cut."""
    large: int
    """Those of them of which more than LARGE lies in others."""
    largest: float
    """Most of a tet that lies in others, of its volume."""
    share: float
    """What lies in others, of the volume of all of them."""

    @property
    def warnings(self) -> list[str]:
        """One line, if too much is common."""
        if self.share <= _TOLD and self.largest <= _MOST:
            return []
        return [
            f"{self.large} of {self.tets} tets at surfaces lie in other bodies or fragments by more than a tenth of "
            f"their volume, one by {self.largest:.2g} of it, all together by {self.share:.2g}: contact has not held "
            "them; compare with a finer mesh there"
        ]


def measure(contact: Contact, model: Model, labels: list[Ints] | None, comm: Comm) -> CommonVolume:
    """How much of the tets at the surface lies in others, at the positions as they are; all ranks take part.

    ``labels``: for each block (n,) the fragment of each tet; without, every part is one.
    """
    fragments = labels or [np.full(block.n, block.part, np.int64) for block in model.blocks]
    own = _at_surface(contact, model, fragments)
    whole = exact_sums(comm, np.column_stack([_volumes(_corners(own)), np.ones(len(own))]))
    told = _reaching(own, model, comm)
    corners = _corners(told)
    points = np.concatenate([model.nodes.x, corners.reshape(-1, 3)])
    places = np.arange(model.nodes.n, len(points), dtype=np.int32).reshape(-1, 4)
    part = np.concatenate([model.nodes.part, np.repeat(told[:, 2].astype(np.int32), 4)])
    allowed = ~np.isnan(contact.searches.mu)
    quanta = np.zeros(len(told), np.int64)
    for block, fragment in zip(model.blocks, fragments, strict=True):
        tets = np.ascontiguousarray(block.tets, np.int32)
        one, other = (Primitives(each, np.zeros(len(each))) for each in (places, tets))
        pairs = search.find(one, other, points, np.zeros_like(points), part, allowed, 0.0, None)
        if len(block.bond):
            pairs = pairs[told[pairs[:, 0], 1] != fragment[pairs[:, 1]]]
        _cut(quanta, pairs, told[:, 3:7], corners, model.nodes.id[tets], model.nodes.x[tets])
    some = quanta > 0
    found = np.column_stack([told[some, 0], quanta[some], _volumes(corners[some]).view(np.int64)])
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
    """(n, _WORDS) of the tets of this rank that have a corner on the surface, or one that has separated."""
    outer, found = outermost(contact), [np.zeros((0, _WORDS), np.int64)]
    for block, fragment in zip(model.blocks, fragments, strict=True):
        some = np.flatnonzero(outer[block.tets].any(axis=1))
        ids, corners = model.nodes.id[block.tets[some]], model.nodes.x[block.tets[some]].reshape(-1, 12)
        part = np.full(len(some), block.part)
        found.append(np.column_stack([block.id[some], fragment[some], part, ids, corners.view(np.int64)]))
    return np.concatenate(found)


def _reaching(own: Ints, model: Model, comm: Comm) -> Ints:
    """(n, _WORDS) of the tets at the surface of all ranks that touch the hull of this rank's nodes."""
    hulls = comm.join(_hull(model.nodes.x[None]).view(np.int64)).view(np.float64).reshape(-1, 6)
    low, high = np.split(_hull(_corners(own)), 2, axis=1)
    touch = [((low <= hull[3:]) & (high >= hull[:3])).all(axis=1) for hull in hulls]
    told = comm.swap({rank: own[some].reshape(-1) for rank, some in enumerate(touch) if some.any()})
    return np.concatenate([np.zeros(0, np.int64), *told.values()]).reshape(-1, _WORDS)


def _hull(points: Floats) -> Floats:
    """(n, 6) lowest and highest corner of sets of points (n, k, 3)."""
    least, most = points.min(axis=1, initial=np.inf), points.max(axis=1, initial=-np.inf)
    return np.concatenate([least, most], axis=1)


def _corners(told: Ints) -> Floats:
    """(n, 4, 3) corners of tets that are told of, m."""
    return np.ascontiguousarray(told[:, 7:]).view(np.float64).reshape(-1, 4, 3)


def _volumes(corners: Floats) -> Floats:
    """(n,) volumes of tets (n, 4, 3), m^3; none of those that are inside out."""
    return np.asarray(np.maximum(np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0, 0.0))


@njit("float64(float64[:, :], int64, int64, int64, float64[:, :], int64)", cache=True)
def _triple(tet, a, b, c, other, k):  # type: ignore[no-untyped-def]
    """Six times the volume, m^3, of the tet of three corners of one and corner ``k`` of another."""
    start = at(tet, a)
    return dot(cross(minus(at(tet, b), start), minus(at(tet, c), start)), minus(at(other, k), start))


@njit("float64(float64[:, :])", cache=True)
def _determinant(tet):  # type: ignore[no-untyped-def]
    return _triple(tet, 0, 1, 2, tet, 3)


@njit("float64(float64[:, :], int64, float64[:, :], int64)", cache=True)
def _height(tet, face, other, k):  # type: ignore[no-untyped-def]
    """``_triple`` of corner ``k`` of ``other`` and the face across from a corner; above 0 inside."""
    return -_triple(tet, FACES[face, 0], FACES[face, 1], FACES[face, 2], other, k)


@njit("boolean(float64[:, ::1], float64[:, ::1])", cache=True)
def _apart(one, other):  # type: ignore[no-untyped-def]
    """Whether a tet lies behind a face of another."""
    for face in range(4):
        behind = True
        for k in range(4):
            behind &= _height(one, face, other, k) <= 0.0
        if behind:
            return True
    return False


@njit("void(float64[::1], float64[:, ::1], float64[::1], int64, int64)", cache=True)
def _meet(point, tet, height, a, b):  # type: ignore[no-untyped-def]
    """Sets the ``point`` where the edge from corner a to b goes through the plane above which they have a height."""
    share = height[a] / (height[a] - height[b])
    for i in range(3):
        point[i] = tet[a, i] + share * (tet[b, i] - tet[a, i])


@njit(
    "int64(float64[:, :, ::1], int64, float64[:, ::1], float64[::1], float64[:, ::1], int64[::1])",
    cache=True, _nrt=True,
)  # fmt: skip
def _in_front(out, n, tet, height, wedge, order):  # type: ignore[no-untyped-def]
    """What of a tet is before a plane, by the heights of its corners, as pieces from row ``n`` of ``out`` on; returns
    their new number. With one, two or three corners behind it, it is a wedge or half of one, of three tets, or the tet
    at the corner before it. ``wedge`` (6, 3), ``order`` (4,): room.
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
        if before == 2:  # an edge of the tet joins the ends of the wedge
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
    """Six times the volume, m^3, that two tets (4, 3), neither inside out, have in common: the first is cut by the
    planes of the second, one after the other. With room for pieces, twice (_PIECES, 4, 3).
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
    """Adds to ``quanta`` (n,) the shares of the tets ``ones`` (n, 4, 3) that they have in common with ``others``
    (m, 4, 3), pair by pair (p, 2), where they have no node in common; ``ids`` (n, 4), (m, 4): of their nodes.
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
