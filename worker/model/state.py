"""How the model lies in memory: node arrays, and blocks of elements in chunks.

Elements of one part form a block. Their state is stored chunk by chunk, ``(chunks, rows, CHUNK)``: the rows of a
chunk stand side by side, at offsets the compiler knows, so that the loops over a chunk use vector instructions and a
chunk's whole state stays in the first cache levels. All in SI; stress positive in tension, pressure in compression.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from . import ids as ids_of
from .growing import Rooms
from .shares import Shares

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Indices = npt.NDArray[np.int32]
Flags = npt.NDArray[np.bool_]
Bits = npt.NDArray[np.uint8]
Tets = npt.NDArray[np.uint32]
"""Unsigned: an index that cannot be negative needs no test for counting from the end."""

CHUNK = 376
"""Elements a chunk."""

INTACT, BROKEN, WIDE = range(3)
"""Bond of a face to the one behind it: whole; broken; broken and so far apart that it is part of the surface."""
LAID_BARE = -2
"""``Block.across`` of a face that erosion has exposed; -1 for one that was exposed at the start."""


def extended(array: "np.ndarray", rows: "np.ndarray") -> "np.ndarray":
    """``array`` with ``rows`` behind it: in the room that its buffer has left, or in a new one half as large again."""
    n, m = len(array), len(array) + len(rows)
    if n == m:
        return array
    room = array.base
    fits = isinstance(room, np.ndarray) and room.shape[1:] == array.shape[1:] and room.dtype == array.dtype
    if room is None or not fits or len(room) < m or not np.may_share_memory(room[:1], array[:1]):
        room = np.empty((m + m // 2, *array.shape[1:]), array.dtype)
        room[:n] = array
    room[n:m] = rows
    return room[:m]


@dataclass
class Nodes:
    """Nodal arrays of one rank; ``n`` nodes, in the order of their global ids."""

    id: Ints
    """(n,) global ids."""
    part: Indices
    """(n,) index of the part; of a node of several parts (``shares``) the one that it stands for."""
    owner: Indices
    """(n,) rank that counts the node."""
    owned: npt.NDArray[np.bool_]
    """(n,) True where that is this rank."""
    x0: Floats
    """(n, 3) initial position, m."""
    x: Floats
    """(n, 3) position, m."""
    v: Floats
    """(n, 3) velocity at mid-step, m/s."""
    mass: Floats
    """(n,) lumped mass, kg."""
    force: Ints
    """(n, 3) internal force in quanta."""
    stepping: Floats
    """(n,) energy that steps of unequal length have taken, J (energy.py)."""
    scale: float = 1.0
    """Quanta per newton of ``force`` as it stands."""
    group: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(n,) see Model.groups; copies stay in that of their parents. (0,) where nobody asks."""
    marks: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """(n,) the sets of mesh files that each is in, a bit each (marks.py); copies are where their parents are. (0,)
    where the case is on none."""
    shares: Shares = field(default_factory=Shares)
    """Of nodes of several parts."""
    _inherited: Rooms = field(
        default_factory=lambda: Rooms("part", "x0", "x", "v", "mass", "force", "stepping"), init=False
    )
    _given: Rooms = field(default_factory=lambda: Rooms("id", "owner", "owned"), init=False)

    @property
    def n(self) -> int:
        """Number of nodes on this rank."""
        return len(self.id)

    def places(self, ids: Ints) -> Indices:
        """Local indices of nodes with these global ids, -1 for those that are not here."""
        return ids_of.places(self.id, ids)

    def among(self, chosen: Flags) -> Flags:
        """(n,) the nodes that have a tet of the ``chosen`` parts (parts,)."""
        found: Flags = chosen[self.part]
        found[self.shares.node[chosen[self.shares.part]]] = True
        return found

    def in_part(self, part: int) -> Flags:
        """(n,) the nodes that have a tet of a part."""
        found: Flags = self.part == part
        found[self.shares.node[self.shares.part == part]] = True
        return found

    def of_parts(self) -> tuple[Ints, Indices]:
        """(m,) nodes and (m,) their parts, see Shares.members."""
        return self.shares.members(self.part)

    def mass_of(self, part: int) -> Floats:
        """(n,) what of the mass of each node is of the tets of a part, kg."""
        mass, shares = np.where(self.part == part, self.mass, 0.0), self.shares
        mass[shares.node] = 0.0
        some = shares.part == part
        mass[shares.node[some]] = shares.fraction[some] * self.mass[shares.node[some]]
        return mass

    def grow(self, copies: "Copies") -> None:
        """Takes up copies of nodes: they begin as their parents are, whose mass is their own less the copies'."""
        from .inheriting import inherit  # numba, which is not imported before its cache has a name (kernels/store.py)

        n, m = self.n, self.n + copies.n
        inherited = self._inherited.of(self, copies.n)
        inherit(*inherited, copies.parents, copies.mass, n)
        for room, column in zip(self._given.of(self, copies.n), (copies.id, copies.owner, copies.owned), strict=True):
            room[n:m] = column
        if len(self.group):
            self.group = extended(self.group, self.group[copies.parents])
        if len(self.marks):
            self.marks = extended(self.marks, self.marks[copies.parents])
        self._inherited.take(self, m)
        self._given.take(self, m)


