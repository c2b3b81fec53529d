"""Surface of the bodies on one rank: exposed faces, their edges and nodes."""

from dataclasses import dataclass, field

import numpy as np

from ...kernels.jit import njit
from ...mesh.faces import FACES
from ...model.ids import among
from ...model.state import LAID_BARE, WIDE, Bits, Flags, Indices, Ints, Model
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour, complete
from ...parallel.tags import Tag
from . import sharp
from .records import CrackSides, Edges, Faces

_UNSEEN, _COVERED, _YOUNG, _AGED, _EXPOSED, _BARE = range(6)
"""Numbers of the kinds of faces: not on the surface; exposed if a tet erodes; side of a crack that may open, without
or with edge-edge contact; exposed; exposed by erosion."""


@dataclass
class Surface:
    """Surface on one rank."""

    faces: Faces
    """Faces of this rank's tets."""
    edges: Edges
    """Edges whose face of smaller id is of this rank's tets, sharp or not."""
    flags: Flags
    """(nodes,) local nodes that are or have been on the surface, by a face of any rank."""
    waiting: Flags
    """(nodes,) local nodes of faces of any rank that may become surface before the next search."""
    far: Ints
    """(k,) ids of nodes of ``edges`` that this rank does not hold."""
    far_owner: Indices
    """(k,) owners of the nodes of ``edges`` that this rank does not hold."""
    turned: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """(t,) names of the ``edges`` that became sharp during the run, ascending."""

    def sharpen(self, names: Ints) -> None:
        """Marks the edges with these ``names``, ascending, as sharp."""
        if len(names):
            own = self.edges.names
            self.turned, self.edges.sharp[among(names, own)] = np.intersect1d(own, names), True


def build(
    model: Model,
    planes: Flags,
    neighbours: list[Neighbour],
    comm: Comm,
    edges: bool,
    cracks: CrackSides,
    covered: Indices,
) -> Surface:
    """Builds the surface. Collective.

    ``planes`` (nodes, planes): membership of nodes in symmetry planes. A face with all three nodes on one plane is not
    on the surface; a face of a body one tet thick, with nodes on two parallel planes, is. ``cracks``: sides that may
    open before the next search; ``covered`` (m, 3): block, row and face of faces that erosion may expose. Faces exposed
    by erosion are in contact with nodes; the edges of such faces are not in edge-edge contact, because nearly all of
    them would be sharp.
    """
    local, ids, kind = _faces(model, planes, cracks, covered)
    nodes, n = model.nodes, len(ids)
    units, counts = np.empty((n, 3)), np.zeros((nodes.n, 2), np.int64)
    faces = Faces(ids, np.empty((n, 4), np.int64), np.empty(n), kind >= _EXPOSED)
    _measure(faces.nodes, faces.size, units, counts, local, faces.exposed, nodes.id, nodes.x0)
    complete(comm, neighbours, counts, Tag.SURFACE)
    some = ((kind == _YOUNG) | (kind == _AGED) | (kind == _EXPOSED)) & edges
    opened = (kind >= _AGED).astype(np.uint8) + faces.exposed
    found = sharp.find(model, faces, local, units, some, opened, neighbours, comm) if edges else sharp.none()
    return Surface(faces, found[0], counts[:, 0] > 0, counts[:, 1] > 0, *found[1:])


