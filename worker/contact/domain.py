"""The contact domain: which faces and edges of this rank another rank must see.

``box`` compares bounding boxes (Paik et al.): a thing goes to every rank whose box of nodes and edges it touches.
``arbitrary`` asks once more (the paper's eqs 5 to 16, in three dimensions): the other rank names the cells that its
nodes and edges lie in, and gets what touches one of them. Since only nodes of the surface are entered, every
occupied cell is an outside cell already, and the paper's test of a cell's neighbours has nothing left to do.
"""

import numpy as np

from ..parallel.comm import Comm
from ..state import Flags, Floats, Ints
from .buckets import grid
from .search import Boxes


def choose(kind: str, askers: Boxes, things: list[Boxes], edge: float, comm: Comm) -> dict[int, list[Flags]]:
    """For every other rank that needs some: which of each list of this rank's ``things`` go there.

    ``askers`` are the boxes of this rank's nodes and edges; ``edge`` that of a cell, m, equal on all ranks.
    """
    hulls = comm.share((askers.hull, np.minimum.reduce([t.hull for t in things])))
    near = {
        rank: [t.touching(asker) for t in things] for rank, (asker, _) in enumerate(hulls) if rank != comm.rank
    }  # fmt: skip
    if kind == "arbitrary":
        near = _in_cells(near, askers, things, [offer for _, offer in hulls], edge, comm)
    return {rank: flags for rank, flags in near.items() if any(f.any() for f in flags)}


def _in_cells(
    near: dict[int, list[Flags]], askers: Boxes, things: list[Boxes], offers: list[Floats], edge: float, comm: Comm
) -> dict[int, list[Flags]]:
    """Keeps what touches a cell that the other rank has named."""
    asked = {rank: askers.touching(offers[rank]) for rank in near}
    cells = comm.swap({
        rank: np.unique(_codes(_cells(askers.take(a), edge)[1]))
        for rank, a in asked.items() if a.any()
    })  # fmt: skip
    kept = {}
    for rank, flags in near.items():
        named = cells.get(rank, np.zeros(0, np.int64))
        kept[rank] = [_named(f, t, named, edge) for f, t in zip(flags, things, strict=True)]
    return kept


def _named(flags: Flags, things: Boxes, cells: Ints, edge: float) -> Flags:
    """Which of the flagged ``things`` touch one of ``cells``, codes in ascending order."""
    result = np.zeros(len(flags), bool)
    if len(cells):
        who, mine = _cells(things.take(flags), edge)
        codes = _codes(mine)
        hit = cells[np.minimum(np.searchsorted(cells, codes), len(cells) - 1)] == codes
        result[np.flatnonzero(flags)[who[hit]]] = True
    return result


def _codes(cells: Ints) -> Ints:
    """Cells (n, 3) as one number each. Two have the same only if they are 2^20 cells apart: then a thing is sent that
    is not needed.
    """
    return np.asarray((cells[:, 0] << 42) + (cells[:, 1] << 21) + cells[:, 2])


def _cells(boxes: Boxes, edge: float) -> tuple[Ints, Ints]:
    """Index of the box and the cell (3,) for every cell that every box touches."""
    first = np.floor(boxes.low / edge).astype(np.int64)
    counts = np.floor(boxes.high / edge).astype(np.int64) - first + 1
    who, index = grid(counts)
    return who, first[who] + index