@dataclass
class Copies:
    """Nodes that come into being when others separate; by ascending global id, behind all that a rank has."""

    parents: Ints
    """(n,) local nodes that they have been part of."""
    id: Ints
    """(n,) global ids."""
    owner: Indices
    """(n,) rank that counts the node."""
    owned: Flags
    """(n,) True where that is this rank."""
    mass: Floats
    """(n,) kg."""

    @property
    def n(self) -> int:
        """Number of copies."""
        return len(self.id)


@dataclass
class Block:
    """The elements of one part on one rank; the first ``border_chunks`` chunks touch every shared node."""

    part: int
    n: int
    tets: Tets
    """(n, 4) local nodes."""
    id: Ints
    """(n,) global tet ids."""
    state: Floats
    """(chunks, rows, CHUNK)."""
    kind: int
    """Which strength model (materials/models.py)."""
    eos: int
    """Which equation of state."""
    params: Floats
    """Material constants (materials/models.py)."""
    border_chunks: int = 0
    temperature: float = 293.15
    """Initial temperature, K; it stays where no material of the block heats up."""
    across: Indices = field(default_factory=lambda: np.zeros((0, 4), np.int32))
    """(n, 4) what was behind each face at the start, 4 * global tet id + local face; -1 for an exposed face, LAID_BARE
    for one that erosion has exposed; (0, 4) in scenes without contact and fracture."""
    bond: Bits = field(default_factory=lambda: np.zeros((0, 4), np.uint8))
    """(n, 4) INTACT, BROKEN or WIDE; (0, 4) where the part does not fracture."""
    weakest: Floats = field(default_factory=lambda: np.zeros(0))
    """(n,) smallest strength of the faces of each tet, Pa; (0,) where the part does not fracture."""
    hot: Bits = field(default_factory=lambda: np.zeros(0, np.uint8))
    """(n,) bit k: the tet's own traction on its face k is beyond ``weakest``."""
    flat: Flags = field(default_factory=lambda: np.zeros(0, bool))
    """(n,) tets whose volume strain is not averaged (elements/flat.py); (0,) where there is none."""
    shear_weight: float = 0.0
    """Of shear against normal traction."""
    worn: Flags = field(default_factory=lambda: np.zeros(0, bool))
    """(n,) tets that are about to leave; (0,) where the part does not erode."""
    life: Floats = field(default_factory=lambda: np.zeros(5))
    """What a tet lives through (elements/wear.py)."""
    rigid: bool = False
    """Whether the part is rigid: no pass over elements concerns it."""
    seconds: float = 0.0
    """CPU time of the passes over the block so far, where a rank has several."""
    group: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(n,) see Model.groups; (0,) where nobody asks."""
    moved: int = 0
    """Tets that have left so far, for each of which another may stand in another chunk."""
    quiet: Ints = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    """(chunks, 3) which chunks are at rest (elements/rest.py)."""
    own_averages: Tets | None = None
    """(n, 4) see ``averages``; None where these are the nodes."""

    @property
    def averages(self) -> Tets:
        """(n, 4) the means that each corner takes part in (elements/averages.py)."""
        return self.tets if self.own_averages is None else self.own_averages

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return -(-self.n // CHUNK)

    def __post_init__(self) -> None:
        """The state is the same array for good."""
        self.flat_state: Floats = self.state.reshape(-1)
        """All of the state in one row."""
        self.rows = int(self.state.shape[1])
        """Of the state, in a chunk."""

    def row(self, row: int) -> Floats:
        """(n,) copy of one row of the state."""
        return np.ascontiguousarray(self.state[:, row, :]).reshape(-1)[: self.n]

    def at(self, row: int, places: "np.ndarray") -> Floats:
        """(k,) copy of one row of the state at ``places`` (k,)."""
        further = (int(self.state.shape[1]) - 1) * CHUNK  # from a chunk to the next, beyond what a row has
        return np.asarray(self.state.reshape(-1)[places + (places // CHUNK * further + row * CHUNK)])

    def has(self, row: int) -> bool:
        """Whether the block carries that row."""
        return row < self.rows

    def exposed(self) -> Flags:
        """(n, 4) which faces are part of the surface."""
        bare: Flags = self.across < 0
        return bare | (self.bond == WIDE) if len(self.bond) else bare

    def drop(self, gone: Ints) -> None:
        """Takes the tets at these places out; the last ones move into the holes."""
        left = self.n - len(gone)
        holes, movers = gone[gone < left], np.setdiff1d(np.arange(left, self.n), gone)
        tables = self.tets, self.id, self.across, self.worn, self.group, self.flat, self.own_averages
        for table in tables:
            if table is not None and len(table):
                table[holes] = table[movers]
        self.state[holes // CHUNK, :, holes % CHUNK] = self.state[movers // CHUNK, :, movers % CHUNK]
        self.n, self.quiet[:] = left, 0
        self.moved += len(gone)
        self.tets, self.id = self.tets[:left], self.id[:left]
        self.across, self.worn, self.group = self.across[:left], self.worn[:left], self.group[:left]
        self.flat = self.flat[:left]
        self.own_averages = None if self.own_averages is None else self.own_averages[:left]
        self.border_chunks = min(self.border_chunks, self.chunks)


@dataclass
class Model:
    """Everything one rank holds of the bodies."""

    nodes: Nodes
    blocks: list[Block] = field(default_factory=list)
    parts: list[str] = field(default_factory=list)
    elements_global: int = 0
    """Tets of all ranks that are left."""
    nodes_global: int = 0
    """Nodes of all ranks; see ``StepReduction.nodes`` for who knows of them when."""
    part_starts: Ints = field(default_factory=lambda: np.zeros(1, np.int64))
    """Global id of the first tet of each part."""
    mean_volumes: Floats = field(default_factory=lambda: np.zeros(0))
    """(parts,) of the tets of each at the start, m^3."""
    size: float = 0.0
    """Largest coordinate of the whole mesh at the start, m: what round-off in positions is measured by."""
    slack: Floats = field(default_factory=lambda: np.zeros(0))
    """(parts,) how far outside of a region a node of each part is still in it, m (cases/shapes/region.py)."""
    rounding: Floats = field(default_factory=lambda: np.zeros(0))
    """(parts,) how far off a plane of symmetry a node of each part is still on it, m."""
    groups: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    """(groups, 4) centre, m, and number of tets at the start of each group: parts of the mesh that are neighbours then,
    and whose loads are told (worker/migration/groups.py). They do not know how many ranks there are."""


def chunked(values: Floats) -> Floats:
    """(n,) values as (chunks, CHUNK), the tail filled with the last value so that it is harmless in divisions."""
    chunks = -(-len(values) // CHUNK)
    filled = np.empty(chunks * CHUNK)
    filled[: len(values)] = values
    filled[len(values) :] = values[-1] if len(values) else 1.0
    return filled.reshape(chunks, CHUNK)