def _faces(model: Model, planes: Flags, cracks: CrackSides, covered: Indices) -> tuple[Indices, Ints, Bits]:
    """(f, 4) local nodes of the exposed faces, the sides of ``cracks`` and the ``covered`` faces, the opposite node
    last; their ids, ascending; and their kinds.
    """
    kinds, counts = [np.zeros((block.n, 4), np.uint8) for block in model.blocks], []
    for b, (block, kind) in enumerate(zip(model.blocks, kinds, strict=True)):
        for sides, what in ((covered, _COVERED), (cracks.young, _YOUNG), (cracks.aged, _AGED)):
            some = sides[sides[:, 0] == b]
            kind[some[:, 1], some[:, 2]] = what
        counts.append(_sort_out(kind, block.tets, block.across, block.bond, planes))
    begin = np.cumsum([0, *counts])
    local, ids, kept = np.empty((begin[-1], 4), np.int32), np.empty(begin[-1], np.int64), np.empty(begin[-1], np.uint8)
    for block, kind, b, e in zip(model.blocks, kinds, begin, begin[1:], strict=False):
        _list(local[b:e], ids[b:e], kept[b:e], kind, block.tets, block.id)
    order = np.argsort(ids)
    return local.take(order, axis=0), ids[order], kept[order]


@njit("int64(uint8[:, ::1], uint32[:, ::1], int32[:, ::1], uint8[:, ::1], boolean[:, ::1])", cache=True)
def _sort_out(kind, tets, across, bond, planes):  # type: ignore[no-untyped-def]
    """Completes the kinds ``kind`` (n, 4) of the faces of a block, which marks the faces that may become surface on
    entry; returns the number of faces that are on the surface or may be.
    """
    n = 0
    for e in range(len(tets)):
        for k in range(4):
            if across[e, k] == LAID_BARE:
                kind[e, k] = _BARE
            elif across[e, k] < 0 or (len(bond) > 0 and bond[e, k] == WIDE):
                kind[e, k] = _EXPOSED
            if kind[e, k] == _UNSEEN:
                continue
            a, b, c = tets[e, FACES[k, 0]], tets[e, FACES[k, 1]], tets[e, FACES[k, 2]]
            for i in range(planes.shape[1]):
                if planes[a, i] and planes[b, i] and planes[c, i]:
                    kind[e, k] = _UNSEEN
            n += kind[e, k] != _UNSEEN
    return n


@njit("void(int32[:, ::1], int64[::1], uint8[::1], uint8[:, ::1], uint32[:, ::1], int64[::1])", cache=True)
def _list(local, ids, kept, kind, tets, tet_id):  # type: ignore[no-untyped-def]
    """Lists the faces of a block that are on the surface or may be."""
    n = 0
    for e in range(len(tets)):
        for k in range(4):
            if kind[e, k] == _UNSEEN:
                continue
            for i in range(3):
                local[n, i] = tets[e, FACES[k, i]]
            local[n, 3], ids[n], kept[n] = tets[e, k], 4 * tet_id[e] + k, kind[e, k]
            n += 1


@njit(
    "void(int64[:, ::1], float64[::1], float64[:, ::1], int64[:, ::1], int32[:, ::1], boolean[::1], int64[::1], "
    "float64[:, ::1])",
    cache=True,
    error_model="numpy",
)
def _measure(nodes, size, units, counts, local, exposed, ids, x):  # type: ignore[no-untyped-def]
    """Computes the global ``nodes`` (f, 4), sizes, m, and unit normals (f, 3) of faces with the ``local`` nodes, and
    sets ``counts`` (nodes, 2) to one for the nodes of ``exposed`` faces, and of others.
    """
    e, g = np.empty(3), np.empty(3)
    for f in range(len(local)):
        a, b, c = local[f, 0], local[f, 1], local[f, 2]
        for i in range(3):
            e[i], g[i] = x[b, i] - x[a, i], x[c, i] - x[a, i]
        nx, ny, nz = e[1] * g[2] - e[2] * g[1], e[2] * g[0] - e[0] * g[2], e[0] * g[1] - e[1] * g[0]
        twice = np.sqrt(nx * nx + ny * ny + nz * nz)
        size[f] = np.sqrt(twice)
        units[f, 0], units[f, 1], units[f, 2] = nx / twice, ny / twice, nz / twice
        for i in range(4):
            nodes[f, i] = ids[local[f, i]]
        for i in range(3):
            counts[local[f, i], 0 if exposed[f] else 1] = 1
