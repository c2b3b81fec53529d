"""Topology changes near one rank by a node separation (split): changes of the nodes of the rank, and changes of ghosts,
which other ranks send.
"""

from dataclasses import dataclass

import numpy as np

from ...kernels.jit import njit
from ...model.state import Ints
from ...model.topology import Split
from ...parallel.comm import Comm
from ..surface.records import SurfaceNodes
from . import ghosts
from .scene import Scene


@dataclass
class SplitOfGhosts:
    """Topology change of the ghosts in one step, received from other ranks."""

    key: Ints
    """(r,) ids of a node and of a tet, combined into one number."""
    became: Ints
    """(r,) id of the copy that replaces the node in the tet."""
    family: Ints
    """(c, 2) ids of parents, ascending, and ids of their copies."""
    rows: SurfaceNodes
    """Data of the parents and copies."""


def exchange(split: Split, scene: Scene, here: SurfaceNodes, comm: Comm) -> SplitOfGhosts | None:
    """Sends the separations of nodes to the ranks that have the nodes as ghosts. Returns the separations of the ghosts
    of this rank; None if no ghost has separated. ``here``: all nodes of this rank, by local index. Separations of
    ghosts are received from the rank that sends the state of the ghosts. Only ranks that send or receive messages about
    separations take part.
    """
    sources = [other.rank for other in scene.messages.copies.receives if split.touched[other.rank]]
    if not (sources or split.touched[comm.rank]):
        return None
    messages = _messages(split, scene, here) if split.touched[comm.rank] else {}
    received = [words for words in comm.trade(messages, sources).values() if len(words)]
    if not received:
        return None
    tables, families, rows = [], [], []
    for words in received:
        ends = 2 + 2 * np.cumsum(words[:2])
        tables.append(words[2 : ends[0]].reshape(-1, 2))
        families.append(words[ends[0] : ends[1]].reshape(-1, 2))
        rows.append(ghosts.unpack_nodes(words[ends[1] :]))
    table, family = np.concatenate(tables), np.concatenate(families)
    family = family[np.lexsort((family[:, 1], family[:, 0]))]
    return SplitOfGhosts(table[:, 0].copy(), table[:, 1].copy(), family, SurfaceNodes.joined(rows))


def _messages(split: Split, scene: Scene, here: SurfaceNodes) -> dict[int, Ints]:
    """Returns a dictionary of messages; the keys are ranks. A message consists of the columns key and became of
    SplitOfGhosts, the families, and the nodes of the families.
    """
    messages, flags = {}, np.zeros(here.n, bool)
    table, local = np.column_stack([split.key, here.id[split.node]]), split.family
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
    """Returns the rows of a ``family`` (c, 2) whose parent is one of the ``nodes``. ``flags``: working array, in which
    all values are False.
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
