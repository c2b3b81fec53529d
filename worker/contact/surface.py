"""The surface of the bodies on one rank: exposed faces, sharp edges, and the nodes on either."""

from dataclasses import dataclass

import numpy as np

from ..mesh.faces import FACES
from ..mesh.faces import normals as face_normals
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, complete
from ..parallel.tags import Tag
from ..state import LAID_BARE, Flags, Indices, Ints, Model
from .records import Edges, Faces

SHARP = np.cos(np.radians(25.0))
"""Edges between faces whose initial normals differ by more than this can meet other edges."""


@dataclass
class Surface:
    """What one rank has of it."""

    faces: Faces
    """Of this rank's tets."""
    edges: Edges
    """Whose face of smaller id is of this rank's tets."""
    flags: Flags
    """(nodes,) which nodes of this rank are on the surface, by a face of any rank; or were, and have lost it."""
    waiting: Flags
    """(nodes,) which nodes of this rank are on a crack that may open, by a face of any rank."""
    far: Ints
    """(k,) ids of nodes of ``edges`` that this rank does not hold."""
    far_owner: Indices
    """(k,) their owners."""


def build(
    model: Model, planes: Flags, neighbours: list[Neighbour], comm: Comm, edges: bool, cracks: Indices
) -> Surface:
    """The surface; all ranks take part.

        ``planes`` (nodes, planes) says which nodes lie on which symmetry plane. A face with all three nodes on the same
    plane is no surface; a face of a body one tet thick, with nodes on two parallel planes, is part of it. ``cracks``
    (m, 3): block, place and face of the sides here of cracks that may open before the next search. Faces that erosion
    has laid bare meet nodes; their edges meet no edges: they would be as many as the faces, and all sharp.
    """
    local, ids, exposed, bare = _faces(model, planes, cracks)
    flags = _flags(local[exposed], model.nodes.n, neighbours, comm)
    waiting = _flags(local[~exposed], model.nodes.n, neighbours, comm)
    sharp = _none()
    if edges:
        sharp = _sharp(model, local[~bare], ids[~bare], exposed[~bare], neighbours, comm)
    return Surface(_table(model, local, ids, exposed), sharp[0], flags, waiting, *sharp[1:])


def _table(model: Model, local: "np.ndarray", ids: Ints, exposed: Flags) -> Faces:
    nodes = model.nodes
    size = np.sqrt(np.linalg.norm(face_normals(nodes.x0, local), axis=1))
    return Faces(ids, nodes.id[local], size, exposed).take(np.argsort(ids))


def _faces(model: Model, planes: Flags, cracks: Indices) -> tuple["np.ndarray", Ints, Flags, Flags]:
    """(f, 4) local nodes of the exposed faces and of the ``cracks``, the opposite one last; their ids; which are
    exposed; and which erosion has laid bare.
    """
    rows, ids, exposed, bare = [np.zeros((0, 4), np.int64)], [np.zeros(0, np.int64)], [], []
    for b, block in enumerate(model.blocks):
        shown = block.exposed()
        closed = cracks[cracks[:, 0] == b]
        seen = shown.copy()
        seen[closed[:, 1], closed[:, 2]] = True
        tet, face = np.nonzero(seen)
        corners = block.tets.astype(np.int64)[tet]
        around = corners[np.arange(len(tet))[:, None], FACES[face]]
        rows.append(np.column_stack([around, corners[np.arange(len(tet)), face]]))
        ids.append(4 * block.id[tet] + face)
        exposed.append(shown[tet, face])
        bare.append(block.across[tet, face] == LAID_BARE)
    local: np.ndarray = np.concatenate(rows)
    mirrored = planes[local[:, :3]].all(axis=1).any(axis=1)
    none = np.zeros(0, bool)
    columns = np.concatenate(ids), np.concatenate([none, *exposed]), np.concatenate([none, *bare])
    number, shown, laid = (column[~mirrored] for column in columns)
    return local[~mirrored], number, shown, laid


def _flags(faces: "np.ndarray", n: int, neighbours: list[Neighbour], comm: Comm) -> Flags:
    counts = np.zeros((n, 1), np.int64)
    counts[faces[:, :3]] = 1
    complete(comm, neighbours, counts, Tag.SURFACE)
    return np.asarray(counts[:, 0] > 0)


def _none() -> tuple[Edges, Ints, Indices]:
    none = np.zeros((0, 4), np.int64)
    edges = Edges(none, none[:, :2], np.zeros(0), np.zeros((0, 2), bool))
    return edges, np.zeros(0, np.int64), np.zeros(0, np.int32)


_LOW, _HIGH, _THIRD, _OWNER, _FACE, _TURNED, _EXPOSED, _LENGTH, _NORMAL = 0, 1, 2, 3, 4, 5, 6, 7, 8
"""Columns of a half edge, an edge as one face sees it: its nodes, the third node of the face and its owner, the face,
whether the face runs from high to low, whether it is exposed, initial length, m, and the unit normal of the face;
floats as their bits."""
_HALF, _ROW = 11, 11
"""Columns of a half edge, and of an edge (``_paired``)."""


