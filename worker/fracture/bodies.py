"""The parts that fracture, as one rank has them: what lies beside each tet, how strong its faces are, who is behind."""

from dataclasses import dataclass

import numpy as np

from conoid.cases.schema import Fracture as Spec

from ..mesh.faces import FACES
from ..mesh.faces import areas as face_areas
from ..parallel.comm import Comm, Exchange
from ..parallel.ownership import Neighbour
from ..parallel.tags import Tag
from ..state import INTACT, MASS, Block, Flags, Floats, Indices, Ints, Tets
from . import criterion
from .strength import Toughness

_BATCH = 10_000
"""Tets that are made ready together, so that it takes no memory to speak of."""
ELSEWHERE = -2
"""Place of a tet that another rank has; -1 where there is none."""


@dataclass
class Body:
    """A block that fractures."""

    index: int
    """Of the block among those of the rank."""
    block: Block
    spec: Spec
    tough: Toughness
    beside: Indices
    """(n, 4) place of the tet behind each face, -1, or ELSEWHERE."""


@dataclass
class Loaded:
    """Intact facets under traction, of one body."""

    places: Indices
    """(m,) on the side of the smaller tet id, if this rank has it; else on the other."""
    faces: Indices
    """(m,)."""
    traction: Floats
    """(m, 4) on the outward normal of the side of the smaller tet id, and the effective one, Pa."""

    def take(self, chosen: "np.ndarray") -> "Loaded":
        """Some of them."""
        return Loaded(self.places[chosen], self.faces[chosen], self.traction[chosen])


def arm(index: int, block: Block, spec: Spec, tough: Toughness, x0: Floats) -> Body:
    """Makes a block ready to fracture, or to go on; ``x0`` (nodes, 3): where its nodes start."""
    block.shear_weight = spec.shear_weight if spec.shear_weight is not None else float(spec.model == "cohesive")
    begins = not len(block.bond)
    if begins:
        block.bond = np.full((block.n, 4), INTACT, np.uint8)
        block.hot = np.zeros(block.n, np.uint8)
        block.weakest = np.empty(block.n)
    beside = np.empty((block.n, 4), np.int32)
    order = np.argsort(block.id)
    known = block.id[order]
    for start in range(0, block.n, _BATCH):
        some = slice(start, start + _BATCH)
        inside = block.across[some] >= 0
        if begins:
            place, face = np.nonzero(inside)
            strengths = np.full(inside.shape, np.inf)
            strengths[inside] = tough.strengths(
                facet_ids(block, start + place, face), areas(block.tets, start + place, face, x0)
            )
            block.weakest[some] = strengths.min(axis=1)
        behind = block.across[some] // 4
        at = order[np.minimum(np.searchsorted(known, behind), block.n - 1)]
        beside[some] = np.where(inside, np.where(block.id[at] == behind, at, ELSEWHERE), -1)
    return Body(index, block, spec, tough, beside)


def facet_ids(block: Block, places: "np.ndarray", faces: "np.ndarray") -> Ints:
    """(m,) ids of facets, on the side of the smaller tet id."""
    return np.asarray(np.minimum(4 * block.id[places] + faces, block.across[places, faces]))


