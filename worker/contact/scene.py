"""A scene: the surface near this rank, the candidate pairs on it, and the room to work in."""

from dataclasses import dataclass, field

import numpy as np

from ..jit import njit
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, same
from ..parallel.tags import Tag
from ..state import Flags, Floats, Indices, Ints, Nodes, among
from . import ghosts, held
from .columns import SceneEdges, SceneFaces, SceneSlots
from .company import Company
from .ghosts import Copies
from .narrow_phase import ContactRows, EdgeTable, FaceTable, SlotTable
from .pairs import PairTable
from .records import Crowd
from .sides import Rules
from .tracks import Tracks


@dataclass
class Scene:
    """What a search of all ranks left, and what has been found since."""

    crowd: Crowd
    held: Indices
    """(h,) slots of the nodes that this rank holds."""
    local: Indices
    """(h,) their indices on this rank."""
    slots: SceneSlots
    faces: SceneFaces
    edges: SceneEdges
    rules: Rules
    tracks: Tracks
    drift: Floats
    """(3,) mean velocity, m/s."""
    until: float
    """What is searched is searched for until then, s after the search."""
    faces_sent: int
    place: Indices
    """(nodes,) slot of each node of this rank, -1 for those that have none."""
    cracks: Indices
    """(m, 6) slots of the nodes on either side of the cracks, -1 where they do not count (contact/cracks.py)."""
    node_face: PairTable = field(default_factory=PairTable)
    """Of a slot and a face."""
    edge_edge: PairTable = field(default_factory=PairTable)
    met: int = 0
    """Active contacts of the last step, the first rows of the room."""
    room: ContactRows = field(default_factory=lambda: ContactRows.room(0))
    company: Company = field(init=False)
    copies: Copies = field(init=False)

    def connect(self, company: list[Neighbour], nodes: Nodes, comm: Comm) -> None:
        """Sets up the messages: sums over the nodes of the company, copies of what is not held here; all ranks take
        part.
        """
        self.copies = ghosts.copies(self.crowd, nodes, comm, Tag.GHOST)
        self.company = Company(company, comm)

    def extend(self, company: list[Neighbour], sends: list[Neighbour], receives: list[Neighbour], comm: Comm) -> None:
        """The messages with more nodes, of which this rank knows as the others do; what has not grown stays."""
        if same([*self.company.neighbours, *self.copies.sends, *self.copies.receives], [*company, *sends, *receives]):
            return
        self.free()
        self.copies = Copies(sends, receives, comm, Tag.GHOST)
        self.company = Company(company, comm)

    def look(self, nodes: Nodes) -> None:
        """Takes v(n-1/2), before the kick."""
        held.gather(self.slots.before, nodes.v, self.held, self.local)
        self.copies.note(nodes)

    def reserve(self) -> None:
        """Room for every contact that may become active; the rows of the last step stay."""
        n = len(self.node_face) + len(self.edge_edge) + 3 * len(self.cracks)
        if n > len(self.room.nodes):
            met, self.room = self.room.nodes[: self.met], ContactRows.room(2 * n)
            self.room.nodes[: self.met] = met

    @property
    def kept(self) -> tuple[Ints, Floats]:
        """(k, 2) ids of node and face of the pairs with impulses in the last step, and (k, 4) what they have kept."""
        table = self.node_face
        some = np.flatnonzero(table.kept.any(axis=1))
        node, face = table.rows[some].T
        return np.column_stack([self.crowd.id[node], self.faces.id[face]]), table.kept[some]

    def remember(self, keys: Ints, kept: Floats, nodes: Nodes, comm: Comm) -> None:
        """Takes over what pairs of another search, with their ``keys``, have ``kept``; all ranks take part.

        The pairs of a copy were with the rank of its parent's, and are with its own from now on.
        """
        rows = np.column_stack([keys, kept.view(np.int64)])
        if comm.size > 1:
            owner = nodes.owner[nodes.places(keys[:, 0])]
            told = comm.swap({int(rank): rows[owner == rank] for rank in np.unique(owner)})
            rows = np.concatenate([rows[:0], *(words.reshape(-1, 6) for words in told.values())])
        if not len(rows):
            return
        node, face = self.node_face.rows.T
        every = np.column_stack([self.crowd.id[node], self.faces.id[face]])
        kind = [("node", np.int64), ("face", np.int64)]
        mine, theirs = (np.ascontiguousarray(keys).view(kind).reshape(-1) for keys in (every, rows[:, :2]))
        _, here, there = np.intersect1d(mine, theirs, assume_unique=True, return_indices=True)
        self.node_face.kept[here] = np.ascontiguousarray(rows[there, 2:]).view(np.float64)

    def rows_of(self, faces: Ints) -> Indices:
        """(k,) rows of those of the ``faces``, ids, that are here."""
        rows = rows_of(self.faces.id, faces)
        return rows[rows >= 0]

    def expose(self, faces: Ints) -> None:
        """Faces of these ids become surface."""
        rows = self.rows_of(faces)
        self.faces.exposed[rows] = self.faces.fresh[rows] = True
        if len(far := self.edges.far):
            self.edges.exposed[far] |= among(np.sort(faces), self.edges.sides[far].reshape(-1)).reshape(-1, 2)
        _expose(self.edges.exposed, self.edges.fresh, self.edges.faces, self.faces.exposed)
        self.enliven(rows)

    def enliven(self, rows: Indices) -> None:
        """Faces, with their nodes and edges, are searched from now on."""
        self.faces.new[rows] |= ~self.faces.live[rows]
        self.faces.live[rows] = True
        corners = np.unique(self.faces.corners[rows, :3])
        corners = corners[self.slots.slave[corners] & ~self.slots.live[corners]]
        self.slots.live[corners] = self.slots.new[corners] = True

    def settle_live(self) -> Flags:
        """Which nodes and edges are searched, and which slots belong to what is searched; (slots,) those that did not
        before, which nobody has watched.
        """
        before = self.slots.tracked.copy()
        nodes = self.slots.slave & self.slots.on_surface & ~self.slots.live
        self.slots.live |= nodes
        self.slots.new |= nodes
        edges = self.edges
        _enliven(edges.live, edges.new, edges.corners, edges.faces, edges.exposed, self.faces.live)
        self.slots.tracked[:] = self.slots.live
        self.slots.tracked[self.faces.corners[self.faces.live, :3]] = True
        self.slots.tracked[self.edges.corners[self.edges.live, :2]] = True
        return self.slots.tracked & ~before

    @property
    def pending(self) -> bool:
        """Whether anything has to be registered."""
        return bool(self.faces.new.any() or self.slots.new.any())

    def chain(self) -> None:
        """The chains of the pairs of each node, anew."""
        self.slots.first[:] = -1
        self.node_face.hang(self.slots.first, 0)

    def slot_table(self) -> SlotTable:
        """The slots as kernels take them."""
        n, slots, lines = self.crowd.n, self.slots, self.tracks.short
        return SlotTable(
            slots.normals, slots.on_surface, slots.first, lines.left, lines.course, slots.fresh, np.empty(n),
            np.empty(n, np.int32),
        )  # fmt: skip

    def face_table(self) -> FaceTable:
        """The faces."""
        faces, n = self.faces, len(self.faces.corners)
        return FaceTable(
            faces.corners, faces.size, faces.id, faces.exposed, self.tracks.faces, faces.fresh, np.empty((n, 3)),
            np.zeros(n, bool),
        )  # fmt: skip

    def edge_table(self) -> EdgeTable:
        """The edges."""
        return EdgeTable(self.edges.corners, self.edges.size, self.edges.exposed, self.tracks.edges, self.edges.fresh)

    def free(self) -> None:
        """Gives its messages back to MPI."""
        self.copies.free()
        self.company.free()


