"""Arrays of a rank: nodes, and blocks of elements in chunks.

A block holds the elements of one part. The state of the tets is stored chunk by chunk, ``(chunks, rows, CHUNK)``: the
rows of a chunk are contiguous, at offsets known at compile time, so that loops over a chunk use vector instructions and
the whole state of a chunk fits in the first cache levels. All in SI; stress positive in tension, pressure in
compression.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from . import ids as ids_of
from .columns import COPIED, ZERO, Columns
from .shares import Shares

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Indices = npt.NDArray[np.int32]
Flags = npt.NDArray[np.bool_]
Bits = npt.NDArray[np.uint8]
Tets = npt.NDArray[np.uint32]
"""Type of local indices. The type is unsigned, so numba omits the test for negative indices."""

CHUNK = 376
"""Number of elements in a chunk."""

INTACT, BROKEN, WIDE = range(3)
"""States of a facet between two tets: intact; broken; broken and so wide open that both sides are surface."""
LAID_BARE = -2
"""Value of ``Block.across`` for a face that erosion has exposed. A face that was exposed at the start has -1."""


def extended(array: "np.ndarray", rows: "np.ndarray") -> "np.ndarray":
    """Return ``array`` with ``rows`` appended, in its buffer if that has capacity, else in a larger buffer."""
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
    """Nodal arrays of one rank: ``n`` nodes, in the order of their global ids."""

    id: Ints
    """(n,) global ids of the nodes."""
    part: Indices
    """(n,) index of the part; for a node of several parts (``shares``) its representative part."""
    owner: Indices
    """(n,) rank that owns the node. Sums over nodes count the node on this rank only."""
    owned: npt.NDArray[np.bool_]
    """(n,) whether this rank owns the node."""
    x0: Floats
    """(n, 3) initial position, m."""
    x: Floats
    """(n, 3) position, m."""
    v: Floats
    """(n, 3) velocity at mid-step, m/s."""
    mass: Floats
    """(n,) lumped mass, kg."""
    force: Ints
    """(n, 3) internal force, quanta."""
    stepping: Floats
    """(n,) energy lost to the change of the step length, J (accounts/energy.py)."""
    scale: float = 1.0
    """Quanta per newton of ``force``."""
    group: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(n,) group of the node (Model.groups); (0,) without records of groups. A copy has the group of its parent."""
    marks: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """(n,) bits: sets of mesh files that contain the node (scene/marks.py); (0,) if the case refers to no set. A
    copy has the bits of its parent."""
    shares: Shares = field(default_factory=Shares)
    """Masses of the nodes that belong to several parts."""
    columns: Columns = field(default_factory=Columns, init=False, repr=False, compare=False)
    """All columns of all stages by node. A stage declares its columns when it is built."""

    def __post_init__(self) -> None:
        """Declares the columns of this table."""
        self.columns.declare(self, id=ZERO, owner=ZERO, owned=ZERO, mass=ZERO, force=ZERO, stepping=ZERO)
        self.columns.declare(self, part=COPIED, x0=COPIED, x=COPIED, v=COPIED, group=COPIED, marks=COPIED)

    @property
    def n(self) -> int:
        """Number of nodes on this rank."""
        return len(self.id)

    def places(self, ids: Ints) -> Indices:
        """Return the local indices of nodes with these global ids, -1 for nodes that are not on this rank."""
        return ids_of.places(self.id, ids)

    def among(self, chosen: Flags) -> Flags:
        """Return (n,) which nodes have a tet of one of the ``chosen`` parts (parts,)."""
        found: Flags = chosen[self.part]
        found[self.shares.node[chosen[self.shares.part]]] = True
        return found

    def in_part(self, part: int) -> Flags:
        """Return (n,) which nodes have a tet of a part."""
        found: Flags = self.part == part
        found[self.shares.node[self.shares.part == part]] = True
        return found

    def of_parts(self) -> tuple[Ints, Indices]:
        """Return (m,) nodes and (m,) their parts, see Shares.members."""
        return self.shares.members(self.part)

    def mass_of(self, part: int) -> Floats:
        """Return (n,) the mass of each node that comes from tets of a part, kg."""
        mass, shares = np.where(self.part == part, self.mass, 0.0), self.shares
        mass[shares.node] = 0.0
        some = shares.part == part
        mass[shares.node[some]] = shares.fraction[some] * self.mass[shares.node[some]]
        return mass

    def grow(self, copies: "Copies") -> None:
        """Append copies of nodes to the columns of all stages: each copy has the state of its parent, and takes its
        mass from its parent.
        """
        # This module imports numba, which must not be imported before kernels/store.py has set its cache folder.
        from .inheriting import inherit

        n = self.n
        self.columns.extend(n, copies.n)
        self.columns.copy(copies.parents, np.arange(n, n + copies.n))
        new = copies.id, copies.owner, copies.owned, copies.mass
        inherit(self.id, self.owner, self.owned, self.mass, copies.parents, *new, n)


@dataclass
class Copies:
    """New nodes of a separation, in ascending order of global id. The copies are appended to the nodes of the rank."""

    parents: Ints
    """(n,) local index of the parent, the node from which each copy was separated."""
    id: Ints
    """(n,) global ids of the copies."""
    owner: Indices
    """(n,) rank that owns the copy."""
    owned: Flags
    """(n,) whether this rank owns the copy."""
    mass: Floats
    """(n,) mass of the copy, kg."""

    @property
    def n(self) -> int:
        """Number of copies on this rank."""
        return len(self.id)


