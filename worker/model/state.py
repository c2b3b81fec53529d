"""Arrays of a rank: nodes, and blocks of elements in chunks.

A block contains the elements of one part. The state is stored chunk by chunk, ``(chunks, rows, CHUNK)``: the rows of a
chunk are contiguous, at fixed offsets, so that loops over a chunk use vector instructions and the whole state of a
chunk fits in the first cache levels. Values are in SI units; stress is positive in tension, pressure in compression.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from . import ids as ids_of
from .columns import COPIED, ZERO, Columns
from .growing import aligned
from .moves import Moves
from .shares import Shares

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Indices = npt.NDArray[np.int32]
Flags = npt.NDArray[np.bool_]
Bits = npt.NDArray[np.uint8]
Tets = npt.NDArray[np.uint32]
"""Type of local node indices of tets. The type is unsigned, so that numba omits the test for negative indices."""

CHUNK = 376
"""Number of elements in one chunk."""

INTACT, BROKEN, WIDE = range(3)
"""States of a facet between two tets: intact; broken; broken and so wide open that its two sides are surface."""
_OF_TETS = "tets", "id", "across", "bond", "weakest", "hot", "worn", "group", "flat", "own_averages"
"""Names of the attributes of a block that are tables. Each table has one row for each tet, or has no rows."""
LAID_BARE = -2
"""Value of ``Block.across`` for a face that erosion has exposed. A face that was exposed at the start has -1."""


def force_table(force: "Ints | int") -> Ints:
    """Return the table of nodal forces, (n, 4), for forces (n, 3), or for ``n`` nodes without forces. The last column
    is zero, so that a row is half a cache line, which one instruction reads or writes.
    """
    n = force if isinstance(force, int) else len(force)
    table: Ints = aligned(n, (4,), np.int64)
    table[:] = 0
    if not isinstance(force, int):
        table[:, :3] = force
    return table


@dataclass
class Nodes:
    """Nodal arrays of one rank. The ``n`` nodes have the order of their global ids."""

    id: Ints
    """(n,) global ids of the nodes."""
    part: Indices
    """(n,) index of the part of each node; for a node of several parts (``shares``) it is the representative part."""
    owner: Indices
    """(n,) rank that owns each node. A sum over nodes includes a node only on the rank that owns the node."""
    owned: npt.NDArray[np.bool_]
    """(n,) True if this rank owns the node."""
    x0: Floats
    """(n, 3) initial position, m."""
    x: Floats
    """(n, 3) position, m."""
    v: Floats
    """(n, 3) velocity at mid-step, m/s."""
    mass: Floats
    """(n,) lumped mass, kg."""
    force: Ints
    """(n, 4) internal force, quanta (``force_table``). The last column is zero."""
    stepping: Floats
    """(n,) energy that each node has lost by unequal time steps, J (accounts/energy.py)."""
    scale: float = 1.0
    """Number of quanta per newton in ``force``."""
    group: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(n,) group (Model.groups) of each node or of its parent; (0,) if loads of groups are not recorded."""
    marks: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """(n,) sets that contain each node or its parent, as bits (scene/marks.py); (0,) if the case uses no set."""
    shares: Shares = field(default_factory=Shares)
    """Masses of the parts in the nodes that belong to several parts."""
    columns: Columns = field(default_factory=Columns, init=False, repr=False, compare=False)
    """Columns of all stages that have one row for each node. A stage declares its columns when it is built."""

    def __post_init__(self) -> None:
        """Declares the columns of this table."""
        self.columns.declare(self, id=ZERO, owner=ZERO, owned=ZERO, mass=ZERO, force=ZERO, stepping=ZERO)
        self.columns.declare(self, part=COPIED, x0=COPIED, x=COPIED, v=COPIED, group=COPIED, marks=COPIED)

    @property
    def n(self) -> int:
        """Number of nodes on this rank."""
        return len(self.id)

    def places(self, ids: Ints) -> Indices:
        """Return the local indices of the nodes with the global ids ``ids``; -1 for nodes that are not on this rank."""
        return ids_of.places(self.id, ids)

    def among(self, chosen: Flags) -> Flags:
        """Return (n,) flags: True if a tet of a ``chosen`` part (parts,) is at the node."""
        found: Flags = chosen[self.part]
        found[self.shares.node[chosen[self.shares.part]]] = True
        return found

    def in_part(self, part: int) -> Flags:
        """Return (n,) flags: True if a tet of the part is at the node."""
        found: Flags = self.part == part
        found[self.shares.node[self.shares.part == part]] = True
        return found

    def of_parts(self) -> tuple[Ints, Indices]:
        """Return (m,) nodes and (m,) their parts; see Shares.members."""
        return self.shares.members(self.part)

    def mass_of(self, part: int) -> Floats:
        """Return (n,) the mass that each node has from tets of the part, kg."""
        mass, shares = np.where(self.part == part, self.mass, 0.0), self.shares
        mass[shares.node] = 0.0
        some = shares.part == part
        mass[shares.node[some]] = shares.fraction[some] * self.mass[shares.node[some]]
        return mass

    def grow(self, copies: "Copies") -> None:
        """Append copies of nodes to the columns of all stages. Each copy has the state of its parent; the mass of the
        copy is subtracted from the parent.
        """
        # The import of numba is inside of the function, because kernels/store.py must set numba's cache folder first.
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
    """(n,) local index of the parent of each copy. The parent is the node from which the copy was separated."""
    id: Ints
    """(n,) global ids of the copies."""
    owner: Indices
    """(n,) rank that owns the copy."""
    owned: Flags
    """(n,) True if this rank owns the copy."""
    mass: Floats
    """(n,) mass of the copy, kg."""

    @property
    def n(self) -> int:
        """Number of copies on this rank."""
        return len(self.id)


