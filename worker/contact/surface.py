"""The surface of the bodies on one rank: exposed faces, sharp edges, and the nodes on either."""

from dataclasses import dataclass

import numpy as np

from ..mesh.faces import FACES
from ..mesh.faces import normals as face_normals
from ..migration.parcel import Table
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, complete
from ..state import Flags, Indices, Ints, Model, Nodes
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
    """(nodes,) which nodes of this rank are on the surface, by a face of any rank; or were, and have lost it."""
    far: Ints
    """(k,) ids of nodes of ``edges`` that this rank does not hold."""
    far_owner: Indices
    """(k,) their owners."""


def build(model: Model, planes: Flags, neighbours: list[Neighbour], comm: Comm, edges: bool) -> Surface:
    """The surface; all ranks take part.

    ``planes`` (nodes, planes) says which nodes lie on which symmetry plane. A face with all three nodes on the same
    plane is no surface; a face of a body one tet thick, with nodes on two parallel planes, is part of it.
    """
    local, ids = _faces(model, planes)
    flags = _flags(local, model.nodes.n, neighbours, comm)
    sharp = _sharp(model, local, ids, neighbours, comm) if edges else _none()
    return Surface(_table(model, local, ids), sharp[0], flags, *sharp[1:])


def uncovered(
    old: Surface, gone: Ints, loose: Flags, removed: Flags, model: Model, planes: Flags,
    neighbours: list[Neighbour], comm: Comm,
) -> Surface:  # fmt: skip
    """The surface after tets have left the blocks; all ranks take part.

    ``gone``: ids of theirs, of this rank and its neighbours; ``loose`` (nodes,) nodes without tets that fly on,
    ``removed`` those that have left. An edge goes with either of its faces. Of what is laid bare, nodes meet faces; its
    edges meet no edges: they would be as many as its faces, and all of them sharp.
    """
    local, ids = _faces(model, planes)
    flags = (old.flags | loose | _flags(local, model.nodes.n, neighbours, comm)) & ~removed
    kept = ~np.asarray(np.isin(old.edges.sides // 4, gone).any(axis=1))
    return Surface(_table(model, local, ids), old.edges.take(kept), flags, old.far, old.far_owner)


def with_edges(found: Surface, edges: Table, nodes: Nodes) -> Surface:
    """The surface with the edges of a table, ``owners`` of their nodes included."""
    ends, owners = edges["ends"].reshape(-1), edges["owners"].reshape(-1)
    elsewhere = nodes.places(ends) < 0
    far, first = np.unique(ends[elsewhere], return_index=True)
    return Surface(
        found.faces, Edges(edges["ends"], edges["sides"], edges["size"]), found.flags, far,
        owners[elsewhere][first].astype(np.int32),
    )  # fmt: skip


def _table(model: Model, local: "np.ndarray", ids: Ints) -> Faces:
    nodes = model.nodes
    faces = Faces(ids, nodes.id[local], np.sqrt(np.linalg.norm(face_normals(nodes.x0, local), axis=1)))
    return faces.take(np.argsort(ids))


def _faces(model: Model, planes: Flags) -> tuple["np.ndarray", Ints]:
    """(f, 4) local nodes of the exposed faces, the opposite one last, and their ids."""
    rows, ids = [np.zeros((0, 4), np.int64)], [np.zeros(0, np.int64)]
    for block in model.blocks:
        tet, face = np.nonzero(block.exposed())
        corners = block.tets.astype(np.int64)[tet]
        around = corners[np.arange(len(tet))[:, None], FACES[face]]
        rows.append(np.column_stack([around, corners[np.arange(len(tet)), face]]))
        ids.append(4 * block.id[tet] + face)
    local: np.ndarray = np.concatenate(rows)
    number = np.concatenate(ids)
    mirrored = planes[local[:, :3]].all(axis=1).any(axis=1)
    return local[~mirrored], number[~mirrored]


def _flags(faces: "np.ndarray", n: int, neighbours: list[Neighbour], comm: Comm) -> Flags:
    counts = np.zeros((n, 1), np.int64)
    counts[faces[:, :3]] = 1
    complete(comm, neighbours, counts, _FLAG_TAG)
    return np.asarray(counts[:, 0] > 0)


def _none() -> tuple[Edges, Ints, Indices]:
    none = np.zeros((0, 4), np.int64)
    return Edges(none, none[:, :2], np.zeros(0)), np.zeros(0, np.int64), np.zeros(0, np.int32)


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
    halves, ends = _halves(model, faces, ids)
    shared = np.zeros(nodes.n, bool)
    shared[np.concatenate([np.zeros(0, np.int32), *(other.nodes for other in neighbours)])] = True
    common = shared[ends[:, 0]] & shared[ends[:, 1]]
    here, home = _paired(halves[~common]), nodes.owner[ends[:, 0]]
    found = comm.swap({int(rank): halves[common & (home == rank)] for rank in np.unique(home[common])})
    gathered = np.concatenate([halves[:0], *(f.reshape(-1, 10) for f in found.values())])
    sender = np.concatenate([np.zeros(0, np.int64), *(np.full(len(f) // 10, r) for r, f in found.items())])
    met = _paired(gathered)
    order = np.argsort(gathered[:, _FACE])
    target = sender[order[np.searchsorted(gathered[order, _FACE], met[:, 6:8].min(axis=1))]]
    back = comm.swap({int(rank): met[target == rank] for rank in np.unique(target)})
    rows = np.concatenate([here, *(f.reshape(-1, 9) for f in back.values())])
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
    ends, owners = rows[:, 2:4].reshape(-1), rows[:, 4:6].reshape(-1)
    far, first = np.unique(ends[~np.isin(ends, nodes.id)], return_index=True)
    owner = owners[~np.isin(ends, nodes.id)][first]
    edges = Edges(rows[:, :4].copy(), rows[:, 6:8].copy(), rows[:, 8].copy().view(np.float64))
    return edges, far, owner.astype(np.int32)


def _halves(model: Model, faces: "np.ndarray", ids: Ints) -> tuple[Ints, Ints]:
    """(3 f, 10) half edges of the faces, and (3 f, 2) the local nodes of each."""
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
        parts.append(np.column_stack([nodes.id[low], nodes.id[high], nodes.id[c], nodes.owner[c], ids, turned, floats]))
    return np.concatenate(parts), np.concatenate(ends)


def _paired(halves: Ints) -> Ints:
    """Rows (a, b, c, d, owner of c, owner of d, face abc, face bad, length) of sharp edges of two faces."""
    order = np.lexsort((halves[:, _FACE], halves[:, _HIGH], halves[:, _LOW]))
    low, high = halves[order, _LOW], halves[order, _HIGH]
    same = (low[1:] == low[:-1]) & (high[1:] == high[:-1])
    first = np.flatnonzero(same & ~np.r_[False, same[:-1]] & ~np.r_[same[1:], False]) if len(same) else np.zeros(0, int)
    one, two = halves[order[first]], halves[order[first + 1]]
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
    sides = np.where(
        ahead, np.column_stack([one[:, _FACE], two[:, _FACE]]), np.column_stack([two[:, _FACE], one[:, _FACE]])
    )
    return np.column_stack([one[:, :2], ends, owners, sides, one[:, _LENGTH]])