def _sharp(
    model: Model, faces: "np.ndarray", ids: Ints, exposed: Flags, neighbours: list[Neighbour], comm: Comm
) -> tuple[Edges, Ints, Indices]:
    """Sharp edges, and the nodes of theirs that are not held here, with their owners.

    Where other ranks may hold faces of an edge, the owner of the lower node brings them together, and the rank of the
    face of smaller id has the edge.
    """
    nodes = model.nodes
    halves, ends = _halves(model, faces, ids, exposed)
    shared = np.zeros(nodes.n, bool)
    shared[np.concatenate([np.zeros(0, np.int32), *(other.nodes for other in neighbours)])] = True
    common = shared[ends[:, 0]] & shared[ends[:, 1]]
    here, home = _paired(halves[~common]), nodes.owner[ends[:, 0]]
    found = comm.swap({int(rank): halves[common & (home == rank)] for rank in np.unique(home[common])})
    gathered = np.concatenate([halves[:0], *(f.reshape(-1, _HALF) for f in found.values())])
    sender = np.concatenate([np.zeros(0, np.int64), *(np.full(len(f) // _HALF, r) for r, f in found.items())])
    met = _paired(gathered)
    order = np.argsort(gathered[:, _FACE])
    target = sender[order[np.searchsorted(gathered[order, _FACE], met[:, 6])]]
    back = comm.swap({int(rank): met[target == rank] for rank in np.unique(target)})
    rows = np.concatenate([here, *(f.reshape(-1, _ROW) for f in back.values())])
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0], rows[:, 7], rows[:, 6]))]
    ends, owners = rows[:, 2:4].reshape(-1), rows[:, 4:6].reshape(-1)
    far, first = np.unique(ends[~np.isin(ends, nodes.id)], return_index=True)
    owner = owners[~np.isin(ends, nodes.id)][first]
    edges = Edges(rows[:, :4].copy(), rows[:, 6:8].copy(), rows[:, 8].copy().view(np.float64), rows[:, 9:] > 0)
    return edges, far, owner.astype(np.int32)


def _halves(model: Model, faces: "np.ndarray", ids: Ints, exposed: Flags) -> tuple[Ints, Ints]:
    """(3 f, 11) half edges of the faces, and (3 f, 2) the local nodes of each."""
    nodes = model.nodes
    normals = face_normals(nodes.x0, faces)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    parts, ends = [], []
    for k in range(3):
        a, b, c = (faces[:, (k + i) % 3] for i in range(3))
        turned = a > b
        low, high = np.minimum(a, b), np.maximum(a, b)
        ends.append(np.column_stack([low, high]))
        length = np.linalg.norm(nodes.x0[b] - nodes.x0[a], axis=1)
        floats = np.column_stack([length, normals]).view(np.int64)
        known = nodes.id[low], nodes.id[high], nodes.id[c], nodes.owner[c], ids, turned, exposed
        parts.append(np.column_stack([*known, floats]))
    return np.concatenate(parts), np.concatenate(ends)


def _paired(halves: Ints) -> Ints:
    """Rows (a, b, c, d, owner of c, owner of d, face abc, face bad, length, whether either face is exposed) of sharp
    edges of every two faces that run against each other there, but for the two sides of one facet.
    """
    halves = halves[np.lexsort((halves[:, _FACE], halves[:, _HIGH], halves[:, _LOW]))]
    found, apart = [np.zeros((0, _ROW), np.int64)], 1
    while True:
        same = (halves[apart:, [_LOW, _HIGH]] == halves[: len(halves) - apart, [_LOW, _HIGH]]).all(axis=1)
        first = np.flatnonzero(same)
        if not len(first):
            return np.concatenate(found)
        found.append(_edges_of(halves[first], halves[first + apart]))
        apart += 1


def _edges_of(one: Ints, two: Ints) -> Ints:
    """See ``_paired``; ``one`` and ``two`` (n, 11): half edges of the same edge, that of the smaller face first."""
    cosine = (one[:, _NORMAL:].copy().view(np.float64) * two[:, _NORMAL:].copy().view(np.float64)).sum(axis=1)
    kept = (cosine < SHARP) & (one[:, _TURNED] != two[:, _TURNED]) & (one[:, _THIRD] != two[:, _THIRD])
    one, two = one[kept], two[kept]
    ends = np.where((one[:, _TURNED] != 0)[:, None], one[:, [_HIGH, _LOW]], one[:, [_LOW, _HIGH]])
    others = (np.column_stack([one[:, k], two[:, k]]) for k in (_THIRD, _OWNER, _FACE))
    exposed = np.column_stack([one[:, _EXPOSED], two[:, _EXPOSED]])
    return np.column_stack([ends, *others, one[:, _LENGTH], exposed])
