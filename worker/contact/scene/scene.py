"""Scene: the surface near this rank, its candidate pairs, and the working arrays for the pairs."""

from dataclasses import dataclass, field

import numpy as np

from ...kernels.jit import njit
from ...model.columns import ZERO
from ...model.growing import same_memory
from ...model.ids import among, places
from ...model.state import Flags, Floats, Indices, Ints, Nodes
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour, same
from ...parallel.tags import Tag
from ..broad_phase.pairs import PairTable
from ..broad_phase.reference_motion import Lines, ReferenceMotion
from ..narrow_phase.rows import ActiveRows
from ..narrow_phase.tables import EdgeTable, FaceTable, SlotTable
from ..solver.active import Kept
from ..solver.shared_sums import SharedSums
from ..surface.records import OPEN, SurfaceNodes
from . import ghosts
from .columns import SLOT_COLUMNS, OwnSlots, SceneEdges, SceneFaces, SceneSlots
from .ghosts import Copies
from .near_surface import Rules
from .passes import ScenePasses


@dataclass
class Messages:
    """Persistent MPI messages of a scene; ranks send them in every step."""

    company: SharedSums
    """Sums of impulses at nodes to which contacts of several ranks apply impulses."""
    copies: Copies
    """Messages with positions and velocities of the ghosts."""

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        self.company.free()
        self.copies.free()


