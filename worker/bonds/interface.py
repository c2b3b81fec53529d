"""Tied interface at the start: the nodes of one part that are tied to faces of another part, and the weights of the
ties.

The nodes of the finer surface, the tied side, are tied to faces of the other surface, the mortar side. A rigid part is
always the mortar side. The velocities v_i of the tied side and v_j of the mortar side fulfil

    D_i v_i = sum_j M_ij v_j,   D_i = int psi_i dA,   M_ij = int psi_i N_j dA,

with the shape functions N of the mortar side, and functions psi that are dual to the shape functions of the tied side
on every tied face (dual mortar method, Wohlmuth 2000). A constant stress is transmitted exactly, and each equation
contains only one tied node. If the mortar side covers only a part of a tied face, each node of the tied face that lies
on the mortar side is tied to the mortar point below it (collocation). The weight of a node tied by collocation is its
share of the covered area.
"""

from dataclasses import dataclass

import numpy as np

from conoid.cases.model.bonds import GAP, TiedBond
from conoid.cases.model.schema import Case

from ..contact.broad_phase import search
from ..contact.broad_phase.boxes import Primitives
from ..errors import InputError
from ..mesh.faces import FACES
from ..mesh.faces import areas as face_areas
from ..model.state import Flags, Floats, Indices, Ints
from . import clipping
from .pieces import Pieces
from .rows import assembled

_NEAR = 10.0
"""Ratio of a distance to the largest bonded distance, below which nodes that are not tied are counted in a warning."""
_COVERED = 0.95
"""Smallest fraction of the area of a tied face that must be covered by the mortar side, so that the face counts as
covered. Chosen value: between curved surfaces, whose faces are not parallel, gaps and overlaps of 1 or 2 % of the area
occur."""
_LEAST = 1e-9
"""Smallest ratio of a common area to the area of the tied face; smaller common areas are ignored."""
_ON = 1e-6
"""Tolerance of the area coordinates. A node that is outside of a face by less than the tolerance counts as lying on the
face."""


@dataclass
class Found:
    """Tied bonds at the start of a run, and warnings about them."""

    pieces: Pieces
    x: Floats
    """(nodes, 3) positions of all nodes, m. The tied nodes have been moved onto the mortar side."""
    warnings: list[str]


@dataclass
class _Faces:
    """Exposed faces of a part."""

    name: Ints
    """(f,) name of each face: 4 * tet + local face."""
    nodes: Indices
    """(f, 3) corner nodes of each face."""
    size: Floats
    """(f,) size of each face, m: the square root of twice its area."""

    def take(self, chosen: Flags | Ints) -> "_Faces":
        return _Faces(self.name[chosen], self.nodes[chosen], self.size[chosen])


def tied_pairs(case: Case) -> list[tuple[int, int, int]]:
    """Returns the number of the bond and the numbers of its two parts, for every tied bond."""
    names = [part.name for part in case.parts]
    return [
        (k, names.index(bond.parts[0]), names.index(bond.parts[1]))
        for k, bond in enumerate(case.bond)
        if isinstance(bond, TiedBond)
    ]


def find(case: Case, x: Floats, tets: Indices, tet_part: Indices, exposed: Flags) -> Found:
    """Returns the pieces of all tied bonds. A piece is the common area of two faces. ``exposed`` (tets, 4): True for
    each exposed face. Raises InputError if a bond ties no node.
    """
    found, warnings, x = list[Pieces](), list[str](), x.copy()
    for bond, one, two in tied_pairs(case):
        if not ((tet_part == one).any() and (tet_part == two).any()):
            continue  # a check before a run may have no mesh for some parts
        pieces, more = _bonded(
            case, bond, x, [_surface(x, tets, exposed & (tet_part == part)[:, None]) for part in (one, two)]
        )
        warnings += more
        found.append(pieces)
        _settle(x, pieces, tets)
        _refuse_inverted(bond, x, tets)
    return Found(Pieces.joined(found), x, warnings)


def _surface(x: Floats, tets: Indices, exposed: Flags) -> _Faces:
    """Returns the exposed faces. ``exposed`` (tets, 4): True for each exposed face."""
    tet, face = np.nonzero(exposed)
    nodes = np.ascontiguousarray(tets[tet[:, None], FACES[face]], np.int32)
    return _Faces(4 * tet + face, nodes, np.sqrt(2.0 * face_areas(x, nodes)))


