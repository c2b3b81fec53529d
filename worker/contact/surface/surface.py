"""Surface of the bodies on one rank: exposed faces, their edges and nodes."""

from dataclasses import dataclass, field

import numpy as np

from ...kernels.jit import njit, types
from ...mesh.faces import FACES
from ...model.ids import places
from ...model.state import LAID_BARE, WIDE, Bits, Flags, Indices, Ints, Model
from ...parallel.arguments import reader
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour, complete
from ...parallel.packing import offsets
from ...parallel.passes import Pass
from ...parallel.tags import Tag
from ...parallel.team import TASK, Team
from ..geometry import lowest_height
from . import sharp
from .records import CrackSides, Edges, Faces, names_of
from .sharp import EdgeFinder

_UNSEEN, _COVERED, _YOUNG, _AGED, _EXPOSED, _BARE = range(6)
"""Numbers of the kinds of faces, in this order: not on the surface; exposed if a tet erodes; side of a crack that may
open, without edge-edge contact; the same with edge-edge contact; exposed; exposed by erosion."""

_TETS, _FACES = 8192, 1024
"""Number of tets in a task, and number of faces in a task. Chosen values: a task takes 10 to 50 us, compared with 2 us
to start a parallel region."""
_U1, _U2, _I1, _I2, _N2, _T2, _F1, _F2, _B1 = (
    types.uint8[::1], types.uint8[:, ::1], types.int64[::1], types.int64[:, ::1], types.int32[:, ::1],
    types.uint32[:, ::1], types.float64[::1], types.float64[:, ::1], types.boolean[::1],
)  # fmt: skip
_SORT = _U2, _I1, _T2, _N2, _U2, types.boolean[:, ::1]
_LIST = _N2, _I1, _U1, _U2, _T2, _I1, _I1
_MEASURE = _I2, _F1, _F2, _F1, _I2, _N2, _B1, _I1, _F2
_read_sort, _read_list, _read_measure = reader(*_SORT), reader(*_LIST), reader(*_MEASURE)


@dataclass
class Surface:
    """Surface of the bodies on one rank."""

    faces: Faces
    """Faces of the tets of this rank."""
    edges: Edges
    """Edges whose face of smaller id belongs to a tet of this rank. Edges that are not sharp are included."""
    flags: Flags
    """(nodes,) True for each local node that is or has been on the surface, by a face of any rank."""
    waiting: Flags
    """(nodes,) True for each local node of a face, of any rank, that may become surface before the next search."""
    far: Ints
    """(k,) ids of those nodes of ``edges`` that this rank does not have."""
    far_owner: Indices
    """(k,) owners of those nodes of ``edges`` that this rank does not have."""
    corners: Indices
    """(f, 4) local nodes of ``faces``; they have the numbers from the time when the surface was built."""
    turned: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """(t,) names, ascending, of the ``edges`` that have become sharp during the run; a name is a number that identifies
    an edge."""

    def sharpen(self, names: Ints) -> None:
        """Marks the edges with the ``names``, which are ascending, as edges that have become sharp. Names of edges that
        are not on this surface are omitted.
        """
        if len(names):
            at = places(self.edges.names, names)
            self.edges.sharp[at[at >= 0]], self.turned = True, names[at >= 0]

    def sharpen_at(self, rows: Ints) -> None:
        """Adds the edges ``rows`` to the edges that have become sharp."""
        self.edges.sharp[rows] = True
        self.turned = np.union1d(self.turned, names_of(self.edges.sides[rows]))


