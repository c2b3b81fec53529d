"""A scene: the surface near this rank, the candidate pairs on it, and the room to work in."""

from dataclasses import dataclass, field

import numpy as np

from ...kernels.jit import njit
from ...model.growing import same_memory
from ...model.ids import among, places
from ...model.state import Flags, Floats, Indices, Ints, Nodes
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour, same
from ...parallel.tags import Tag
from ..broad_phase.pairs import PairTable
from ..broad_phase.reference_motion import ReferenceMotion
from ..narrow_phase.rows import ActiveRows
from ..narrow_phase.tables import EdgeTable, FaceTable, SlotTable
from ..solver import slot_numbers
from ..solver.active import Kept
from ..solver.shared_sums import SharedSums
from ..surface import sharp
from ..surface.records import AGED, OPEN, SurfaceNodes
from . import ghosts
from .columns import OwnSlots, SceneEdges, SceneFaces, SceneSlots
from .ghosts import Copies
from .near_surface import Rules


@dataclass
class Messages:
    """Between ranks, in every step."""

    company: SharedSums
    """Sums over the nodes that several ranks push."""
    copies: Copies
    """Positions and velocities of what is not held here."""

    def free(self) -> None:
        """Gives them back to MPI."""
        self.company.free()
        self.copies.free()


@dataclass
class Scene:
    """What a search of all ranks left, and what has been found since."""

    surface_nodes: SurfaceNodes
    own: OwnSlots
    slots: SceneSlots
    faces: SceneFaces
    edges: SceneEdges
    rules: Rules
    reference: ReferenceMotion
    cracks: Indices
    """(m, 6) slots of the nodes on either side of the cracks, -1 where they do not count
    (contact/narrow_phase/cracks.py).
    """
    node_face: PairTable = field(default_factory=PairTable)
    """Of a slot and a face."""
    edge_edge: PairTable = field(default_factory=PairTable)
    active: ActiveRows = field(default_factory=ActiveRows)
    """Of the last step."""
    messages: Messages = field(init=False)
    _stored: Kept | None = field(default=None, init=False)

    def connect(self, company: list[Neighbour], nodes: Nodes, comm: Comm) -> None:
        """Sets up the messages: sums over the nodes of the company, copies of what is not held here; all ranks take
        part.
        """
        self.messages = Messages(SharedSums(company, comm), ghosts.copies(self.surface_nodes, nodes, comm, Tag.GHOST))

    def extend(self, company: list[Neighbour], sends: list[Neighbour], receives: list[Neighbour]) -> None:
        """The messages with more nodes, of which this rank knows as the others do; what has not grown stays."""
        messages = self.messages
        if not same(messages.company.neighbours, company):
            messages.company.take(company)
        if not same([*messages.copies.sends, *messages.copies.receives], [*sends, *receives]):
            messages.copies.take(sends, receives)

    def look(self, nodes: Nodes) -> None:
        """Takes v(n-1/2), before the kick."""
        slot_numbers.gather(self.slots.before, nodes.v, self.own.slots, self.own.local)
        self.messages.copies.note(nodes)

    def stored(self, cracks: Floats) -> Kept:
        """Where pairs, and ``cracks`` (m, 12), keep their impulses: the same object while that is the same memory."""
        before, pairs, rows = self._stored, self.node_face.kept, cracks.reshape(-1, 4)
        if before is None or before.pairs is not pairs or not same_memory(before.cracks, rows):
            self._stored = before = Kept(pairs, rows)
        return before

    @property
    def kept(self) -> tuple[Ints, Floats]:
        """(k, 2) ids of node and face of the pairs with impulses in the last step, and (k, 4) what they have kept."""
        table = self.node_face
        some = table.pushed
        node, face = table.rows[some].T
        return np.column_stack([self.surface_nodes.id[node], self.faces.id[face]]), table.kept[some]

    def remember(self, keys: Ints, kept: Floats, nodes: Nodes, comm: Comm) -> None:
        """Takes over what pairs of another search, with their ``keys``, have ``kept``; all ranks take part.

        The pairs of a copy were with the rank of its parent's, and are with its own from now on.
        """
        rows = np.column_stack([keys, kept.view(np.int64)])
        if comm.size > 1:
            owner = nodes.owner[nodes.places(keys[:, 0])]
            told = comm.swap({int(rank): rows[owner == rank] for rank in np.unique(owner)})
            rows = np.concatenate([rows[:0], *(words.reshape(-1, 6) for words in told.values())])
        local, face = nodes.places(rows[:, 0]), places(self.faces.id, rows[:, 1])
        node = self.own.place[local]
        here = (local >= 0) & (node >= 0) & (face >= 0)
        pairs = np.column_stack([node, face])[here]
        self.node_face.recall(self.slots.first, pairs, np.ascontiguousarray(rows[here, 2:]).view(np.float64))

    def rows_of(self, faces: Ints) -> Indices:
        """(k,) rows of those of the ``faces``, ids, that are here."""
        rows = places(self.faces.id, faces)
        return rows[rows >= 0]

    def expose(self, faces: Ints) -> None:
        """Faces of these ids become surface."""
        rows = self.rows_of(faces)
        self.faces.exposed[rows] = self.faces.fresh[rows] = True
        edges = self.edges
        if len(far := edges.far):
            shown = among(np.sort(faces), edges.sides[far].reshape(-1)).reshape(-1, 2)
            edges.fresh[far] |= (shown & (edges.opened[far] < OPEN)).any(axis=1)
            edges.opened[far] = np.where(shown, np.uint8(OPEN), edges.opened[far])
        _expose(edges.opened, edges.meets, edges.fresh, edges.faces, self.faces.exposed)
        self.enliven(rows)

    def uncover(self, gone: Ints, bare: Ints, removed: Indices) -> None:
        """Faces ``gone`` leave the surface, the faces ``bare`` come to it, ids, ascending; ``removed``: slots of nodes
        that have left, -1 for those that have none.
        """
        rows, removed = self.rows_of(gone), removed[removed >= 0]
        self.faces.exposed[rows] = self.faces.live[rows] = False
        self.edges.opened[among(gone, self.edges.sides)] = 0
        self.slots.owned[removed] = self.slots.live[removed] = False
        self.expose(bare)

    def enliven(self, rows: Indices) -> None:
        """Faces, with their nodes and edges, are searched from now on."""
        self.faces.new[rows] |= ~self.faces.live[rows]
        self.faces.live[rows] = True
        corners = np.unique(self.faces.corners[rows, :3])
        corners = corners[self.slots.owned[corners] & ~self.slots.live[corners]]
        self.slots.live[corners] = self.slots.new[corners] = True

    def settle_live(self) -> Flags:
        """Which nodes and edges are searched, and which slots belong to what is searched; (slots,) those that did not
        before, which nobody has watched.
        """
        before = self.slots.tracked.copy()
        nodes = self.slots.owned & self.slots.on_surface & ~self.slots.live
        self.slots.live |= nodes
        self.slots.new |= nodes
        edges = self.edges
        _enliven(edges.live, edges.new, edges.corners, edges.faces, edges.opened, edges.sharp, self.faces.live)
        self.slots.tracked[:] = self.slots.live
        self.slots.tracked[self.faces.corners[self.faces.live, :3]] = True
        self.slots.tracked[self.edges.corners[self.edges.live, :2]] = True
        return self.slots.tracked & ~before

    @property
    def pending(self) -> bool:
        """Whether anything has to be registered."""
        return bool(self.faces.new.any() or self.slots.new.any() or self.edges.new.any())

    def sharpen(self, least: Floats) -> Flags:
        """Which edges (e,) are sharp now and were not, by the cosines ``least`` (parts,); searched from now on."""
        edges, surface_nodes = self.edges, self.surface_nodes
        turned: Flags = sharp.turned(
            edges.sharp, edges.corners, edges.meets, surface_nodes.x, surface_nodes.part, least
        )
        edges.sharp |= turned
        edges.new |= turned
        return turned

    def chain(self) -> None:
        """The chains of the pairs of each node, anew."""
        self.slots.first[:] = -1
        self.node_face.hang(self.slots.first, 0)

    def slot_table(self) -> SlotTable:
        """The slots as kernels take them."""
        slots, lines = self.slots, self.reference.short
        return SlotTable(slots.normals, slots.on_surface, slots.first, lines.left, lines.course, slots.fresh)

    def face_table(self) -> FaceTable:
        """The faces."""
        faces = self.faces
        return FaceTable(faces.corners, faces.size, faces.id, faces.exposed, self.reference.faces, faces.fresh)

    def edge_table(self) -> EdgeTable:
        """The edges."""
        edges = self.edges
        return EdgeTable(edges.corners, edges.size, edges.deep, edges.meets, self.reference.edges, edges.fresh)

    def free(self) -> None:
        """Gives its messages back to MPI."""
        self.messages.free()


