"""The contact domain: which faces and edges of this rank another rank must see.

``box`` compares bounding boxes (Paik et al.): a thing goes to every rank whose box of nodes and edges it touches.
``arbitrary`` asks once more (the paper's eqs 5 to 16, in three dimensions): the other rank names the cells that its
nodes and edges lie in, and gets what touches one of them. Since only nodes of the surface are entered, every
occupied cell is an outside cell already, and the paper's test of a cell's neighbours has nothing left to do.
"""

import numpy as np

from ..jit import njit
from ..parallel.comm import Comm
from ..state import Flags, Floats
from .search import Boxes

_NONE = np.zeros(0, np.int64)


def choose(kind: str, askers: Boxes, things: list[Boxes], edge: float, comm: Comm) -> dict[int, list[Flags]]:
    """For every other rank that needs some: which of each list of this rank's ``things`` go there.

    ``askers`` are the boxes of this rank's nodes and edges; ``edge`` that of a cell, m, equal on all ranks.
    """
    mine = np.concatenate([askers.hull, np.minimum.reduce([t.hull for t in things])])
    hulls = comm.join(mine.view(np.int64)).view(np.float64).reshape(comm.size, 2, 6)
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
        rank: np.unique(_cells(askers.low, askers.high, some, edge)) for rank, some in asked.items() if some.any()
    })  # fmt: skip
    return {
        rank: [_named(flag, thing.low, thing.high, cells.get(rank, _NONE), edge)
               for flag, thing in zip(flags, things, strict=True)]
        for rank, flags in near.items()
    }  # fmt: skip


@njit("int64(float64, float64)", cache=True)
def _cell(x, edge):  # type: ignore[no-untyped-def]
    """Index along an axis of the cell that a coordinate lies in."""
    return np.int64(np.floor(x / edge))


@njit("int64(int64, int64, int64)", cache=True)
def _code(ix, iy, iz):  # type: ignore[no-untyped-def]
    """A cell as one number. Two have the same only if they are 2^20 cells apart: then a thing is sent that is not
    needed.
    """
    return (ix << 42) + (iy << 21) + iz


@njit("int64[::1](float64[:, ::1], float64[:, ::1], boolean[::1], float64)", cache=True)
def _cells(low, high, some, edge):  # type: ignore[no-untyped-def]
    """The code of every cell that each of ``some`` boxes touches; one box after the other, so many stand twice."""
    many, before = 0, 0
    for j in range(len(low)):
        if some[j]:
            cells = 1
            for i in range(3):
                cells *= _cell(high[j, i], edge) - _cell(low[j, i], edge) + 1
            many += cells
    codes, n = np.empty(many, np.int64), 0
    for j in range(len(low)):
        if not some[j]:
            continue
        for ix in range(_cell(low[j, 0], edge), _cell(high[j, 0], edge) + 1):
            for iy in range(_cell(low[j, 1], edge), _cell(high[j, 1], edge) + 1):
                for iz in range(_cell(low[j, 2], edge), _cell(high[j, 2], edge) + 1):
                    code = _code(ix, iy, iz)
                    if n == 0 or code != before:
                        codes[n], before = code, code
                        n += 1
    return codes[:n].copy()


@njit("boolean[::1](boolean[::1], float64[:, ::1], float64[:, ::1], int64[::1], float64)", cache=True)
def _named(flags, low, high, cells, edge):  # type: ignore[no-untyped-def]
    """Which of the flagged boxes touch one of ``cells``, codes in ascending order."""
    kept = np.zeros(len(flags), np.bool_)
    if len(cells) == 0:
        return kept
    for j in range(len(flags)):
        if not flags[j]:
            continue
        for ix in range(_cell(low[j, 0], edge), _cell(high[j, 0], edge) + 1):
            for iy in range(_cell(low[j, 1], edge), _cell(high[j, 1], edge) + 1):
                first = _code(ix, iy, _cell(low[j, 2], edge))
                at = np.searchsorted(cells, first)
                if at < len(cells) and cells[at] <= _code(ix, iy, _cell(high[j, 2], edge)):
                    kept[j] = True
    return kept