def _bonded(
    case: Case, bond: int, x: Floats, sides: list[_Faces]
) -> tuple[Pieces, list[str]]:  # fmt: skip
    """Returns the pieces (common areas of two faces) of one bond, and warnings about the bond."""
    spec = case.bond[bond]
    assert isinstance(spec, TiedBond)
    reach = [_NEAR * (np.full(len(s.size), spec.gap) if spec.gap is not None else GAP * s.size) for s in sides]
    pairs = _near(x, sides[0], sides[1], reach[0], reach[1])
    sizes = [s.size[np.unique(column)].mean() if len(column) else 0.0 for s, column in zip(sides, pairs.T, strict=True)]
    one, two = (_rigid(case, name) for name in spec.parts)
    turned = sizes[0] < sizes[1] if one == two else two
    if turned:
        sides, pairs = sides[::-1], np.ascontiguousarray(pairs[:, ::-1])
    master, slave = sides
    cut = _Cut.of(x, slave, master, np.ascontiguousarray(pairs[:, ::-1]))
    limit = spec.gap if spec.gap is not None else GAP * np.minimum(slave.size[cut.slave], master.size[cut.master])
    near = (cut.distance <= limit) & (cut.area > _LEAST * slave.size[cut.slave] ** 2)
    names = spec.parts if turned else spec.parts[::-1]
    warnings = _missed(bond, x, slave, cut, near, limit, names)
    pieces = _weighted(bond, slave, master, cut.take(near))
    if not len(pieces):
        raise InputError(_nothing(bond, spec, cut, limit))
    return pieces, warnings


def _rigid(case: Case, name: str) -> bool:
    return any(case.parts[index].name == name for index in case.rigid)


def _near(x: Floats, one: _Faces, two: _Faces, reach: Floats, other: Floats) -> Indices:
    """(p, 2) pairs of a face of each part that may lie near each other."""
    faces, part = np.concatenate([one.nodes, two.nodes]), np.zeros(len(x), np.int32)
    part[two.nodes] = 1
    corners, many = np.ascontiguousarray(faces), len(one.nodes)
    rows = np.arange(len(faces), dtype=np.int32)
    both = np.concatenate([reach, other])
    small, large = Primitives(corners, both, rows[:many]), Primitives(corners, both, rows[many:])
    found = search.find(small, large, x, np.zeros_like(x), part, ~np.eye(2, dtype=bool), 0.0, None)
    found = found[np.lexsort((found[:, 1], found[:, 0]))]
    return np.ascontiguousarray(found - np.array([0, many], np.int32), np.int32)


@dataclass
class _Cut:
    """Pairs of faces with their common areas and integrals (clipping.common)."""

    slave: Ints
    master: Ints
    area: Floats
    distance: Floats
    least: Floats
    own: Floats
    both: Floats
    corner: Floats

    @classmethod
    def of(cls, x: Floats, slave: _Faces, master: _Faces, pairs: Indices) -> "_Cut":
        n = len(pairs)
        area, far = np.empty(n), np.empty((n, 2))
        own, both, corner = np.empty((n, 3, 3)), np.empty((n, 3, 3)), np.empty((n, 3, 3))
        clipping.common(area, far, own, both, corner, x, slave.nodes, master.nodes, pairs)
        slaves, masters = pairs.T.astype(np.int64)
        cut = cls(slaves, masters, area, np.abs(far).max(axis=1, initial=0.0), far[:, 0], own, both, corner)
        return cut.take(area > 0.0)

    def take(self, chosen: Flags) -> "_Cut":
        return _Cut(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))


def _weighted(bond: int, slave: _Faces, master: _Faces, cut: _Cut) -> Pieces:
    """Returns the pieces with their weights. Covered tied faces use dual shape functions; other tied faces use
    collocation.
    """
    own, area = np.zeros((len(slave.name), 3, 3)), np.zeros(len(slave.name))
    np.add.at(own, cut.slave, cut.own)
    np.add.at(area, cut.slave, cut.area)
    covered = area >= _COVERED * 0.5 * slave.size**2
    lumped = own.sum(axis=2)
    weights = np.zeros((len(cut.slave), 3, 3))
    whole = covered[cut.slave]
    dual = _dual(own[covered], lumped[covered])
    at = (np.cumsum(covered) - 1)[cut.slave[whole]]
    for i in range(3):
        for k in range(3):
            weights[whole, i] += dual[at, i, k, None] * cut.both[whole, k]
    _collocate(weights, cut, ~whole, lumped)
    some = np.abs(weights).max(axis=(1, 2), initial=0.0) > 0.0
    many = np.bincount(cut.slave[some], minlength=len(slave.name))[cut.slave[some]]
    bonds = np.full(int(some.sum()), bond)
    names = slave.name[cut.slave[some]], master.name[cut.master[some]]
    return Pieces.joined([Pieces(bonds, *names, weights[some].reshape(-1, 9), many)])


