"""Topology changes of a split (node separation) near one rank: changes of the nodes of the rank, and changes of ghosts,
which are received from other ranks.
"""

from dataclasses import dataclass

import numpy as np

from ...kernels.jit import njit
from ...model.state import Indices, Ints
from ...model.topology import Split
from ...parallel.comm import Comm
from ..surface.records import SurfaceNodes
from . import ghosts
from .scene import Scene


@dataclass
class TopologyUpdate:
    """Topology change of one step: new node of each tet, for all nodes and ghosts on a rank."""

    key: Ints
    """(r,) ids of a node and of a tet as one number, ascending."""
    became: Ints
    """(r,) id of the copy that replaces the node in that tet."""
    family: Ints
    """(c, 2) ids of parents, ascending, and of their copies."""
    rows: SurfaceNodes
    """Parents and copies that belong to one message."""


def gather(split: Split, scene: Scene, here: SurfaceNodes, comm: Comm) -> TopologyUpdate | None:
    """Returns None if no node split. ``here``: all nodes of this rank, by local index. Splits of ghosts are received
    from the rank that sends the state of the ghosts; only ranks with such messages take part.
    """
    sources = [other.rank for other in scene.messages.copies.receives if split.touched[other.rank]]
    if not (sources or split.touched[comm.rank]):
        return None
    parents, copies = split.copies.parents, split.first + np.arange(split.copies.n)
    table = np.column_stack([split.key, here.id[split.node]])
    local = np.column_stack([parents, copies]).astype(np.int32)
    messages = _messages(split, scene, here, table, local) if split.touched[comm.rank] else {}
    received = [words for words in comm.trade(messages, sources).values() if len(words)]
    if not (split.copies.n or received):
        return None
    family, rows = here.id[local], here.take(np.unique(local))
    if received:
        for words in received:
            ends = 2 + 2 * np.cumsum(words[:2])
            table = np.concatenate([table, words[2 : ends[0]].reshape(-1, 2)])
            family = np.concatenate([family, words[ends[0] : ends[1]].reshape(-1, 2)])
            rows = SurfaceNodes.joined([rows, ghosts.unpack_nodes(words[ends[1] :])])
        table, family = table[np.argsort(table[:, 0])], family[np.lexsort((family[:, 1], family[:, 0]))]
    return TopologyUpdate(table[:, 0].copy(), table[:, 1].copy(), family, rows)


def _messages(split: Split, scene: Scene, here: SurfaceNodes, table: Ints, local: Indices) -> dict[int, Ints]:
    """Messages by rank: rows of ``table`` (TopologyUpdate.key and became), families, and their nodes; ``local`` (c,
    2): families of this rank.
    """
    messages, flags = {}, np.zeros(here.n, bool)
    for other in scene.messages.copies.sends:
        messages[other.rank] = np.zeros(0, np.int64)
        some = meets(flags, other.nodes, local)
        if len(some):
            flags[some] = True
            round_it = table[flags[split.node - split.first]]
            flags[some] = False
            packed = ghosts.pack_nodes(here.take(np.unique(local[some])))
            lengths = np.array([len(round_it), len(some)])
            messages[other.rank] = np.concatenate([
                lengths, round_it.reshape(-1), here.id[local[some]].reshape(-1), packed.reshape(-1)
            ])  # fmt: skip
    return messages


@njit("int64[::1](boolean[::1], int32[::1], int32[:, ::1])", cache=True)
def meets(flags, nodes, family):  # type: ignore[no-untyped-def]
    """Returns the rows of a ``family`` (c, 2) whose parents are among the ``nodes``; ``flags``: working array, all
    false.
    """
    rows, n = np.empty(len(family), np.int64), 0
    for a in nodes:
        flags[a] = True
    for c in range(len(family)):
        if family[c, 0] >= 0 and flags[family[c, 0]]:
            rows[n] = c
            n += 1
    for a in nodes:
        flags[a] = False
    return rows[:n].copy()