@dataclass
class Block:
    """The elements of one part on one rank; the first ``border_chunks`` chunks contain all tets that touch a shared
    node.
    """

    part: int
    n: int
    tets: Tets
    """(n, 4) local indices of the nodes of each tet."""
    id: Ints
    """(n,) global tet ids."""
    state: Floats
    """(chunks, rows, CHUNK) element state (rows.py)."""
    kind: int
    """Number of the strength model (materials/models.py)."""
    eos: int
    """Number of the equation of state."""
    params: Floats
    """Material constants (materials/models.py)."""
    border_chunks: int = 0
    temperature: float = 293.15
    """Initial temperature, K; the temperature of every tet if the material has no row for it."""
    across: Indices = field(default_factory=lambda: np.zeros((0, 4), np.int32))
    """(n, 4) the neighbour of each face at the start, 4 * global tet id + local face. -1: a face exposed at the
    start; LAID_BARE: a face exposed by erosion. (0, 4) in scenes without contact and fracture."""
    bond: Bits = field(default_factory=lambda: np.zeros((0, 4), np.uint8))
    """(n, 4) state of the facet at each face, INTACT, BROKEN or WIDE; (0, 4) where the part does not fracture."""
    weakest: Floats = field(default_factory=lambda: np.zeros(0))
    """(n,) smallest strength of the four faces of each tet, Pa; (0,) where the part does not fracture."""
    hot: Bits = field(default_factory=lambda: np.zeros(0, np.uint8))
    """(n,) bit k is set if the traction of the tet alone on face k exceeds ``weakest``."""
    flat: Flags = field(default_factory=lambda: np.zeros(0, bool))
    """(n,) which tets are flat (elements/flat.py) and have no averaged volume strain; (0,) without flat tets."""
    shear_weight: float = 0.0
    """Weight of the shear traction relative to the normal traction in the fracture criterion."""
    worn: Flags = field(default_factory=lambda: np.zeros(0, bool))
    """(n,) which tets are to be removed; (0,) if the part does not erode."""
    life: Floats = field(default_factory=lambda: np.zeros(5))
    """Limits of erosion (elements/wear.py)."""
    rigid: bool = False
    """Whether the part is rigid. Passes over elements omit a rigid part."""
    seconds: float = 0.0
    """CPU time of the passes over the block, s; counted if the rank has several blocks."""
    group: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(n,) group of the tet (Model.groups); (0,) without records of groups."""
    moved: int = 0
    """Number of tets removed so far. At each removal another tet may have moved to another chunk."""
    quiet: Ints = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    """(chunks, 3) record of chunks at rest (elements/rest.py)."""
    own_averages: Tets | None = None
    """(n, 4) indices ``averages`` of the nodal means; None if the means belong to the nodes themselves."""

    @property
    def averages(self) -> Tets:
        """(n, 4) index of the nodal mean to which each corner contributes (elements/averages.py)."""
        return self.tets if self.own_averages is None else self.own_averages

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return -(-self.n // CHUNK)

    def __post_init__(self) -> None:
        """Views of ``state``. The array object ``state`` is never replaced."""
        self.flat_state: Floats = self.state.reshape(-1)
        """View of the whole state as one row."""
        self.rows = int(self.state.shape[1])
        """Number of rows of the state of a chunk."""

    def row(self, row: int) -> Floats:
        """Return (n,) a copy of one row of the state."""
        return np.ascontiguousarray(self.state[:, row, :]).reshape(-1)[: self.n]

    def at(self, row: int, places: "np.ndarray") -> Floats:
        """Return (k,) a copy of one row of the state for the tets ``places`` (k,)."""
        further = (int(self.state.shape[1]) - 1) * CHUNK  # words between a row of two chunks
        return np.asarray(self.state.reshape(-1)[places + (places // CHUNK * further + row * CHUNK)])

    def has(self, row: int) -> bool:
        """Return whether the block has that row."""
        return row < self.rows

    def exposed(self) -> Flags:
        """Return (n, 4) which faces are part of the surface."""
        bare: Flags = self.across < 0
        return bare | (self.bond == WIDE) if len(self.bond) else bare

    def drop(self, gone: Ints) -> None:
        """Remove the tets with these local indices; tets from the end of the block fill the gaps."""
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
    """All bodies on one rank."""

    nodes: Nodes
    blocks: list[Block] = field(default_factory=list)
    parts: list[str] = field(default_factory=list)
    elements_global: int = 0
    """Number of tets of all ranks that are not eroded."""
    nodes_global: int = 0
    """Number of nodes of all ranks. ``StepReduction.nodes`` describes when this number is up to date."""
    part_starts: Ints = field(default_factory=lambda: np.zeros(1, np.int64))
    """Global id of the first tet of each part."""
    mean_volumes: Floats = field(default_factory=lambda: np.zeros(0))
    """(parts,) mean volume of a tet at the start, m^3."""
    size: float = 0.0
    """Largest absolute coordinate of the whole mesh at the start, m. The largest coordinate determines the round-off of
    positions."""
    slack: Floats = field(default_factory=lambda: np.zeros(0))
    """(parts,) distance, m, outside of a region at which a node still counts as inside (cases/shapes/region.py)."""
    rounding: Floats = field(default_factory=lambda: np.zeros(0))
    """(parts,) distance, m, from a plane of symmetry at which a node still counts as on the plane."""
    groups: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    """(groups, 4) centre, m, and number of tets of each group at the start. A group is a set of neighbouring tets
    with a recorded load (migration/groups.py). Groups do not depend on the number of ranks."""


def chunked(values: Floats) -> Floats:
    """Return (n,) values as (chunks, CHUNK). The last value pads the last chunk; it is a safe divisor."""
    chunks = -(-len(values) // CHUNK)
    filled = np.empty(chunks * CHUNK)
    filled[: len(values)] = values
    filled[len(values) :] = values[-1] if len(values) else 1.0
    return filled.reshape(chunks, CHUNK)
