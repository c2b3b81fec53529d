"""Contact domain: the faces and edges of this rank that other ranks need as ghosts.

The method ``box`` compares bounding boxes (Paik et al.): a face or edge is sent to every rank whose box of nodes and
edges it touches. The method ``arbitrary`` adds a second exchange (the paper's eqs 5 to 16, in three dimensions): the
other rank sends the cells of its nodes and edges, and receives only the faces and edges that touch one of these cells.
Only surface nodes are entered in cells, so every occupied cell is an outside cell, and the paper's test of a cell's
neighbours is not needed.
"""

import numpy as np

from ...kernels.jit import njit
from ...model.state import Flags, Floats
from ...parallel.comm import Comm
from .boxes import Boxes
from .buckets import bucket_at

_NONE = np.zeros(0, np.int64)


def choose(kind: str, askers: Boxes, things: list[Boxes], edge: float, comm: Comm) -> dict[int, list[Flags]]:
    """Returns, for every other rank that needs some of this rank's ``things``, flags of the needed faces and edges.

    ``askers``: boxes of this rank's nodes and edges; ``edge``: edge length of a cell, m, equal on all ranks.
    """
    mine = np.concatenate([askers.hull, np.minimum.reduce([t.hull for t in things])])
    hulls = comm.join(mine.view(np.int64)).view(np.float64).reshape(comm.size, 2, 6)
    asks, offers = hulls[:, 0], hulls[:, 1]
    near = {rank: [t.touching(asks[rank]) for t in things] for rank in _touching(offers[comm.rank], asks, comm)}
    if kind == "arbitrary":
        asked = {rank: askers.touching(offers[rank]) for rank in _touching(asks[comm.rank], offers, comm)}
        near = _in_cells(near, askers, asked, things, edge, comm)
    return {rank: flags for rank, flags in near.items() if any(f.any() for f in flags)}


def _touching(hull: Floats, hulls: Floats, comm: Comm) -> list[int]:
    """Other ranks whose hull in ``hulls`` (ranks, 6) touches the hull of this rank."""
    touch = np.all((hulls[:, :3] <= -hull[3:]) & (-hulls[:, 3:] >= hull[:3]), axis=1)
    touch[comm.rank] = False
    found: list[int] = np.flatnonzero(touch).tolist()
    return found


def _in_cells(
    near: dict[int, list[Flags]], askers: Boxes, asked: dict[int, Flags], things: list[Boxes], edge: float, comm: Comm
) -> dict[int, list[Flags]]:
    """Returns the boxes that touch a cell in the list of the other rank; other boxes are removed. ``asked``: boxes of
    this rank that are near each rank.
    """
    cells = comm.swap({
        rank: np.sort(_cells(askers.low, askers.high, some, edge)) for rank, some in asked.items() if some.any()
    })  # fmt: skip
    return {
        rank: [_named(flag, thing.low, thing.high, cells.get(rank, _NONE), edge)
               for flag, thing in zip(flags, things, strict=True)]
        for rank, flags in near.items()
    }  # fmt: skip


@njit("int64(float64, float64)", cache=True)
def _cell(x, edge):  # type: ignore[no-untyped-def]
    """Index along an axis of the cell that contains a coordinate."""
    return np.int64(np.floor(x / edge))


@njit("int64(int64, int64, int64)", cache=True)
def _code(ix, iy, iz):  # type: ignore[no-untyped-def]
    """Returns the code of a cell. Two cells have equal codes only if they are 2^20 cells apart. The only effect of
    equal codes is that an unneeded ghost is sent.
    """
    return (ix << 42) + (iy << 21) + iz


@njit("int64[::1](float64[:, ::1], float64[:, ::1], boolean[::1], float64)", cache=True)
def _cells(low, high, some, edge):  # type: ignore[no-untyped-def]
    """Returns the codes of all cells that the boxes ``some`` touch; each code is returned once."""
    bits, n = 6, 0
    codes, used, found = np.empty(1 << bits, np.int64), np.zeros(1 << bits, np.bool_), np.empty(1 << bits, np.int64)
    for j in range(len(low)):
        if not some[j]:
            continue
        for ix in range(_cell(low[j, 0], edge), _cell(high[j, 0], edge) + 1):
            for iy in range(_cell(low[j, 1], edge), _cell(high[j, 1], edge) + 1):
                for iz in range(_cell(low[j, 2], edge), _cell(high[j, 2], edge) + 1):
                    code = _code(ix, iy, iz)
                    at = _place(codes, used, code, bits)
                    if used[at]:
                        continue
                    codes[at], used[at], found[n] = code, True, code
                    n += 1
                    if 2 * n > len(codes):
                        bits += 1
                        codes, used = np.empty(1 << bits, np.int64), np.zeros(1 << bits, np.bool_)
                        found = np.concatenate((found, np.empty(len(found), np.int64)))
                        for k in range(n):
                            at = _place(codes, used, found[k], bits)
                            codes[at], used[at] = found[k], True
    return found[:n].copy()


@njit("int64(int64[::1], boolean[::1], int64, int64)", cache=True)
def _place(codes, used, code, bits):  # type: ignore[no-untyped-def]
    """Position of a code in a hash table of 2^bits entries. If the code is missing, the result is the position of the
    free entry for it. The search begins at the entry of the hash of the code, and ends at the first entry that is free
    or has the code.
    """
    at = bucket_at(code, bits)
    while used[at] and codes[at] != code:
        at = (at + 1) % len(codes)
    return at


@njit("boolean[::1](boolean[::1], float64[:, ::1], float64[:, ::1], int64[::1], float64)", cache=True)
def _named(flags, low, high, cells, edge):  # type: ignore[no-untyped-def]
    """Returns the flagged boxes that touch one of the ``cells``, which are ascending codes."""
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