@dataclass
class Block:
    """The elements of one part on one rank; the first ``border_chunks`` chunks contain all tets that have a shared
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
    """Number that selects the strength law (materials/models.py)."""
    eos: int
    """Number that selects the equation of state (materials/models.py)."""
    params: Floats
    """Material constants (materials/models.py)."""
    border_chunks: int = 0
    temperature: float = 293.15
    """Initial temperature, K; the temperature of every tet if the material has no row for the temperature."""
    across: Indices = field(default_factory=lambda: np.zeros((0, 4), np.int32))
    """(n, 4) the neighbour of each face at the start, 4 * global tet id + local face; the value is -1 for a face
    exposed at the start, and LAID_BARE for a face exposed by erosion. (0, 4) in scenes without contact and fracture."""
    bond: Bits = field(default_factory=lambda: np.zeros((0, 4), np.uint8))
    """(n, 4) state of the facet at each face, INTACT, BROKEN or WIDE; (0, 4) if the part does not fracture."""
    weakest: Floats = field(default_factory=lambda: np.zeros(0))
    """(n,) smallest strength of the four faces of each tet, Pa; (0,) if the part does not fracture."""
    hot: Bits = field(default_factory=lambda: np.zeros(0, np.uint8))
    """(n,) overstressed faces: bit k is set if the traction on face k (stress of the tet) is above ``weakest``."""
    flat: Flags = field(default_factory=lambda: np.zeros(0, bool))
    """(n,) True for each flat tet, whose strains are not averaged (elements/flat.py); (0,) if no tet is flat."""
    shear_weight: float = 0.0
    """Weight of the shear traction relative to the normal traction in the fracture criterion."""
    worn: Flags = field(default_factory=lambda: np.zeros(0, bool))
    """(n,) True for each tet that erosion will remove; (0,) if the part does not erode."""
    life: Floats = field(default_factory=lambda: np.zeros(5))
    """Limits beyond which erosion removes a tet (elements/wear.py)."""
    rigid: bool = False
    """True if the part is rigid. Passes over elements omit a rigid part."""
    seconds: float = 0.0
    """Time of the passes over the block, s, if the rank has several blocks: CPU time; wall time on a single rank."""
    group: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(n,) group of each tet (Model.groups); (0,) if loads of groups are not recorded."""
    moved: int = 0
    """Number of tets removed so far. Each removal may move another tet to another chunk."""
    quiet: Ints = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    """(chunks, 3) marks of the chunks that are at rest (elements/rest.py)."""
    own_averages: Tets | None = None
    """(n, 4) indices ``averages`` of the nodal means; None if each node has exactly one mean."""

    @property
    def averages(self) -> Tets:
        """(n, 4) index of the nodal mean to which each corner of a tet contributes (elements/averages.py)."""
        return self.tets if self.own_averages is None else self.own_averages

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return -(-self.n // CHUNK)

    def __post_init__(self) -> None:
        """Creates the views of ``state``. The array object ``state`` is never replaced."""
        self.flat_state: Floats = self.state.reshape(-1)
        """View of the state of all tets as a flat array."""
        self.rows = int(self.state.shape[1])
        """Number of state rows of a tet."""

    def row(self, row: int) -> Floats:
        """Return (n,) a copy of the state row ``row`` of all tets."""
        return np.ascontiguousarray(self.state[:, row, :]).reshape(-1)[: self.n]

    def at(self, row: int, places: "np.ndarray") -> Floats:
        """Return (k,) a copy of the state row ``row`` of the tets ``places`` (k,)."""
        further = (int(self.state.shape[1]) - 1) * CHUNK  # words between two parts of the row
        return np.asarray(self.state.reshape(-1)[places + (places // CHUNK * further + row * CHUNK)])

    def has(self, row: int) -> bool:
        """Return whether the block has the state row ``row``."""
        return row < self.rows

    def exposed(self) -> Flags:
        """Return (n, 4) flags: True for each face that is part of the surface."""
        bare: Flags = self.across < 0
        return bare | (self.bond == WIDE) if len(self.bond) else bare

    def drop(self, gone: Ints) -> Moves:
        """Remove the tets with the local indices ``gone``, ascending. Return the new places of the other tets."""
        moves = Moves.of(self.n, gone)
        for name in _OF_TETS:
            if (table := getattr(self, name)) is not None:
                setattr(self, name, moves.applied(table))
        holes, movers = moves.holes, moves.movers
        self.state[holes // CHUNK, :, holes % CHUNK] = self.state[movers // CHUNK, :, movers % CHUNK]
        self.n, self.quiet[:] = moves.left, 0
        self.moved += len(gone)
        self.border_chunks = min(self.border_chunks, self.chunks)
        return moves


@dataclass
class Model:
    """All bodies of a case on one rank."""

    nodes: Nodes
    blocks: list[Block] = field(default_factory=list)
    parts: list[str] = field(default_factory=list)
    elements_global: int = 0
    """Number of tets on all ranks that are not eroded."""
    nodes_global: int = 0
    """Number of nodes on all ranks; ``StepReduction.nodes`` describes when this number is up to date."""
    part_starts: Ints = field(default_factory=lambda: np.zeros(1, np.int64))
    """(parts,) global id of the first tet of each part."""
    mean_volumes: Floats = field(default_factory=lambda: np.zeros(0))
    """(parts,) mean volume of the tets of each part at the start, m^3."""
    size: float = 0.0
    """Largest absolute coordinate of the whole mesh at the start, m; this value determines the round-off of
    positions."""
    slack: Floats = field(default_factory=lambda: np.zeros(0))
    """(parts,) distance, m, outside of a region at which a node still counts as inside (cases/shapes/region.py)."""
    rounding: Floats = field(default_factory=lambda: np.zeros(0))
    """(parts,) distance, m, from a symmetry plane at which a node still counts as lying on the plane."""
    groups: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    """(groups, 4) centre, m, and number of tets of each group at the start. A group is a set of neighbouring tets for
    which the load is recorded (migration/groups.py). Groups do not depend on the number of ranks."""


def chunked(values: Floats) -> Floats:
    """Return (n,) values in the shape (chunks, CHUNK). The last element fills the rest of the last chunk."""
    chunks = -(-len(values) // CHUNK)
    filled = np.empty(chunks * CHUNK)
    filled[: len(values)] = values
    filled[len(values) :] = values[-1] if len(values) else 1.0
    return filled.reshape(chunks, CHUNK)
