"""A search: who may meet until the next one, the ghosts that are needed for it, and the room to work in."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..jit import njit
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum, same
from ..parallel.tags import Tag
from ..state import Flags, Floats, Indices, Ints, Nodes, among
from . import domain, ghosts, meetings, search, sift
from .cracks import named
from .ghosts import Copies
from .meetings import DEEP, DEEP_SELF, Meetings
from .records import Crowd, Edges, Faces, merged
from .rest import Rest
from .search import Boxes, Things


@dataclass(frozen=True)
class Rules:
    """How to search; equal on all ranks."""

    domain: str
    allowed: Flags
    """(parts, parts) which parts meet."""
    cell: float
    """Edge of a cell of the contact domain, m."""
    breaking: Flags
    """(parts,) whose nodes separate: what a copy may meet must be known before."""


@dataclass
class Sides:
    """A share of the surface, with its nodes."""

    faces: Faces
    """By ascending id."""
    edges: Edges
    crowd: Crowd
    """Every node of the faces and edges, and every node of the surface that is held here."""
    slaves: Ints
    """Ids of the owned nodes of the surface, and of cracks that may open."""
    skin: float
    """m."""

    @cached_property
    def nodes(self) -> Things:
        """The slaves, to be searched."""
        return Things(self.crowd.places(self.slaves[:, None]), np.full(len(self.slaves), 0.5 * self.skin))

    @cached_property
    def face_places(self) -> Indices:
        """(f, 4)."""
        return self.crowd.places(self.faces.nodes)

    def face_things(self, deep: float) -> Things:
        """The faces, to be searched by nodes; ``deep``: of their size, how far below."""
        return Things(np.ascontiguousarray(self.face_places[:, :3]), 0.5 * self.skin + deep * self.faces.size)

    @cached_property
    def edge_places(self) -> Indices:
        """(e, 4)."""
        return self.crowd.places(self.edges.nodes)

    @cached_property
    def edge_things(self) -> Things:
        """The edges, to be searched."""
        places = np.ascontiguousarray(self.edge_places[:, :2])
        return Things(places, 0.5 * self.skin + 0.5 * DEEP_SELF * self.edges.size)


@dataclass
class Scene:
    """What a search left."""

    crowd: Crowd
    held: Indices
    """(h,) places of the nodes that this rank holds."""
    local: Indices
    """(h,) their indices on this rank."""
    faces: Indices
    """(f, 4) places."""
    face_id: Ints
    """(f,) ascending."""
    face_size: Floats
    face_exposed: Flags
    """(f,) only exposed faces are met."""
    edges: Indices
    """(e, 4) places."""
    edge_sides: Ints
    """(e, 2) ids of their faces."""
    edge_size: Floats
    edge_exposed: Flags
    """(e, 2) whether either face is; only edges between exposed faces are met."""
    edge_own: Flags
    """(e,) whose face of smaller id is of this rank."""
    meets_itself: Flags
    """(parts,) whose surface meets itself."""
    slave: Flags
    """(crowd,) the nodes whose meetings with faces this rank computes."""
    on_surface: Flags
    """(crowd,) of nodes that are held here: only those on the surface meet faces."""
    first: Indices
    """(crowd,) the first candidate of each node with a face, -1 for none; ``next`` (p,) the one after each."""
    next: Indices
    node_face: Indices
    """(p, 2) place of a node, index of a face."""
    edge_edge: Indices
    """(q, 2) indices of edges."""
    keys: Ints
    """(p, 2) ids of the node and of the face of each candidate, ascending."""
    kept: Floats
    """(p, 4) its ``push`` of the last step, zero where it did not meet."""
    faces_sent: int
    room: Meetings
    diagonal: Floats
    push: Floats
    shares: Ints
    impulse: Ints
    total: Ints
    """(crowd, 3) impulses of the last step, quanta."""
    normals: Floats
    """(crowd, 9) mean normals of the nodes; see meetings.node_face."""
    deepest: Floats
    """(crowd,) room for the height of a node over the face that holds it, m."""
    holder: Indices
    """(crowd,) room for the meeting with that face."""
    before: Floats
    """(crowd, 3) v(n-1/2)."""
    place: Indices
    """(nodes,) place of each node of this rank, -1 for those that are not in the crowd."""
    pushes: Flags
    """(crowd,) which nodes a meeting of this rank may push."""
    shared: Flags
    """(crowd,) which nodes are in company with any rank."""
    rest: Rest
    cracks: Indices
    """(m, 6) places of the nodes on either side of the cracks, -1 where they do not count (contact/cracks.py)."""
    moved: Flags
    """(crowd,) whose velocity the last sweep has changed."""
    met: int = 0
    """Meetings of the last step, the first rows of the room."""
    company: list[Neighbour] = field(init=False)
    """Other ranks, and the places of the nodes that either pushes or holds and any rank pushes."""
    shared_shares: SharedSum = field(init=False)
    shared_impulse: SharedSum = field(init=False)
    copies: Copies = field(init=False)

    def connect(self, company: list[Neighbour], nodes: Nodes, comm: Comm) -> None:
        """Sets up the messages: sums over the nodes of the company, copies of what is not held here; all ranks take
        part.
        """
        self.copies = ghosts.copies(self.crowd, nodes, comm, Tag.GHOST)
        self._sum(company, comm)

    def extend(self, company: list[Neighbour], sends: list[Neighbour], receives: list[Neighbour], comm: Comm) -> None:
        """The messages with more nodes, of which this rank knows as the others do; what has not grown stays."""
        if same([*self.company, *self.copies.sends, *self.copies.receives], [*company, *sends, *receives]):
            return
        self.free()
        self.copies = Copies(sends, receives, comm, Tag.GHOST)
        self._sum(company, comm)

    def _sum(self, company: list[Neighbour], comm: Comm) -> None:
        self.company = company
        self.shared = np.zeros(self.crowd.n, bool)
        for some in company:
            self.shared[some.nodes] = True
        self.shared_shares = SharedSum(comm, company, 4, Tag.CONTACT_SHARE)
        self.shared_impulse = SharedSum(comm, company, 3, Tag.CONTACT_IMPULSE)

    def remember(self, keys: Ints, kept: Floats, nodes: Nodes, comm: Comm) -> None:
        """Takes over what candidates of another search, with their ``keys``, have ``kept``; all ranks take part.

        The pairs of a copy were with the rank of its parent's, and are with its own from now on.
        """
        rows = np.column_stack([keys, kept.view(np.int64)])
        if comm.size > 1:
            owner = nodes.owner[nodes.places(keys[:, 0])]
            told = comm.swap({int(rank): rows[owner == rank] for rank in np.unique(owner)})
            rows = np.concatenate([rows[:0], *(words.reshape(-1, 6) for words in told.values())])
        kind = [("node", np.int64), ("face", np.int64)]
        mine, theirs = (np.ascontiguousarray(keys).view(kind).reshape(-1) for keys in (self.keys, rows[:, :2]))
        _, here, there = np.intersect1d(mine, theirs, assume_unique=True, return_indices=True)
        self.kept[here] = np.ascontiguousarray(rows[there, 2:]).view(np.float64)

    def expose(self, faces: Ints) -> None:
        """Faces of these ids, ascending, become surface."""
        self.face_exposed[np.searchsorted(self.face_id, faces[among(self.face_id, faces)])] = True
        self.edge_exposed.reshape(-1)[named(self.edge_sides.reshape(-1), faces)] = True

    def free(self) -> None:
        """Gives its messages back to MPI."""
        self.copies.free()
        self.shared_shares.free()
        self.shared_impulse.free()


@njit(
    "float64(float64[:, ::1], float64[:, ::1], int32[:, ::1], int32[:, ::1], int32[::1])",
    cache=True,
    error_model="numpy",
)
def approach(x, v, faces, pairs, some):  # type: ignore[no-untyped-def]
    """Largest relative speed of a node over the altitude of its face's tet, 1/s, of ``some`` of the ``pairs`` (p, 2).

    ``faces`` (f, 4), the node opposite last.
    """
    e, f, r = np.empty(3), np.empty(3), np.empty(3)
    most = 0.0
    for p in some:
        s, face = pairs[p, 0], pairs[p, 1]
        a, b, c, d = faces[face, 0], faces[face, 1], faces[face, 2], faces[face, 3]
        fastest = 0.0
        for m in range(3):
            speed = 0.0
            for i in range(3):
                speed += (v[s, i] - v[faces[face, m], i]) ** 2
            fastest = max(fastest, speed)
        for i in range(3):
            e[i], f[i], r[i] = x[b, i] - x[a, i], x[c, i] - x[a, i], x[d, i] - x[a, i]
        nx, ny, nz = e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]
        square = (nx * r[0] + ny * r[1] + nz * r[2]) ** 2 / (nx * nx + ny * ny + nz * nz)
        most = max(most, fastest / square)
    return np.sqrt(most)


def build(sides: Sides, rules: Rules, horizon: float, drift: Floats, nodes: Nodes, comm: Comm) -> Scene:
    """Searches what flies on for ``horizon``, s; all ranks take part and know of the same ``drift`` (3,), m/s.

    Who shares which node is settled by a Follower.
    """
    seen, sent = _with_ghosts(sides, rules, horizon, drift, comm) if comm.size > 1 else (sides, 0)
    node_face = _node_face(seen, rules, horizon, drift)
    edge_edge = _edge_edge(seen, sides.edges.n, rules, horizon, drift)
    return compact(seen, sides.edges.n, node_face, edge_edge, sent, rules, nodes)


def _with_ghosts(sides: Sides, rules: Rules, horizon: float, drift: Floats, comm: Comm) -> tuple[Sides, int]:
    """The sides with what other ranks' surfaces have near this one's, own edges first. And the faces sent."""
    crowd = sides.crowd

    def boxes(things: Things) -> Boxes:
        return search.swept(things, crowd.x, crowd.course - drift, horizon)

    nodes, faces, edges = boxes(sides.nodes), boxes(sides.face_things(DEEP)), boxes(sides.edge_things)
    askers = Boxes(np.concatenate([nodes.low, edges.low]), np.concatenate([nodes.high, edges.high]))
    chosen = domain.choose(rules.domain, askers, [faces, edges], rules.cell, comm)
    parcels = {rank: (sides.faces.take(flags[0]), sides.edges.take(flags[1])) for rank, flags in chosen.items()}
    got = comm.swap({rank: ghosts.pack(f, e, _nodes_of(f, e, crowd)) for rank, (f, e) in parcels.items()})
    others = [ghosts.unpack(words) for words in got.values()]
    sent = sum(f.n for f, _ in parcels.values())
    return _joined(sides, others), sent


def _nodes_of(faces: Faces, edges: Edges, crowd: Crowd) -> Crowd:
    ids = np.unique(np.concatenate([faces.nodes.reshape(-1), edges.nodes.reshape(-1)]))
    return crowd.take(crowd.places(ids))


def _joined(sides: Sides, others: list[tuple[Faces, Edges, Crowd]]) -> Sides:
    faces = Faces.joined([sides.faces, *(faces for faces, _, _ in others)])
    edges = Edges.joined([sides.edges, *(edges for _, edges, _ in others)])
    crowd = merged([sides.crowd, *(crowd for _, _, crowd in others)])
    return Sides(faces.take(np.argsort(faces.id)), edges, crowd, sides.slaves, sides.skin)


def _node_face(seen: Sides, rules: Rules, horizon: float, drift: Floats) -> Indices:
    """(p, 2) place of a node and index of a face, sorted by node, then by face."""
    crowd, slaves, v = seen.crowd, seen.nodes, seen.crowd.course - drift
    own = np.eye(len(rules.allowed), dtype=bool)
    found = [
        search.find(slaves, seen.face_things(deep), crowd.x, v, crowd.part, rules.allowed & which, horizon, None)
        for deep, which in ((DEEP_SELF, own), (DEEP, ~own))
        if (rules.allowed & which).any()
    ]
    pairs = np.concatenate([np.zeros((0, 2), np.int32), *found])
    pairs = np.column_stack([slaves.corners[pairs[:, 0], 0], pairs[:, 1]])
    pairs = sift.faces(pairs, seen.face_places, seen.faces.size, crowd, seen.skin, horizon)
    return _sorted(pairs[:, 0], pairs[:, 1], seen.faces.n)


def _sorted(one: "np.ndarray", two: "np.ndarray", n: int) -> Indices:
    """Rows of ``one`` and ``two``, which is less than ``n``, in their order; no row stands twice."""
    words = one.astype(np.int64) * n + two
    words.sort()
    return np.column_stack(np.divmod(words, max(n, 1))).astype(np.int32)


def _edge_edge(seen: Sides, own: int, rules: Rules, horizon: float, drift: Floats) -> Indices:
    """(q, 2) indices of edges, that of the smaller faces first; its rank has the pair."""
    crowd, edges, things = seen.crowd, seen.edges, seen.edge_things
    rank, order = np.empty(edges.n, np.int64), np.lexsort((*edges.nodes[:, 1::-1].T, *edges.sides[:, ::-1].T))
    rank[order] = np.arange(edges.n)
    mine = Things(things.corners[:own], things.reach[:own])
    pairs = search.find(mine, things, crowd.x, crowd.course - drift, crowd.part, rules.allowed, horizon, rank)
    pairs = sift.edges(pairs, seen.edge_places, edges.size, crowd, seen.skin, horizon)
    return order[_sorted(rank[pairs[:, 0]], rank[pairs[:, 1]], edges.n)].astype(np.int32)


def compact(
    seen: Sides, own: int, node_face: Indices, edge_edge: Indices, sent: int, rules: Rules, nodes: Nodes
) -> Scene:
    """Keeps the nodes, faces and edges of candidates, and those of parts that break, which copies may meet; the first
    ``own`` edges are this rank's.
    """
    crowd = seen.crowd
    apart = rules.breaking[crowd.part]
    which_faces, face_at = _used(seen.faces.n, node_face[:, 1], np.flatnonzero(apart[seen.face_places[:, 0]]))
    which_edges, edge_at = _used(seen.edges.n, edge_edge, np.flatnonzero(apart[seen.edge_places[:, 0]]))
    faces, edges = seen.faces.take(which_faces), seen.edges.take(which_edges)
    corners, ends, slaves = seen.face_places[which_faces], seen.edge_places[which_edges], node_face[:, 0]
    slave = np.zeros(crowd.n, bool)
    slave[seen.nodes.corners[:, 0]] = True
    mine = which_edges < own
    beside = apart[corners[:, 0]] & slave[corners[:, :3]].any(axis=1)
    touching = np.zeros(crowd.n, bool)
    touching[ends[mine, :2]] = True
    near = apart[ends[:, 0]] & touching[ends[:, :2]].any(axis=1)
    pushed, _ = _used(
        crowd.n, slaves, seen.face_places[node_face[:, 1], :3], seen.edge_places[edge_edge, :2], corners[beside, :3],
        ends[near, :2],
    )  # fmt: skip
    needed, now = _used(crowd.n, slaves, corners, ends)
    keys = np.column_stack([crowd.id[slaves], seen.faces.id[node_face[:, 1]]])
    crowd, pushes = crowd.take(needed), np.zeros(len(needed), bool)
    pushes[now[pushed]] = True
    crowd.local = nodes.places(crowd.id)
    room = len(node_face) + len(edge_edge)
    shares, impulse = np.zeros((crowd.n, 4), np.int64), np.zeros((crowd.n, 3), np.int64)
    held = np.flatnonzero(crowd.local >= 0).astype(np.int32)
    place = np.full(nodes.n, -1, np.int32)
    place[crowd.local[held]] = held
    pairs = np.column_stack([now[slaves], face_at[node_face[:, 1]]])
    first, following = np.full(crowd.n, -1, np.int32), np.empty(len(pairs), np.int32)
    meetings.chain(first, following, pairs, 0)
    return Scene(
        crowd=crowd, held=held, local=crowd.local[held], faces=now[corners], face_id=faces.id,
        face_size=faces.size, face_exposed=faces.exposed, edges=now[ends], edge_sides=edges.sides,
        edge_size=edges.size, edge_exposed=edges.exposed, edge_own=mine,
        meets_itself=rules.allowed.diagonal().copy(), slave=slave[needed],
        on_surface=np.zeros(crowd.n, bool), first=first, next=following,
        node_face=pairs, edge_edge=edge_at[edge_edge],
        keys=keys, kept=np.zeros((len(keys), 4)), faces_sent=sent,
        room=Meetings.room(room), diagonal=np.empty((room, 2)), push=np.empty((room, 4)),
        shares=shares, impulse=impulse, place=place, pushes=pushes, shared=np.zeros(crowd.n, bool),
        cracks=np.zeros((0, 6), np.int32),
        rest=Rest(crowd.x, crowd.course, len(which_faces), len(which_edges), len(node_face), len(edge_edge)),
        total=np.zeros((crowd.n, 3), np.int64), normals=np.zeros((crowd.n, 9)), before=np.zeros((crowd.n, 3)),
        deepest=np.empty(crowd.n), holder=np.empty(crowd.n, np.int32), moved=np.zeros(crowd.n, bool),
    )  # fmt: skip


def _used(n: int, *some: "np.ndarray") -> tuple["np.ndarray", Indices]:
    """Which of ``n`` things are among ``some``, ascending, and (n,) where each of these stands among them."""
    flags = np.zeros(n, bool)
    for each in some:
        flags[each] = True
    return np.flatnonzero(flags), (np.cumsum(flags) - 1).astype(np.int32)
