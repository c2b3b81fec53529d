"""Edges between two faces of the surface. The module finds the edges and determines which of them are sharp. Only sharp
edges are in edge-edge contact.

A half edge is an edge of one face, (a, b) of the face abc. Two half edges of opposite direction between the same nodes
make an edge, except the two sides of one facet. An edge is sharp if its faces enclose an angle at the start. An edge
also becomes sharp if its faces enclose an angle and the edge is convex at a later check, because plastic flow makes
sharp edges. The check is made every normals.EVERY steps, or every PRESSED steps. Therefore sharpness does not depend on
the steps in which searches take place.
"""

import math

import numpy as np

from ...kernels.jit import njit, types
from ...materials.turning import sine_and_cosine
from ...model.ids import among
from ...model.state import Bits, Flags, Floats, Indices, Ints, Model
from ...parallel.arguments import reader
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour, ranks
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team
from ..geometry import at, cross, dot, minus
from ..narrow_phase.tables import DEEP, DEEP_SELF
from .half_edges import HalfEdges
from .records import Edges, Faces

SHARP = sine_and_cosine(math.radians(25.0))[1]
"""Cosine of the smallest angle between the normals of the two faces of a sharp edge. Chosen value."""
BENT, PRESSED = sine_and_cosine(math.radians(5.0))[1], 4
"""Two values for parts that are pressed together beyond their strength (cases/estimates/impact.py): cosine of the
smallest angle of a sharp edge, and number of steps between two checks. The angle is smaller for parts pressed together
beyond their strength than for other parts, because ridges of initially flat surfaces may cross without a node inside of
the other body, and contact exerts no pressure on overlapping material. Chosen values, by tests of flyer plates of
copper at 1 to 2.4 km/s (docs/theory/contact.md, "Ridges under pressure")."""

_A, _B, _C, _D, _OWNER, _TOP, _FACE, _OPEN, _LENGTH, _LOW, _NORMAL = range(11)
"""Columns of a half edge that is sent to another rank: its two nodes; the third node of its face and the opposite node
of the tet; the owners of these two nodes; the face, its state, its initial length, m, and the smallest initial height
of its tet, m; and the unit normal of the face. Floats are sent as bit patterns."""
_EDGES = 1024
"""Number of edges in a task; chosen value: a task takes some 30 us, compared with 2 us to start a parallel region."""
_I1, _I2, _U1, _U2, _N2, _F1, _F2 = (
    types.int64[::1], types.int64[:, ::1], types.uint8[::1], types.uint8[:, ::1], types.int32[:, ::1],
    types.float64[::1], types.float64[:, ::1],
)  # fmt: skip
_FILL = _I2, _I2, _F1, _F1, _U2, _N2, _N2, _I2, _I1, _U1, _F2, _F1
_B1 = types.boolean[::1]
TURNED = _B1, _B1, _N2, _B1, _F2, types.int32[::1], _F1
_read_fill = reader(*_FILL)
_HALF, _ROW = 13, 17
"""Number of columns of a half edge; and number of columns of an edge (``_matched``)."""


def none() -> tuple[Edges, Ints, Indices]:
    """Returns the result of ``find`` for a surface without edges."""
    nothing = np.zeros((0, 6), np.int64)
    lengths = np.zeros(0), np.zeros(0)
    edges = Edges(nothing, nothing[:, :2], *lengths, np.zeros((0, 2), np.uint8), np.zeros(0, bool))
    return edges, np.zeros(0, np.int64), np.zeros(0, np.int32)


