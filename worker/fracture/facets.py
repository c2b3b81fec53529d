"""Facets of the parts that fracture, on one rank. The facets are stored in a table over the faces of the tets of each
body.
"""

from dataclasses import dataclass

import numpy as np

from conoid.cases.model.schema import Fracture as Spec

from ..migration.parcel import Table
from ..model.ids import IdIndex
from ..model.moves import Moves
from ..model.state import INTACT, Bits, Block, Flags, Floats, Indices, Ints
from ..model.topology import Split
from . import criterion
from .records import FacetTable, Law, Mesh
from .strength import Toughness

_BATCH = 10_000
"""Number of tets that are initialised in one call; the number limits the temporary memory."""
ELSEWHERE = -2
"""Value that replaces the place of a tet that is on another rank. (The value -1 means that there is no tet.)"""


@dataclass
class Body:
    """The facets of a block of tets that break by one law: either all facets between tets of the block, or all facets
    between the block and another part that a bond joins.
    """

    index: int
    """Index of the block of tets among the blocks of the rank."""
    block: Block
    spec: Spec
    tough: Toughness
    behind: tuple[int, int]
    """Range of the global ids of the tets on the other side of the facets: first id, and last id plus 1."""
    mesh: Mesh
    facets: FacetTable
    """The tets of the block. The record is shared by all bodies of the block; the same is true for the record
    ``facets``."""
    law: Law
    own: bool = True
    """True if the two tets of each facet are in the same part."""

    def has(self, across: Indices) -> Flags:
        """Returns a flag for each face: True if the face is a facet of this body. ``across``: neighbour tets of the
        faces.
        """
        return np.asarray((across >= 4 * self.behind[0]) & (across < 4 * self.behind[1]))

    @property
    def hot(self) -> Bits:
        """(n,) marks of overstressed faces, see Block.hot. The array is empty if the facets of the body are between two
        parts.
        """
        return self.block.hot if self.own else self.block.hot[:0]

    def set_strengths(self, places: Ints, x0: Floats) -> None:
        """Sets the strengths, Pa, of all facets of the body at the tets ``places`` (k,); ``x0`` (nodes, 3): initial
        positions.
        """
        here, face = np.nonzero(self.has(self.block.across[places]))
        place = places[here]
        area = criterion.areas(self.mesh.tets, place, np.ascontiguousarray(face), x0)
        self.facets.strength[place, face] = self.tough.strengths(facet_ids(self.block, place, face), area)

    def follow(self, split: Split, x0: Floats) -> None:
        """Computes the strengths that depend on areas again, for facets at the tets whose nodes separated. The order of
        the nodes of a face changes the last bit of its area. A run that resumes from a checkpoint has only the present
        order of the nodes.
        """
        scatter = self.tough.scatter
        if scatter is not None and scatter.area is not None:
            self.set_strengths(np.unique(split.place[split.block == self.index]).astype(np.int64), x0)


Terms = tuple[Spec, Toughness, tuple[int, int]]
"""Fracture specification of a body, its constants, and the range of the global ids of the tets on the other side of its
facets."""


def bodies_of(index: int, block: Block, own: Terms, bonds: list[Terms], x0: Floats) -> list[Body]:
    """Adds the arrays for fracture to a block of tets that has none yet. Returns the bodies: one for the ``own`` facets
    within the block, and one for each of its ``bonds``. ``x0`` (nodes, 3): initial positions.
    """
    begins = not len(block.bond)
    if begins:
        block.bond = np.full((block.n, 4), INTACT, np.uint8)
        block.hot = np.zeros(block.n, np.uint8)
    table = FacetTable(np.full((block.n, 4), np.inf), np.zeros((block.n, 4)), np.zeros((block.n, 4), np.int64))
    mesh, bodies = mesh_of(block), list[Body]()
    for spec, tough, behind in (own, *bonds):
        law = Law(shear_weight(spec), spec.friction, tough.delay)
        bodies.append(Body(index, block, spec, tough, behind, mesh, table, law, own=not bodies))
    for body in bodies:
        for start in range(0, block.n, _BATCH):
            body.set_strengths(np.arange(start, min(start + _BATCH, block.n)), x0)
    block.shear_weight = max(body.law.weight for body in bodies)
    if begins:
        block.weakest = table.strength.min(axis=1)
    return bodies


def shear_weight(spec: Spec) -> float:
    """Returns the weight of shear traction relative to normal traction. If no weight is given, the weight is 1 for
    cohesive facets and 0 for other facets.
    """
    return spec.shear_weight if spec.shear_weight is not None else float(spec.model == "cohesive")


def mesh_of(block: Block, beside: Indices | None = None) -> Mesh:
    """Returns the record of a block of tets that the kernels read. ``beside``: column of Mesh; if ``beside`` is None,
    the function finds the tets behind the faces by their ids.
    """
    beside, state = _beside(block) if beside is None else beside, block.state.reshape(-1)
    intact = np.packbits((block.bond == INTACT) & (beside >= 0), axis=1, bitorder="little")[:, 0].copy()
    return Mesh(block.tets, block.id, block.across, beside, block.bond, intact, state, block.state.shape[1])


def without(mesh: Mesh, block: Block, moves: Moves) -> Mesh:
    """Returns the record of a block after the removal of tets; the input is the record before the removal."""
    beside = moves.applied(mesh.beside)
    return mesh_of(block, np.where(beside >= 0, moves.places[beside], beside))


def _beside(block: Block) -> Indices:
    index, beside = IdIndex(block.id), np.empty((block.n, 4), np.int32)
    for start in range(0, block.n, _BATCH):
        some = slice(start, start + _BATCH)
        behind = block.across[some] // 4
        at = index.places(behind)
        beside[some] = np.where(block.across[some] >= 0, np.where(at >= 0, at, ELSEWHERE), -1)
    return beside


def facet_ids(block: Block, places: "np.ndarray", faces: "np.ndarray") -> Ints:
    """(m,) ids of facets: 4 * id of the tet of smaller id + its local face."""
    return np.asarray(np.minimum(4 * block.id[places] + faces, block.across[places, faces]))


def clocks(body: Body, step: int) -> Table:
    """Returns a table of the clocks that ran in step number ``step``. The table has one row for each tet on this rank
    at a facet; the row contains the id of the facet.
    """
    place, face = np.nonzero(body.facets.seen == step)
    since, key, block = body.facets.since[place, face], facet_ids(body.block, place, face), body.block
    other, near = block.across[place, face] // 4, body.mesh.beside[place, face] >= 0
    return {
        "tet": np.concatenate([block.id[place], other[near].astype(np.int64)]),
        "key": np.concatenate([key, key[near]]), "since": np.concatenate([since, since[near]]),
    }  # fmt: skip


def set_clocks(body: Body, table: Table, step: int) -> None:
    """Sets the clocks of step number ``step`` from ``table``, which has the clocks of all bodies."""
    index = IdIndex(body.block.id)
    mine = index.places(table["tet"]) >= 0
    facet, tet = table["key"][mine], table["tet"][mine]
    first = index.places(facet // 4) >= 0
    place = index.places(np.where(first, facet // 4, tet))
    face = np.where(first, facet % 4, np.argmax(body.block.across[place] == facet[:, None], axis=1))
    body.facets.since[place, face], body.facets.seen[place, face] = table["since"][mine], step
