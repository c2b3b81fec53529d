"""The facets of the parts that fracture, as one rank has them: a table over the faces of each body's tets."""

from dataclasses import dataclass

import numpy as np

from conoid.cases.model.schema import Fracture as Spec

from ..migration.parcel import Table
from ..model.ids import among, located, places
from ..model.state import INTACT, Bits, Block, Flags, Floats, Indices, Ints
from ..model.topology import Split
from . import criterion
from .records import FacetTable, Law, Mesh
from .strength import Toughness

_BATCH = 10_000
"""Tets that are made ready together, so that it takes no memory to speak of."""
ELSEWHERE = -2
"""Place of a tet that another rank has; -1 where there is none."""


@dataclass
class Body:
    """Facets of a block that break by one law: those between its own tets, or those to the tets of another part."""

    index: int
    """Of the block among those of the rank."""
    block: Block
    spec: Spec
    tough: Toughness
    behind: tuple[int, int]
    """The tets behind the facets have ids from the first on and below the second."""
    mesh: Mesh
    facets: FacetTable
    """Of the block: the bodies of one have it in common."""
    law: Law
    own: bool = True
    """Whether these are facets within the part."""

    def has(self, across: Indices) -> Flags:
        """Whether faces, by what is ``across`` them, are facets of the body."""
        return np.asarray((across >= 4 * self.behind[0]) & (across < 4 * self.behind[1]))

    @property
    def hot(self) -> Bits:
        """(n,) see Block.hot, where facets are within the part; else (0,)."""
        return self.block.hot if self.own else self.block.hot[:0]

    def set_strengths(self, places: Ints, x0: Floats) -> None:
        """Of all its facets of the tets at ``places`` (k,), Pa; ``x0`` (nodes, 3): initial positions."""
        here, face = np.nonzero(self.has(self.block.across[places]))
        place = places[here]
        area = criterion.areas(self.mesh.tets, place, np.ascontiguousarray(face), x0)
        self.facets.strength[place, face] = self.tough.strengths(facet_ids(self.block, place, face), area)

    def follow(self, split: Split, x0: Floats) -> None:
        """Computes strengths anew that depend on areas, where nodes have become copies: the order of the nodes decides
        on the last bit of an area, and a body that comes from a checkpoint knows the present nodes only.
        """
        scatter = self.tough.scatter
        if scatter is not None and scatter.area is not None:
            self.set_strengths(np.unique(split.place[split.block == self.index]).astype(np.int64), x0)


Terms = tuple[Spec, Toughness, tuple[int, int]]
"""What decides on facets: how they break, their constants, and between which ids the tets behind them are."""


def arm(index: int, block: Block, own: Terms, bonds: list[Terms], x0: Floats) -> list[Body]:
    """Makes a block ready to fracture, or to go on: the bodies of its ``own`` facets and of those of its ``bonds``;
    ``x0`` (nodes, 3): initial positions.
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
    """Of shear against normal traction: what is given, else 1 of cohesive facets and 0 of others."""
    return spec.shear_weight if spec.shear_weight is not None else float(spec.model == "cohesive")


def mesh_of(block: Block) -> Mesh:
    """The tets of a block that has bonds, as kernels take them."""
    beside, state = _beside(block), block.state.reshape(-1)
    intact = np.packbits((block.bond == INTACT) & (beside >= 0), axis=1, bitorder="little")[:, 0].copy()
    return Mesh(block.tets, block.id, block.across, beside, block.bond, intact, state, block.state.shape[1])


def _beside(block: Block) -> Indices:
    order = np.argsort(block.id)
    known, beside = block.id[order], np.empty((block.n, 4), np.int32)
    for start in range(0, block.n, _BATCH):
        some = slice(start, start + _BATCH)
        behind = block.across[some] // 4
        at = places(known, behind)
        beside[some] = np.where(block.across[some] >= 0, np.where(at >= 0, order[at], ELSEWHERE), -1)
    return beside


def facet_ids(block: Block, places: "np.ndarray", faces: "np.ndarray") -> Ints:
    """(m,) ids of facets: 4 * id + local face of the tet of smaller id."""
    return np.asarray(np.minimum(4 * block.id[places] + faces, block.across[places, faces]))


def clocks(body: Body, step: int) -> Table:
    """The clocks that go on after the step of number ``step``: a row a tet that is here, with the id of the facet."""
    place, face = np.nonzero(body.facets.seen == step)
    since, key, block = body.facets.since[place, face], facet_ids(body.block, place, face), body.block
    other, near = block.across[place, face] // 4, body.mesh.beside[place, face] >= 0
    return {
        "tet": np.concatenate([block.id[place], other[near].astype(np.int64)]),
        "key": np.concatenate([key, key[near]]), "since": np.concatenate([since, since[near]]),
    }  # fmt: skip


def wind(body: Body, table: Table, step: int) -> None:
    """Sets the clocks as the step of number ``step`` left them; ``table``: of all bodies."""
    order = np.argsort(body.block.id)
    known = body.block.id[order]
    mine = among(known, table["tet"])
    facet, tet = table["key"][mine], table["tet"][mine]
    first = among(known, facet // 4)
    place = order[located(known, np.where(first, facet // 4, tet))]
    face = np.where(first, facet % 4, np.argmax(body.block.across[place] == facet[:, None], axis=1))
    body.facets.since[place, face], body.facets.seen[place, face] = table["since"][mine], step
