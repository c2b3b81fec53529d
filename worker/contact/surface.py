"""The surface of the bodies on one rank: exposed faces, sharp edges, and the nodes on either."""

from dataclasses import dataclass

import numpy as np

from ..mesh.faces import FACES
from ..mesh.faces import normals as face_normals
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, complete
from ..state import Flags, Indices, Ints, Model
from .records import Edges, Faces

SHARP = np.cos(np.radians(25.0))
"""Edges between faces whose initial normals differ by more than this can meet other edges."""
_FLAG_TAG = 10


@dataclass
class Surface:
    """What one rank has of it."""

    faces: Faces
    """Of this rank's tets."""
    edges: Edges
    """Whose face of smaller id is of this rank's tets."""
    flags: Flags
    """(nodes,) which nodes of this rank are on the surface, by a face of any rank."""
    far: Ints
    """(k,) ids of nodes of ``edges`` that this rank does not hold."""
    far_owner: Indices
    """(k,) their owners."""


def build(model: Model, exposed: Flags, planes: Flags, neighbours: list[Neighbour], comm: Comm, edges: bool) -> Surface:
    """The surface; all ranks take part.

    ``exposed`` (tets of all blocks, 4) says which faces have no tet behind them, ``planes`` (nodes, 3) which nodes lie
    on a symmetry plane across an axis: faces in such a plane are no surface.
    """
    nodes = model.nodes
    local, ids = _faces(model, exposed)
    mirrored = planes[local[:, :3]].all(axis=1).any(axis=1)
    local, ids = local[~mirrored], ids[~mirrored]
    faces = Faces(ids, nodes.id[local], np.sqrt(np.linalg.norm(face_normals(nodes.x0, local), axis=1)))
    order = np.argsort(ids)
    flags = _flags(local, nodes.n, neighbours, comm)
    sharp, far, owner = _sharp(model, local, ids, neighbours, comm) if edges else _none()
    return Surface(faces.take(order), sharp, flags, far, owner)


def _faces(model: Model, exposed: Flags) -> tuple["np.ndarray", Ints]:
    """(f, 4) local nodes of the exposed faces, the opposite one last, and their ids."""
    rows, ids, begin = [np.zeros((0, 4), np.int64)], [np.zeros(0, np.int64)], 0
    for block in model.blocks:
        tet, face = np.nonzero(exposed[begin : begin + block.n])
        begin += block.n
        corners = block.tets.astype(np.int64)[tet]
        around = corners[np.arange(len(tet))[:, None], FACES[face]]
        rows.append(np.column_stack([around, corners[np.arange(len(tet)), face]]))
        ids.append(4 * block.id[tet] + face)
    return np.concatenate(rows), np.concatenate(ids)


def _flags(faces: "np.ndarray", n: int, neighbours: list[Neighbour], comm: Comm) -> Flags:
    counts = np.zeros((n, 1), np.int64)
    counts[faces[:, :3]] = 1
    complete(comm, neighbours, counts, _FLAG_TAG)
    return np.asarray(counts[:, 0] > 0)


def _none() -> tuple[Edges, Ints, Indices]:
    return Edges(np.zeros((0, 4), np.int64), np.zeros(0)), np.zeros(0, np.int64), np.zeros(0, np.int32)


_LOW, _HIGH, _THIRD, _OWNER, _FACE, _TURNED, _LENGTH, _NORMAL = 0, 1, 2, 3, 4, 5, 6, 7
"""Columns of a half edge, an edge as one face sees it: its nodes, the third node of the face and its owner, the face,
whether the face runs from high to low, initial length, m, and the unit normal of the face; floats as their bits."""


def _sharp(
    model: Model, faces: "np.ndarray", ids: Ints, neighbours: list[Neighbour], comm: Comm
) -> tuple[Edges, Ints, Indices]:
    """Sharp edges, and the nodes of theirs that are not held here, with their owners.

    Where other ranks may hold faces of an edge, the owner of the lower node brings them together, and the rank of the
    face of smaller id has the edge.
    """
    nodes = model.nodes
    halves = _halves(model, faces, ids)
    shared = np.zeros(nodes.n, bool)
    shared[np.concatenate([np.zeros(0, np.int32), *(other.nodes for other in neighbours)])] = True
    ends = np.searchsorted(nodes.id, halves[:, :2])
    common = shared[ends].all(axis=1)
    here, home = _paired(halves[~common]), nodes.owner[ends[:, 0]]
    found = comm.swap({int(rank): halves[common & (home == rank)] for rank in np.unique(home[common])})
    gathered = np.concatenate([halves[:0], *(f.reshape(-1, 10) for f in found.values())])
    sender = np.concatenate([np.zeros(0, np.int64), *(np.full(len(f) // 10, r) for r, f in found.items())])
    met = _paired(gathered)
    order = np.argsort(gathered[:, _FACE])
    target = sender[order[np.searchsorted(gathered[order, _FACE], met[:, 6])]]
    back = comm.swap({int(rank): met[target == rank] for rank in np.unique(target)})
    rows = np.concatenate([here, *(f.reshape(-1, 8) for f in back.values())])
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
    ends, owners = rows[:, 2:4].reshape(-1), rows[:, 4:6].reshape(-1)
    far, first = np.unique(ends[~np.isin(ends, nodes.id)], return_index=True)
    owner = owners[~np.isin(ends, nodes.id)][first]
    return Edges(rows[:, :4].copy(), rows[:, 7].copy().view(np.float64)), far, owner.astype(np.int32)


def _halves(model: Model, faces: "np.ndarray", ids: Ints) -> Ints:
    """(3 f, 10) half edges of the faces."""
    nodes = model.nodes
    normals = face_normals(nodes.x0, faces)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    parts = []
    for k in range(3):
        a, b, c = (faces[:, (k + i) % 3] for i in range(3))
        turned = nodes.id[a] > nodes.id[b]
        low, high = np.where(turned, b, a), np.where(turned, a, b)
        length = np.linalg.norm(nodes.x0[b] - nodes.x0[a], axis=1)
        floats = np.column_stack([length, normals]).view(np.int64)
        parts.append(np.column_stack([nodes.id[low], nodes.id[high], nodes.id[c], nodes.owner[c], ids, turned, floats]))
    return np.concatenate(parts)


def _paired(halves: Ints) -> Ints:
    """Rows (a, b, c, d, owner of c, owner of d, smaller face, length) of sharp edges between two faces, not more."""
    halves = halves[np.lexsort((halves[:, _FACE], halves[:, _HIGH], halves[:, _LOW]))]
    same = (halves[1:, :2] == halves[:-1, :2]).all(axis=1)
    first = np.flatnonzero(same & ~np.r_[False, same[:-1]] & ~np.r_[same[1:], False]) if len(same) else np.zeros(0, int)
    one, two = halves[first], halves[first + 1]
    cosine = (one[:, _NORMAL:].copy().view(np.float64) * two[:, _NORMAL:].copy().view(np.float64)).sum(axis=1)
    kept = (cosine < SHARP) & (one[:, _TURNED] != two[:, _TURNED])
    one, two = one[kept], two[kept]
    ahead = (one[:, _TURNED] == 0)[:, None]
    ends = np.where(
        ahead, np.column_stack([one[:, _THIRD], two[:, _THIRD]]), np.column_stack([two[:, _THIRD], one[:, _THIRD]])
    )
    owners = np.where(
        ahead, np.column_stack([one[:, _OWNER], two[:, _OWNER]]), np.column_stack([two[:, _OWNER], one[:, _OWNER]])
    )
    return np.column_stack([one[:, :2], ends, owners, one[:, _FACE], one[:, _LENGTH]])