@njit("void(uint8[:, ::1], boolean[::1], boolean[::1], int32[:, ::1], boolean[::1])", cache=True)
def _expose(opened, meets, fresh, faces, shown):  # type: ignore[no-untyped-def]
    """Edges whose ``faces`` (e, 2) are ``shown`` (f,), and which meet others since; see SceneEdges."""
    for e in range(len(opened)):
        for k in range(2):
            if faces[e, k] >= 0 and shown[faces[e, k]] and opened[e, k] < OPEN:
                opened[e, k], fresh[e] = OPEN, True
        meets[e] = min(opened[e, 0], opened[e, 1]) >= AGED and max(opened[e, 0], opened[e, 1]) == OPEN


@njit(
    "void(boolean[::1], boolean[::1], int32[:, ::1], int32[:, ::1], uint8[:, ::1], boolean[::1], boolean[::1])",
    cache=True,
)
def _enliven(live, new, edges, faces, opened, sharp, searched):  # type: ignore[no-untyped-def]
    """Edges that are ``sharp``, one of whose ``faces`` (e, 2) is ``searched`` (f,), and the other one too if it is not
    ``opened`` (e, 2) at all. Of a face that is not here nobody says when it is exposed: it is taken to be searched.
    """
    for e in range(len(live)):
        one, both = False, sharp[e] and edges[e, 0] != edges[e, 1]
        for k in range(2):
            some = faces[e, k] < 0 or searched[faces[e, k]]
            one, both = one or some, both and (some or opened[e, k] >= AGED)
        new[e] |= both and one and not live[e]
        live[e] = both and one