class SurfaceBuilder:
    """Passes over tets, faces and edges that build the surface, run by the threads of a team."""

    def __init__(self, team: Team) -> None:
        self._sort_out, self._list = Pass(team, _sort_out, *_SORT, size=_TETS), Pass(team, _list, *_LIST, size=_TETS)
        self._measure, self._edges = Pass(team, _measure, *_MEASURE, size=_FACES), EdgeFinder(team)

    def build(
        self,
        model: Model,
        planes: Flags,
        neighbours: list[Neighbour],
        comm: Comm,
        edges: bool,
        cracks: CrackSides,
        covered: Indices,
    ) -> Surface:
        """Builds the surface. Collective.

        ``planes`` (nodes, planes): whether each node is on each symmetry plane. A face with all three nodes on one
        plane is not on the surface. A face of a body that is one tet thick, with nodes on two parallel planes, is on
        the surface. ``cracks``: sides that may open before the next search; ``covered`` (m, 3): block, row and face of
        faces that erosion may expose. Faces exposed by erosion are in contact with nodes; the edges of such faces are
        not in edge-edge contact, because nearly all of them would be sharp.
        """
        local, ids, kind = self._faces(model, planes, cracks, covered)
        nodes, n = model.nodes, len(ids)
        units, heights, counts = np.empty((n, 3)), np.empty(n), np.zeros((nodes.n, 2), np.int64)
        faces = Faces(ids, np.empty((n, 4), np.int64), np.empty(n), kind >= _EXPOSED)
        self._measure.run(n, faces.nodes, faces.size, units, heights, counts, local, faces.exposed, nodes.id, nodes.x0)
        complete(comm, neighbours, counts, Tag.SURFACE)
        some = ((kind == _YOUNG) | (kind == _AGED) | (kind == _EXPOSED)) & edges
        opened = (kind >= _AGED).astype(np.uint8) + faces.exposed
        of = model, faces, local, units, heights, some, opened, neighbours, comm
        found = self._edges.find(*of) if edges else sharp.none()
        return Surface(faces, found[0], counts[:, 0] > 0, counts[:, 1] > 0, *found[1:], local)

    def _faces(self, model: Model, planes: Flags, cracks: CrackSides, covered: Indices) -> tuple[Indices, Ints, Bits]:
        """Returns three arrays over the exposed faces, the sides of ``cracks`` and the ``covered`` faces: (f, 4) local
        nodes of each face, the opposite node last; its id, ascending; and its kind.
        """
        marked, begin = [], 0
        for b, block in enumerate(model.blocks):
            kind = np.zeros((block.n, 4), np.uint8)
            for sides, what in ((covered, _COVERED), (cracks.young, _YOUNG), (cracks.aged, _AGED)):
                some = sides[sides[:, 0] == b]
                kind[some[:, 1], some[:, 2]] = what
            begins, counts = np.empty((2, self._list.many(block.n)), np.int64)
            self._sort_out.run(block.n, kind, counts, block.tets, block.across, block.bond, planes)
            end = begin + int(offsets(begins, counts))
            marked.append((block, kind, begin + begins))
            begin = end
        local, ids, kept = np.empty((begin, 4), np.int32), np.empty(begin, np.int64), np.empty(begin, np.uint8)
        for block, kind, begins in marked:
            self._list.run(block.n, local, ids, kept, kind, block.tets, block.id, begins)
        if (ids[1:] > ids[:-1]).all():
            return local, ids, kept
        order = np.argsort(ids)
        return local.take(order, axis=0), ids[order], kept[order]


@njit(TASK, cache=True)
def _sort_out(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: completes the kinds ``kind`` (n, 4) of the faces of some tets. On entry ``kind`` marks the faces that may
    become surface. Counts the faces that are on the surface or may become surface.
    """
    kind, counts, tets, across, bond, planes = _read_sort(table)
    n = 0
    for e in range(first, stop):
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
    counts[first // _TETS] = n


@njit(TASK, cache=True)
def _list(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: lists the faces of some tets that are on the surface or may become surface."""
    local, ids, kept, kind, tets, tet_id, begins = _read_list(table)
    n = begins[first // _TETS]
    for e in range(first, stop):
        for k in range(4):
            if kind[e, k] == _UNSEEN:
                continue
            for i in range(3):
                local[n, i] = tets[e, FACES[k, i]]
            local[n, 3], ids[n], kept[n] = tets[e, k], 4 * tet_id[e] + k, kind[e, k]
            n += 1


@njit(TASK, cache=True, error_model="numpy")
def _measure(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: computes properties of faces with the ``local`` nodes: global ``nodes`` (f, 4), sizes, m, unit normals (f,
    3), and lowest heights of the tets, m. Sets ``counts`` (nodes, 2) to one: in the first column for nodes of
    ``exposed`` faces, in the second column for nodes of other faces.
    """
    nodes, size, units, heights, counts, local, exposed, ids, x = _read_measure(table)
    for f in range(first, stop):
        a, b, c = local[f, 0], local[f, 1], local[f, 2]
        ex, ey, ez = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        gx, gy, gz = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
        nx, ny, nz = ey * gz - ez * gy, ez * gx - ex * gz, ex * gy - ey * gx
        twice = np.sqrt(nx * nx + ny * ny + nz * nz)
        size[f], heights[f] = np.sqrt(twice), lowest_height(x, a, b, c, local[f, 3])
        units[f, 0], units[f, 1], units[f, 2] = nx / twice, ny / twice, nz / twice
        for i in range(4):
            nodes[f, i] = ids[local[f, i]]
        for i in range(3):
            counts[local[f, i], 0 if exposed[f] else 1] = 1