@dataclass
class Scene:
    """Result of the last search of all ranks, with the updates after the search."""

    surface_nodes: SurfaceNodes
    own: OwnSlots
    slots: SceneSlots
    faces: SceneFaces
    edges: SceneEdges
    rules: Rules
    reference: ReferenceMotion
    cracks: Indices
    """(m, 6) slots of the nodes on the two sides of each crack; -1 for a crack that this rank does not compute
    (narrow_phase/cracks.py).
    """
    passes: ScenePasses
    node_face: PairTable = field(default_factory=PairTable)
    """Candidate pairs of a node (slot) and a face."""
    edge_edge: PairTable = field(default_factory=PairTable)
    active: ActiveRows = field(default_factory=ActiveRows)
    """Active contacts of the last step."""
    messages: Messages = field(init=False)
    _stored: Kept | None = field(default=None, init=False)
    _cracks: Floats | None = field(default=None, init=False)
    """Argument of the last call of the method ``stored``."""

    def __post_init__(self) -> None:
        """Declares the columns with one value for each slot."""
        columns = self.slots.columns
        columns.declare(self.surface_nodes, **dict.fromkeys(vars(self.surface_nodes), ZERO))
        columns.declare(self.slots, **SLOT_COLUMNS)
        for lines in (self.reference.searched, self.reference.short):
            columns.declare(lines, **Lines.COLUMNS)

    def add_slots(self, rows: SurfaceNodes) -> None:
        """Adds slots for the nodes ``rows`` to the scene."""
        first, surface_nodes = self.surface_nodes.n, self.surface_nodes
        self.slots.columns.extend(first, rows.n)
        for column, values in zip(surface_nodes.columns(), rows.columns(), strict=True):
            column[first:] = values
        self.slots.before[first:] = rows.v
        self.reference.begin_at(first, rows.x, rows.course)
        self.own.add(first, rows)

    def connect(self, company: list[Neighbour], nodes: Nodes, comm: Comm) -> None:
        """Makes the messages of the scene: sums over the shared nodes ``company``, and states of the ghosts.
        Collective.
        """
        self.messages = Messages(SharedSums(company, comm), ghosts.copies(self.surface_nodes, nodes, comm, Tag.GHOST))

    def extend(self, company: list[Neighbour], sends: list[Neighbour], receives: list[Neighbour]) -> None:
        """Extends the messages after a node separation. A message whose list of nodes is unchanged is used again."""
        messages = self.messages
        if not same(messages.company.neighbours, company):
            messages.company.take(company)
        if not same([*messages.copies.sends, *messages.copies.receives], [*sends, *receives]):
            messages.copies.take(sends, receives)

    def store_before(self, nodes: Nodes) -> None:
        """Stores the velocities v(n-1/2); to be called before the kick."""
        own = self.own
        self.passes.store.run(len(own.local), self.slots.before, nodes.v, own.slots, own.local)
        self.messages.copies.note(nodes)

    def stored(self, cracks: Floats) -> Kept:
        """Returns the stored impulses of the pairs and of the ``cracks`` (m, 12). The method returns the same object
        while the arrays use the same memory.
        """
        before, pairs = self._stored, self.node_face.kept
        if before is not None and before.pairs is pairs and cracks is self._cracks:
            return before
        rows, self._cracks = cracks.reshape(-1, 4), cracks
        if before is None or before.pairs is not pairs or not same_memory(before.cracks, rows):
            self._stored = before = Kept(pairs, rows)
        return before

    @property
    def kept(self) -> tuple[Ints, Floats]:
        """Returns two arrays about the pairs that had impulses in the last step: (k, 2) ids of node and face, and (k,
        4) stored impulses.
        """
        table = self.node_face
        some = table.pushed
        node, face = table.rows[some].T
        return np.column_stack([self.surface_nodes.id[node], self.faces.id[face]]), table.kept[some]

    def remember(self, keys: Ints, kept: Floats, nodes: Nodes, comm: Comm) -> None:
        """Copies the stored impulses ``kept`` of the pairs ``keys`` from the scene of the last search. Collective.

        Before the call the pairs of a copied node are on the rank of its parent. After the call they are on the rank
        that owns the copy.
        """
        rows = np.column_stack([keys, kept.view(np.int64)])
        if comm.size > 1:
            owner = nodes.owner[nodes.places(keys[:, 0])]
            received = comm.swap({int(rank): rows[owner == rank] for rank in np.unique(owner)})
            rows = np.concatenate([rows[:0], *(words.reshape(-1, 6) for words in received.values())])
        local, face = nodes.places(rows[:, 0]), places(self.faces.id, rows[:, 1])
        node = self.own.place[local]
        here = (local >= 0) & (node >= 0) & (face >= 0)
        pairs = np.column_stack([node, face])[here]
        self.node_face.recall(self.slots.first, pairs, np.ascontiguousarray(rows[here, 2:]).view(np.float64))

    def rows_of(self, faces: Ints) -> Indices:
        """Returns (k,) the rows of those ``faces``, given by ids, that this rank has."""
        rows = places(self.faces.id, faces)
        return rows[rows >= 0]

    def expose(self, faces: Ints) -> None:
        """Adds the faces with the ids ``faces`` to the surface."""
        rows = self.rows_of(faces)
        self.faces.exposed[rows] = self.faces.fresh[rows] = True
        edges = self.edges
        if len(far := edges.far):
            shown = among(np.sort(faces), edges.sides[far].reshape(-1)).reshape(-1, 2)
            edges.fresh[far] |= (shown & (edges.opened[far] < OPEN)).any(axis=1)
            edges.opened[far] = np.where(shown, np.uint8(OPEN), edges.opened[far])
        of = edges.opened, edges.meets, edges.fresh, edges.faces, self.faces.exposed
        self.passes.expose.run(len(edges.meets), *of)
        self.enliven(rows)

    def uncover(self, gone: Ints, bare: Ints, removed: Indices) -> None:
        """Removes the faces ``gone`` from the surface and adds the faces ``bare``. The faces are given by ids,
        ascending. ``removed``: slots of the nodes that left the model, -1 for nodes without slot.
        """
        rows, removed = self.rows_of(gone), removed[removed >= 0]
        self.faces.exposed[rows] = self.faces.live[rows] = False
        self.edges.opened[among(gone, self.edges.sides)] = 0
        self.slots.owned[removed] = self.slots.live[removed] = False
        self.expose(bare)

    def enliven(self, rows: Indices) -> None:
        """Adds the faces ``rows`` and the nodes of these faces to the broad phase."""
        self.faces.new[rows] |= ~self.faces.live[rows]
        self.faces.live[rows] = True
        slots = self.slots
        _enliven(slots.live, slots.new, slots.owned, self.faces.corners, rows.astype(np.int32, copy=False))

    def settle_live(self) -> Flags:
        """Updates which nodes and edges are in the broad phase. Returns (slots,) flags: True if the motion of the slot
        is measured from now on.
        """
        before = self.slots.tracked.copy()
        nodes = self.slots.owned & self.slots.on_surface & ~self.slots.live
        self.slots.live |= nodes
        self.slots.new |= nodes
        edges = self.edges
        of = edges.live, edges.new, edges.corners, edges.faces, edges.opened, edges.sharp, self.faces.live
        self.passes.enliven.run(len(edges.live), *of)
        self.slots.tracked[:] = self.slots.live
        _track(self.slots.tracked, self.faces.corners, 3, self.faces.live)
        _track(self.slots.tracked, edges.corners, 2, edges.live)
        return self.slots.tracked & ~before

    def renew_at(self, slots: Flags) -> None:
        """Schedules the flagged ``slots`` (slots,) for registration, and the faces and edges at these slots."""
        self.slots.new |= slots
        self.passes.flag_faces.run(len(self.faces.new), self.faces.new, self.faces.corners, 3, slots)
        self.passes.flag_edges.run(len(self.edges.new), self.edges.new, self.edges.corners, 2, slots)

    @property
    def pending(self) -> bool:
        """True if any node, face or edge must be registered."""
        return bool(self.faces.new.any() or self.slots.new.any() or self.edges.new.any())

    def sharpen(self, least: Floats) -> Flags:
        """Returns (e,) flags: True for each edge that has become sharp. ``least`` (parts,): cosine of the smallest
        angle of a sharp edge. The method adds the edges that have become sharp to the broad phase.
        """
        edges, surface_nodes = self.edges, self.surface_nodes
        turned = self.passes.turned(edges.sharp, edges.corners, edges.meets, surface_nodes.x, surface_nodes.part, least)
        edges.sharp |= turned
        edges.new |= turned
        return turned

    def chain(self) -> None:
        """Builds the linked lists of the pairs of each node again, after the pairs have changed."""
        self.slots.first[:] = -1
        self.node_face.hang(self.slots.first, 0)

    def slot_table(self) -> SlotTable:
        """Returns the slots as a record for kernels."""
        slots, lines = self.slots, self.reference.short
        return SlotTable(slots.normals, slots.on_surface, slots.first, lines.left, lines.course, slots.fresh)

    def face_table(self) -> FaceTable:
        """Returns the faces as a record for kernels."""
        faces = self.faces
        return FaceTable(faces.corners, faces.size, faces.id, faces.exposed, self.reference.faces, faces.fresh)

    def edge_table(self) -> EdgeTable:
        """Returns the edges as a record for kernels."""
        edges = self.edges
        return EdgeTable(edges.corners, edges.size, edges.deep, edges.meets, self.reference.edges, edges.fresh)

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        self.messages.free()


@njit("void(boolean[::1], boolean[::1], boolean[::1], int32[:, ::1], int32[::1])", cache=True)
def _enliven(live, new, owned, corners, rows):  # type: ignore[no-untyped-def]
    """Adds the slots of the faces ``rows`` (k,) to the broad phase. Only slots that are ``owned`` (slots,) are
    added.
    """
    for f in rows:
        for k in range(3):
            a = corners[f, k]
            if owned[a] and not live[a]:
                live[a] = new[a] = True


@njit("void(boolean[::1], int32[:, ::1], int64, boolean[::1])", cache=True)
def _track(tracked, corners, many, live):  # type: ignore[no-untyped-def]
    """Flags the first ``many`` corners of each row that is ``live`` (n,)."""
    for f in range(len(live)):
        if live[f]:
            for k in range(many):
                tracked[corners[f, k]] = True