@njit("void(boolean[:, ::1], boolean[::1], int32[:, ::1], boolean[::1])", cache=True)
def _expose(exposed, fresh, faces, shown):  # type: ignore[no-untyped-def]
    """Edges whose ``faces`` (e, 2) are ``shown`` (f,)."""
    for e in range(len(exposed)):
        for k in range(2):
            if faces[e, k] >= 0 and shown[faces[e, k]] and not exposed[e, k]:
                exposed[e, k], fresh[e] = True, True


@njit("void(boolean[::1], boolean[::1], int32[:, ::1], int32[:, ::1], boolean[:, ::1], boolean[::1])", cache=True)
def _enliven(live, new, edges, faces, exposed, searched):  # type: ignore[no-untyped-def]
    """Edges both of whose ``faces`` (e, 2) are ``searched`` (f,), or exposed where they are not here."""
    for e in range(len(live)):
        both = edges[e, 0] != edges[e, 1]
        for k in range(2):
            both &= searched[faces[e, k]] if faces[e, k] >= 0 else exposed[e, k]
        new[e] |= both and not live[e]
        live[e] = both


def rows_of(ids: Ints, wanted: Ints) -> Indices:
    """Where ``wanted`` stand among the ascending ``ids``, in their shape; -1 where they do not."""
    if not len(ids):
        return np.full(wanted.shape, -1, np.int32)
    at = np.minimum(np.searchsorted(ids, wanted), len(ids) - 1)
    return np.where(ids[at] == wanted, at, -1).astype(np.int32)