class EdgeFinder:
    """Passes over faces and edges that find the edges, run by the threads of a team."""

    def __init__(self, team: Team) -> None:
        self._halves, self._fill = HalfEdges(team), Pass(team, _fill, *_FILL, size=_EDGES)

    def find(
        self, model: Model, faces: Faces, local: Indices, units: Floats, heights: Floats, some: Flags, opened: Bits,
        neighbours: list[Neighbour], comm: Comm,
    ) -> tuple[Edges, Ints, Indices]:  # fmt: skip
        """Returns the edges, sorted by the ids of their faces. Returns also ids and owners of those nodes of the edges
        that this rank does not have.

        ``some`` (f,): faces whose edges are wanted; ``local`` (f, 4): local nodes of the faces; ``units`` (f, 3): unit
        normals; ``heights`` (f,): lowest heights of their tets, m; ``opened`` (f,): see Edges. If other ranks may have
        faces of an edge, the owner of the lower node of the edge matches the faces, and the rank with the face of
        smaller id gets the edge.
        """
        half = np.repeat(some[:, None], 3, axis=1)
        away = half & _common(local, model.nodes.n, neighbours) if neighbours else np.zeros_like(half)
        pairs = self._halves.pairs(local, half & ~away, units, model.nodes.n, SHARP)
        n = len(pairs)
        nodes, sides, either = np.empty((n, 6), np.int64), np.empty((n, 2), np.int64), np.empty((n, 2), np.uint8)
        size, low = np.empty((2, n))
        self._fill.run(
            n, nodes, sides, size, low, either, pairs, local, faces.nodes, faces.id, opened, model.nodes.x0, heights
        )
        edges = Edges(nodes, sides, size, depths(size, low), either, pairs[:, 4] > 0)
        if comm.size == 1:
            return edges, *none()[1:]
        rows = _elsewhere(model, faces, local, units, heights, away, opened, comm, self._halves)
        size, low = np.ascontiguousarray(rows[:, 12:14].T).view(np.float64)
        states, is_sharp = rows[:, 14:16].astype(np.uint8), rows[:, 16] > 0
        edges = Edges.joined([edges, Edges(rows[:, :6], rows[:, 10:12], size, depths(size, low), states, is_sharp)])
        ends, owners = rows[:, 2:6].reshape(-1), rows[:, 6:10].reshape(-1)
        absent = ~among(model.nodes.id, ends)
        missing, first = np.unique(ends[absent], return_index=True)
        edges = edges.take(np.lexsort((edges.sides[:, 1], edges.sides[:, 0])))
        return edges, missing, owners[absent][first].astype(np.int32)


def depths(size: Floats, low: Floats) -> Floats:
    """(e,) greatest depth of a contact of edges, m. ``size``: initial length of each edge; ``low``: initial height of
    its tets."""
    return np.maximum(DEEP * np.minimum(size, low), DEEP_SELF * size)


def _common(local: Indices, n: int, neighbours: list[Neighbour]) -> Flags:
    """(f, 3) True for each half edge if other ranks have both of its nodes, too; ``n``: number of local nodes."""
    shared = np.zeros(n, bool)
    for other in neighbours:
        shared[other.nodes] = True
    a, b = shared[local[:, :3]], shared[local[:, [1, 2, 0]]]
    return np.asarray(a & b)