def sides_of(block: Block, facets: Ints) -> tuple[Ints, Ints]:
    """Which of ``facets`` (m,), by ascending id, have a side in the block, and the id of the tet there: (k,) each."""
    place, face = np.nonzero(np.isin(block.across, facets) | np.isin(block.id, facets // 4)[:, None])
    ids = facet_ids(block, place, face)
    at = np.minimum(np.searchsorted(facets, ids), max(len(facets) - 1, 0))
    met = facets[at] == ids if len(facets) else np.zeros(len(ids), bool)
    return at[met], block.id[place[met]]


def areas(tets: Tets, places: "np.ndarray", faces: "np.ndarray", x: Floats) -> Floats:
    """(m,) areas of faces, m^2: the same bits from either side."""
    return face_areas(x, np.sort(tets[places[:, None], FACES[faces]].astype(np.int64), axis=1))


def look(body: Body, x: Floats) -> Loaded:
    """The facets within this rank that may pass."""
    block = body.block
    hot = np.flatnonzero(block.hot)
    sides, traction = np.empty((4 * len(hot) + 1, 2), np.int32), np.empty((4 * len(hot) + 1, 4))
    n = criterion.look(
        sides, traction, hot, block.hot, block.bond, block.across, body.beside, block.id, block.tets,
        block.state.reshape(-1), x, block.weakest, block.state.shape[1], block.shear_weight, body.spec.friction,
    )  # fmt: skip
    return Loaded(sides[:n, 0].copy(), sides[:n, 1].copy(), traction[:n].copy())


class Far:
    """Facets whose two tets are on different ranks: their tractions are exchanged."""

    def __init__(self, bodies: list[Body], neighbours: list[Neighbour], comm: Comm) -> None:
        """All ranks take part."""
        rows = [np.zeros((0, 5), np.int64)]
        for b, body in enumerate(bodies):
            block = body.block
            place, face = np.nonzero(body.beside == ELSEWHERE)
            mass = block.row(MASS)[place].view(np.int64)
            own = 4 * block.id[place] + face
            rows.append(np.column_stack([own, block.across[place, face], mass, place, np.full(len(place), b)]))
        mine = np.concatenate(rows)
        told = comm.swap({other.rank: mine[:, [0, 2]] for other in neighbours}) if comm.size > 1 else {}
        pieces, ranks, masses = [mine[:0]], [], [np.zeros(0, np.int64)]
        for rank, words in told.items():
            theirs = words.reshape(-1, 2)[np.argsort(words.reshape(-1, 2)[:, 0])]
            at = np.minimum(np.searchsorted(theirs[:, 0], mine[:, 1]), max(len(theirs) - 1, 0))
            met = theirs[at, 0] == mine[:, 1] if len(theirs) else np.zeros(len(mine), bool)
            chosen = mine[met]
            order = np.argsort(chosen[:, :2].min(axis=1))
            pieces.append(chosen[order])
            masses.append(theirs[at[met], 1][order])
            ranks.append((rank, len(chosen)))
        table = np.concatenate(pieces)
        self._of_body: list[Ints] = [np.flatnonzero(table[:, 4] == b) for b in range(len(bodies))]
        self.sides: Indices = np.column_stack([table[:, 3], table[:, 0] % 4]).astype(np.int32)
        """(m, 2) place and face of this rank's tet."""
        self.first: Flags = table[:, 0] < table[:, 1]
        """(m,) whether this rank has the side of the smaller tet id."""
        self.mass: Floats = np.concatenate(masses).view(np.float64)
        """(m,) of the other rank's tet, kg."""
        self._bodies = bodies
        self._own, self._theirs = np.zeros((len(table), 3)), np.zeros((len(table), 3))
        ends = np.cumsum([0, *(n for _, n in ranks)])
        cuts = [(rank, slice(a, b)) for (rank, n), a, b in zip(ranks, ends[:-1], ends[1:], strict=True) if n]
        self._exchange: Exchange = comm.exchange(
            [(rank, self._own[cut].view(np.int64)) for rank, cut in cuts],
            [(rank, self._theirs[cut].view(np.int64)) for rank, cut in cuts],
            Tag.TRACTION,
        )

    def look(self, x: Floats) -> list[tuple[Loaded, Ints]]:
        """For every body its facets that may pass, and which of this table's they are; neighbours take part."""
        for body, chosen in zip(self._bodies, self._of_body, strict=True):
            block = body.block
            criterion.own_tractions(
                self._own, chosen, self.sides, self.first, block.bond, block.tets, block.state.reshape(-1), x,
                block.state.shape[1],
            )  # fmt: skip
        self._exchange.begin()
        self._exchange.finish()
        return [self._meet(body, chosen, x) for body, chosen in zip(self._bodies, self._of_body, strict=True)]

    def _meet(self, body: Body, chosen: Ints, x: Floats) -> tuple[Loaded, Ints]:
        block, traction, at = body.block, np.empty((len(chosen) + 1, 4)), np.empty(len(chosen) + 1, np.int64)
        n = criterion.meet(
            at, traction, chosen, self._own, self._theirs, self.sides, self.first, block.bond, block.tets, x,
            block.weakest, block.shear_weight, body.spec.friction,
        )  # fmt: skip
        at = at[:n]
        sides = self.sides[at]
        return Loaded(sides[:, 0].copy(), sides[:, 1].copy(), traction[:n]), at

    def free(self) -> None:
        """Gives the messages back to MPI."""
        self._exchange.free()
