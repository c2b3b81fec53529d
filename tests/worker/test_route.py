"""Ranks of the boxes of a new cut: a box is assigned to the rank that already has most of the box."""

import numpy as np
import pytest

from conoid.worker.migration.parcel import Parcel
from conoid.worker.migration.route import route
from conoid.worker.parallel.comm import Comm

from ..contact.ranks import on_ranks

TETS = 240
ALONG = (1.0, 0.01, 0.01)
"""Scale of space with which cuts are normal to x."""


def parcel(mine: list[int]) -> Parcel:
    """Returns separate tets in a row, with the ids ``mine`` and equal weights."""
    ids = np.array(mine, np.int64)
    corners = 4 * ids[:, None] + np.arange(4)
    nodes = corners.reshape(-1)
    x = np.column_stack([nodes // 4, nodes % 4, (nodes * 7) % 5]).astype(float)
    weight = np.tile([1.0, 0.0, 0.0], (len(ids), 1))
    return Parcel(nodes={"id": nodes, "x": x}, tets={0: {"id": ids, "corners": corners, "weight": weight}})


@pytest.mark.parametrize("ranks", [2, 3, 5])
@pytest.mark.parametrize("shift", [0, 1, 7])
def test_balanced_loads_are_not_moved(ranks: int, shift: int) -> None:
    """No tets move, for any assignment of the slabs of the row to ranks. If slabs are wrong by some tets, only the
    wrong tets are moved."""
    order = np.random.default_rng(3).permutation(ranks)
    slab = np.minimum((np.arange(TETS) + shift) * ranks // TETS, ranks - 1)

    def cut(comm: Comm) -> tuple[int, set[int]]:
        arrived = route(parcel(np.flatnonzero(order[slab] == comm.rank).tolist()), ALONG, comm)
        return arrived.moved[0], set(arrived.parcel.tets[0]["id"].tolist())

    found = on_ranks(ranks, cut)
    assert sum(moved for moved, _ in found) == shift * (ranks - 1)
    for rank, (_, ids) in enumerate(found):
        first = TETS // ranks * int(np.flatnonzero(order == rank)[0])
        assert ids == set(range(first, first + TETS // ranks))
