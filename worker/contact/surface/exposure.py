"""What erosion lays bare comes to the surface without a search.

A tet that has strained by a share of what it lives through is tiring. A search takes up the faces of other tets that it
covers, as it takes up the sides of cracks: with their nodes, for all ranks near them, but they meet nothing. When the
tet leaves they are exposed in the same step. Only a tet that was not tiring at the last search, such as one that turns
inside out early, calls for a search of all ranks.
"""

from typing import NamedTuple

import numpy as np

from ...elements.wear import DAMAGED, STRAIN
from ...mesh.faces import FACES
from ...model.ids import among
from ...model.rows import DAMAGE, PLASTIC_STRAIN
from ...model.state import LAID_BARE, Block, Flags, Indices, Ints
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour

TIRING = 0.5
"""Of the plastic strain or the damage at which a tet leaves. Of the tets that left in the long rod to 20 us, 1.6 to
5.7 % had not reached it 50 to 200 steps before (counted by hand)."""
WORDS = 9
"""Of a tet that leaves: its id, what was across its faces (state.Block.across), and its nodes."""


class Exposure(NamedTuple):
    """What tets of all ranks leave behind; ids, ascending."""

    gone: Ints
    """Of their faces."""
    bare: Ints
    """Of the faces behind them."""
    nodes: Ints
    """Of these."""


def tiring(blocks: list[Block]) -> Ints:
    """Ids, ascending, of the tets here that may leave soon."""
    found = [np.zeros(0, np.int64)]
    for block in blocks:
        tired = np.zeros(block.n, bool)
        for row, limit in ((PLASTIC_STRAIN, block.life[STRAIN]), (DAMAGE, block.life[DAMAGED])):
            if len(block.worn) and block.has(row) and limit < np.inf:
                tired |= block.row(row) > TIRING * limit
        found.append(block.id[tired])
    return np.sort(np.concatenate(found))


def covered(blocks: list[Block], tired: Ints, neighbours: list[Neighbour], comm: Comm) -> Indices:
    """(k, 3) block, place and face of those of this rank's tets that ``tired`` ones, here or at the neighbours, cover;
    all ranks take part.
    """
    told = comm.swap({other.rank: tired for other in neighbours})
    every = np.unique(np.concatenate([tired, *told.values()]))
    sides = [np.zeros((0, 3), np.int32)]
    for b, block in enumerate(blocks):
        rows, faces = np.nonzero((block.across >= 0) & among(every, block.across // 4))
        sides.append(np.column_stack([np.full(len(rows), b), rows, faces]).astype(np.int32))
    return np.concatenate(sides)


def leaving(block: Block, worn: Ints, ids: Ints) -> Ints:
    """(k, WORDS) rows of the tets at ``worn`` (k,); ``ids``: of the local nodes."""
    return np.column_stack([block.id[worn], block.across[worn], ids[block.tets[worn]]])


def laid(rows: Ints) -> Exposure:
    """What the tets of all ``rows`` (k, WORDS) leave behind."""
    gone = np.sort((4 * rows[:, :1] + np.arange(4)).reshape(-1))
    behind, nodes = rows[:, 1:5], rows[:, 5:][:, FACES]
    bare: Flags = (behind >= 0) & ~among(gone, behind)
    return Exposure(gone, np.sort(behind[bare]), np.unique(nodes[bare]))


def lay(blocks: list[Block], bare: Ints) -> None:
    """Those of the faces ``bare``, ids, ascending, that are here have nothing across any more."""
    tets = np.unique(bare // 4)
    for block in blocks:
        rows = np.flatnonzero(among(tets, block.id))
        faces = 4 * block.id[rows][:, None] + np.arange(4)
        block.across[rows] = np.where(among(bare, faces), LAID_BARE, block.across[rows])