def _dual(own: Floats, lumped: Floats) -> Floats:
    """(f, 3, 3) dual shape functions of faces, as linear combinations of the shape functions. The matrix is ``lumped``
    times the inverse of ``own``, which is computed by cofactors.
    """
    inverse = np.empty_like(own)
    for i in range(3):
        for j in range(3):
            a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            inverse[:, j, i] = own[:, a, c] * own[:, b, d] - own[:, a, d] * own[:, b, c]
    whole = own[:, 0, 0] * inverse[:, 0, 0] + own[:, 0, 1] * inverse[:, 1, 0] + own[:, 0, 2] * inverse[:, 2, 0]
    return lumped[:, :, None] * (inverse / whole[:, None, None])


def _collocate(weights: Floats, cut: _Cut, some: Flags, lumped: Floats) -> None:
    """Sets the weights on tied faces that are only partly covered. A corner may lie in several pieces; its weights are
    those of the piece in which it lies deepest.
    """
    rows = np.flatnonzero(some)
    inside = cut.corner[rows].min(axis=2)
    for k in range(3):
        order = np.lexsort((-inside[:, k], cut.slave[rows]))
        first = np.ones(len(order), bool)
        first[1:] = cut.slave[rows[order[1:]]] != cut.slave[rows[order[:-1]]]
        best = order[first]
        best = best[inside[best, k] >= -_ON]
        at = rows[best]
        weights[at, k] = lumped[cut.slave[at], k, None] * cut.corner[at, k]


def _settle(x: Floats, pieces: Pieces, tets: Indices) -> None:
    """Moves the tied nodes to the points on the mortar side to which they are tied."""
    rows = assembled(pieces, corners(pieces.slave, tets), corners(pieces.master, tets))
    where = np.zeros((len(rows.node), 3))
    for i in range(3):
        where[:, i] = np.bincount(rows.row, rows.weight * x[rows.master, i], len(rows.node))
    x[rows.node] = where


def corners(names: Ints, tets: Indices) -> Ints:
    """(p, 3) corner nodes of faces that are given by their names."""
    return np.asarray(tets[names // 4][np.arange(len(names))[:, None], FACES[names % 4]].astype(np.int64))


def _refuse_inverted(bond: int, x: Floats, tets: Indices) -> None:
    e = [x[tets[:, k]] - x[tets[:, 0]] for k in (1, 2, 3)]
    if not ((e[0] * np.cross(e[1], e[2])).sum(axis=1) > 0.0).all():
        raise InputError(
            f"bond[{bond}].gap: tets turn inside out when the tied nodes are moved onto the other part; move the parts "
            "nearer to each other"
        )


def _missed(
    bond: int, x: Floats, slave: _Faces, cut: _Cut, near: Flags, limit: Floats | float, names: tuple[str, str]
) -> list[str]:
    """Returns a warning about nodes that face the other part but are too far from it to be tied."""
    tied = np.unique(slave.nodes[cut.slave[near]])
    aside = ~near & (cut.least > 0.0) & (cut.distance > limit) & (cut.distance <= _NEAR * limit)
    left = np.setdiff1d(np.unique(slave.nodes[cut.slave[aside]]), tied)
    if not len(left):
        return []
    far = float(cut.distance[aside].max())
    return [
        f"bond[{bond}]: {len(left)} nodes of {names[0]!r} are not tied: their distance from {names[1]!r} is up to "
        f"{far:.3g} m, more than bond[{bond}].gap{_worded(limit)}"
    ]


def _worded(limit: Floats | float) -> str:
    most = float(np.max(limit)) if np.size(limit) else 0.0
    return f" = {most:.3g} m"


def _nothing(bond: int, spec: TiedBond, cut: _Cut, limit: Floats | float) -> str:
    """Returns the reason why a bond ties no node."""
    one, two = spec.parts
    if not len(cut.area):
        return f"bond[{bond}].parts: no faces of {one!r} and {two!r} lie face to face; move the parts to each other"
    nearest = int(np.argmin(cut.distance))
    least = float(cut.distance[nearest])
    if least <= float(np.max(limit)):
        return f"bond[{bond}].parts: {one!r} and {two!r} touch in a line or a point only; a bond needs faces in common"
    if cut.least[nearest] < 0.0:
        return (
            f"bond[{bond}].gap{_worded(limit)}: {one!r} and {two!r} overlap by {least:.3g} m or more; move them apart, "
            "or raise it"
        )
    return (
        f"bond[{bond}].gap{_worded(limit)}: the nearest faces of {one!r} and {two!r} are {least:.3g} m apart; move the "
        "parts to each other, or raise it"
    )