def _elsewhere(
    model: Model, faces: Faces, local: Indices, units: Floats, heights: Floats, away: Flags, opened: Bits, comm: Comm,
    matching: HalfEdges,
) -> Ints:  # fmt: skip
    """Rows (``_matched``) of this rank's edges among the half edges ``away`` (f, 3). ``heights`` (f,): lowest heights
    of the tets of the faces, m. Collective.
    """
    nodes, (f, k) = model.nodes, np.nonzero(away)
    a, b, c, d = (*(local[f, (k + i) % 3] for i in range(3)), local[f, 3])
    floats = np.column_stack([np.linalg.norm(nodes.x0[b] - nodes.x0[a], axis=1), heights[f], units[f]]).view(np.int64)
    known = *(nodes.id[some] for some in (a, b, c, d)), nodes.owner[c], nodes.owner[d], faces.id[f], opened[f]
    halves, home = np.column_stack([*known, floats]), nodes.owner[np.minimum(a, b)]
    found = comm.swap({rank: halves[home == rank] for rank in ranks(home)})
    gathered = np.concatenate([halves[:0], *(words.reshape(-1, _HALF) for words in found.values())])
    sender = np.repeat(np.array(list(found), np.int64), [len(words) // _HALF for words in found.values()])
    rows, target = _matched(gathered, sender, matching)
    back = comm.swap({rank: rows[target == rank] for rank in ranks(target)})
    return np.concatenate([rows[:0], *(words.reshape(-1, _ROW) for words in back.values())])


def _matched(halves: Ints, sender: Ints, matching: HalfEdges) -> tuple[Ints, Ints]:
    """Rows of the edges that are made of the half edges ``halves``, and the sender of the first face of each edge. The
    columns are: nodes (records.Edges), owners of the last four nodes, face abc, face bad, length, lowest height of each
    tet, states of each face, sharpness.
    """
    order = np.argsort(halves[:, _FACE], kind="stable")
    halves, sender = halves[order], sender[order]
    ids, corners = np.unique(halves[:, : _C + 1], return_inverse=True)
    half = np.zeros((len(halves), 3), bool)
    half[:, 0] = True
    units = np.ascontiguousarray(halves[:, _NORMAL:]).view(np.float64)
    pairs = matching.pairs(corners.reshape(-1, 3).astype(np.int32), half, units, len(ids), SHARP)
    one, two = halves[pairs[:, 0]], halves[pairs[:, 2]]
    others = (np.column_stack([one[:, k], two[:, k]]) for k in (_C, _D, _OWNER, _TOP, _FACE))
    opened = np.column_stack([one[:, _OPEN], two[:, _OPEN]])
    low = np.minimum(one[:, _LOW], two[:, _LOW])
    rows = np.column_stack([one[:, [_A, _B]], *others, one[:, _LENGTH], low, opened, pairs[:, 4]])
    return rows, sender[pairs[:, 0]]


@njit(TASK, cache=True)
def _fill(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: writes the columns of the edges ``pairs``. ``low`` becomes the lower of the ``heights`` (f,) of the tets of
    an edge.
    """
    nodes, sides, size, low, opened, pairs, local, face_nodes, face_id, face_opened, x, heights = _read_fill(table)
    for p in range(first, stop):
        f, k, g, m = pairs[p, 0], pairs[p, 1], pairs[p, 2], pairs[p, 3]
        for i in range(3):
            nodes[p, i] = face_nodes[f, (k + i) % 3]
        nodes[p, 3], nodes[p, 4], nodes[p, 5] = face_nodes[g, (m + 2) % 3], face_nodes[f, 3], face_nodes[g, 3]
        sides[p, 0], sides[p, 1] = face_id[f], face_id[g]
        opened[p, 0], opened[p, 1] = face_opened[f], face_opened[g]
        a, b = local[f, k], local[f, (k + 1) % 3]
        dx, dy, dz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        size[p], low[p] = np.sqrt(dx * dx + dy * dy + dz * dz), min(heights[f], heights[g])


@njit(types.void(*TURNED, types.int64, types.int64), cache=True)
def turned(found, sharp, corners, meets, x, part, least, first, stop):  # type: ignore[no-untyped-def]
    """Sets ``found`` (e,) for edges from ``first`` to ``stop`` that become sharp. An edge becomes sharp under these
    conditions: its two faces allow contact (``meets``), it is not ``sharp`` yet, it is convex at the positions ``x``
    (slots, 3), m, and the cosine between the normals of its faces is below ``least`` (parts,). ``part`` (slots,): part
    of each slot; ``corners`` (e, 6): see records.Edges.
    """
    for e in range(first, stop):
        found[e] = False
        a, b = corners[e, 0], corners[e, 1]
        if sharp[e] or a == b or not meets[e]:
            continue
        o = at(x, a)
        u, to, fro = minus(at(x, b), o), minus(at(x, corners[e, 2]), o), minus(at(x, corners[e, 3]), o)
        one, two = cross(u, to), cross(fro, u)
        cosine = dot(one, two) / np.sqrt(dot(one, one) * dot(two, two))
        found[e] = dot(one, fro) < 0.0 and cosine < least[part[a]]
