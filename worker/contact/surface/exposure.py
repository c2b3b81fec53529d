"""Exposure of faces by erosion: faces of the neighbours of eroded tets become surface without a search.

A tet is near erosion if its strain or damage is above a certain fraction of its limit. A search includes the inner
faces of tets near erosion in the same way as the sides of cracks: with their nodes, on all ranks near the faces, but
without candidate pairs. When the tet erodes, the faces of its neighbours are exposed in the same step. A search of all
ranks is needed only if a tet erodes that was not near erosion at the last search, for example by early inversion.
"""

from typing import NamedTuple

import numpy as np

from ...elements.wear import DAMAGED, STRAIN
from ...mesh.faces import FACES
from ...model.ids import among
from ...model.rows import DAMAGE, PLASTIC_STRAIN
from ...model.state import LAID_BARE, WIDE, Block, Flags, Indices, Ints
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour

NEAR_EROSION = 0.5
"""Fraction of the limit of plastic strain or damage above which a tet is near erosion. In one run of the case long_rod
to 20 us, 1.6 to 5.7 % of the eroded tets were not near erosion 50 to 200 steps before they eroded."""
WORDS = 9
"""Number of words of a message about a tet that erodes: its id, the faces across (state.Block.across), and its
nodes."""


class Exposure(NamedTuple):
    """Faces that the erosion of tets of all ranks exposes; they are given by ids, ascending."""

    gone: Ints
    """Ids of the faces of the eroded tets."""
    bare: Ints
    """Ids of the faces of other tets that coincide with the faces of eroded tets."""
    nodes: Ints
    """Ids of the nodes of all exposed faces."""


def near_erosion(blocks: list[Block]) -> Ints:
    """Ids, ascending, of the local tets that are near erosion."""
    found = [np.zeros(0, np.int64)]
    for block in blocks:
        tired = np.zeros(block.n, bool)
        for row, limit in ((PLASTIC_STRAIN, block.life[STRAIN]), (DAMAGE, block.life[DAMAGED])):
            if len(block.worn) and block.has(row) and limit < np.inf:
                tired |= block.row(row) > NEAR_EROSION * limit
        found.append(block.id[tired])
    return np.sort(np.concatenate(found))


def covered(blocks: list[Block], tired: Ints, neighbours: list[Neighbour], comm: Comm) -> Indices:
    """(k, 3) block, row and face of faces of this rank's tets. The faces are those behind tets near erosion. ``tired``:
    tets near erosion on this rank and its neighbours. Collective.
    """
    received = comm.swap({other.rank: tired for other in neighbours})
    every = np.unique(np.concatenate([tired, *received.values()]))
    sides = [np.zeros((0, 3), np.int32)]
    for b, block in enumerate(blocks):
        rows, faces = np.nonzero((block.across >= 0) & among(every, block.across // 4))
        sides.append(np.column_stack([np.full(len(rows), b), rows, faces]).astype(np.int32))
    return np.concatenate(sides)


def leaving(block: Block, worn: Ints, ids: Ints) -> Ints:
    """(k, WORDS) words of the tets in the rows ``worn`` (k,), which erode. ``ids``: global ids of the local nodes. A
    face across an open crack has the word -1, because the face is surface already.
    """
    behind = np.where(block.bond[worn] == WIDE, -1, block.across[worn]) if len(block.bond) else block.across[worn]
    return np.column_stack([block.id[worn], behind, ids[block.tets[worn]]])


def exposed_by(rows: Ints) -> Exposure:
    """Returns the faces that the erosion of tets exposes. ``rows`` (k, WORDS): eroding tets of all ranks."""
    gone = np.sort((4 * rows[:, :1] + np.arange(4)).reshape(-1))
    behind, nodes = rows[:, 1:5], rows[:, 5:][:, FACES]
    bare: Flags = (behind >= 0) & ~among(gone, behind)
    return Exposure(gone, np.sort(behind[bare]), np.unique(nodes[bare]))


def expose(blocks: list[Block], bare: Ints) -> None:
    """Marks local faces as exposed by erosion. ``bare``: ids of the exposed faces, ascending."""
    tets = np.unique(bare // 4)
    for block in blocks:
        rows = np.flatnonzero(among(tets, block.id))
        faces = 4 * block.id[rows][:, None] + np.arange(4)
        block.across[rows] = np.where(among(bare, faces), LAID_BARE, block.across[rows])
