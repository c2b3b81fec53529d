"""Order of breaking ``local_maximum``: a facet breaks only if no facet at its nodes is loaded more strongly.

In a uniform stress field all facets reach the criterion in the same step, although the first broken facet would relieve
its neighbours. With ``local_maximum`` a facet does not break in a step if another facet that passes the criterion
shares a node with it and has a larger load.
"""

import numpy as np

from ..model.state import Flags, Floats, Indices, Ints
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour


def strongest(facets: Ints, load: Floats, nodes: Indices, ids: Ints, neighbours: list[Neighbour], comm: Comm) -> Flags:
    """(m,) whether each facet has the largest load at all of its nodes. If two loads are equal, the load of the facet
    with the smaller id counts as larger.

    ``facets`` (m,): ids of the facets; ``load`` (m,): ratio of traction to strength, positive; ``nodes`` (m, 3): local
    nodes; ``ids`` (nodes,): global ids. Collective.
    """
    order = -np.ascontiguousarray(load).view(np.int64)
    mine = np.column_stack([ids[nodes].reshape(-1), np.repeat(order, 3), np.repeat(facets, 3)])
    sent = {}
    for other in neighbours:
        sent[other.rank] = mine[np.isin(mine[:, 0], ids[other.nodes])]
    received = comm.swap(sent) if comm.size > 1 else {}
    rows = np.concatenate([mine, *(words.reshape(-1, 3) for words in received.values())])
    rows = rows[np.lexsort((rows[:, 2], rows[:, 1], rows[:, 0]))]
    known, first = np.unique(rows[:, 0], return_index=True)
    best = rows[first, 2]
    return np.asarray((best[np.searchsorted(known, ids[nodes])] == facets[:, None]).all(axis=1))
