"""Sums over shared nodes, for any ranks with contacts and any ranks that have a node."""

import numpy as np
import pytest

from conoid.worker.contact.narrow_phase.rows import ActiveRows
from conoid.worker.contact.narrow_phase.tables import ContactRows
from conoid.worker.contact.solver.shared_sums import SharedSums
from conoid.worker.parallel.comm import Comm
from conoid.worker.parallel.ownership import Neighbour

from .ranks import on_ranks

NODES, RANKS = 400, 4


def scene(seed: int) -> tuple["np.ndarray", "np.ndarray", "np.ndarray"]:
    """Returns three arrays (ranks, nodes). The arrays are: ranks that may have a contact of a node or have the node;
    ranks that have the node; ranks that have a contact in this step.
    """
    draw = np.random.default_rng(seed)
    held = draw.uniform(size=(RANKS, NODES)) < 0.3
    known = held | (draw.uniform(size=(RANKS, NODES)) < 0.4)
    return known, held, known & (draw.uniform(size=(RANKS, NODES)) < (0.0 if seed == 0 else 0.2))


@pytest.mark.parametrize("seed", range(5))
def test_ranks_that_need_a_sum_have_it_and_nothing_else_is_sent(seed: int) -> None:
    known, held, pushed = scene(seed)
    given = np.random.default_rng(seed + 10).integers(-(2**40), 2**40, (RANKS, NODES, 3)) * pushed[:, :, None]

    def rank(comm: Comm) -> tuple["np.ndarray", int]:
        me = comm.rank
        slots = np.random.default_rng(me).permutation(NODES).astype(np.int32)
        """Local numbers of the nodes; the numbers differ between ranks."""
        both = [np.flatnonzero(known[me] & known[other]) for other in range(RANKS)]
        company = SharedSums([Neighbour(k, slots[both[k]]) for k in range(RANKS) if k != me], comm)
        local = np.full(NODES, -1, np.int32)
        local[slots[held[me]]] = 0
        contacts = np.repeat(slots[pushed[me]][:, None], 4, axis=1)
        comm.sent.since_last()
        n = len(contacts)
        rows = ActiveRows(ContactRows.room(n)._replace(nodes=contacts), np.arange(n, dtype=np.int32), n=n)
        agreed = company.agree(rows, local)
        bytes_sent = comm.sent.since_last()["bytes"]
        agreed.number(np.arange(NODES, dtype=np.int32))
        words = np.zeros((NODES, 5), np.int64)
        words[slots, 1:4] = given[me]
        for _ in range(2):
            again = words.copy()
            agreed.begin(again, 1, 3)
            agreed.finish(again, 1, 3)
        sent = sum((pushed[me] & known[me] & known[k] & (pushed[k] | held[k])).sum() for k in range(RANKS) if k != me)
        assert comm.sent.since_last()["bytes"] == 2 * sent * 4 * 8
        assert bytes_sent == sum(2 * 8 * 4 * (1 + len(both[k]) // (4 * 63)) for k in range(RANKS) if k != me)
        assert not again[:, [0, 4]].any()
        assert np.array_equal(np.unique(agreed.shared), np.unique(slots[_concerned(known, held, pushed, me)]))
        return again[slots, 1:4], sent

    results = on_ranks(RANKS, rank)
    total = given.sum(axis=0)
    for me, (sums, _) in enumerate(results):
        wanted = pushed[me] | held[me]
        assert np.array_equal(sums[wanted], total[wanted])
    assert (sum(sent for _, sent in results) > 0) == bool(pushed.any())


def _concerned(known: "np.ndarray", held: "np.ndarray", pushed: "np.ndarray", me: int) -> "np.ndarray":
    """Returns (nodes,) whether this rank sends or receives the sum of each node."""
    concerned = np.zeros(NODES, bool)
    for other in range(RANKS):
        if other != me:
            sent = pushed[me] & (pushed[other] | held[other])
            received = pushed[other] & (pushed[me] | held[me])
            concerned |= known[me] & known[other] & (sent | received)
    return concerned
