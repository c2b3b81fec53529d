"""News of a split: what ranks tell each other of nodes that they do not hold."""

from dataclasses import dataclass

import numpy as np

from ..parallel.comm import Comm
from ..state import Ints
from ..topology import Split
from . import ghosts
from .records import Crowd
from .scene import Scene


@dataclass
class News:
    """What a rank knows of a split: round every node that it holds or has a copy of."""

    key: Ints
    """(r,) ids of a node and of a tet as one number, ascending."""
    became: Ints
    """(r,) id of the copy that the node of that tet has become."""
    parent: Ints
    """(c,) ids of the parents of all copies, ascending."""
    copy: Ints
    """(c,) ids of the copies."""
    rows: Crowd
    """Parents and copies."""


def news(split: Split, scene: Scene, here: Crowd, comm: Comm) -> News | None:
    """None where there is none; all ranks take part. ``here``: every node of this rank, by local index. Of nodes that
    it does not hold, a rank hears from the one that sends it their state.
    """
    if not split.copies.n and not (heard := comm.swap({})):
        return None
    parents, copies = split.copies.parents, split.first + np.arange(split.copies.n)
    table = np.column_stack([split.key, here.id[split.node]])
    family = np.column_stack([here.id[parents], here.id[copies]])
    rows = here.take(np.unique(np.concatenate([parents, copies])))
    if split.copies.n:
        told, flags = {}, np.zeros(here.n, bool)
        for other in scene.messages.copies.sends:
            flags[other.nodes] = True
            for_it = flags[parents]
            flags[other.nodes] = False
            if for_it.any():
                some = np.unique(np.concatenate([parents[for_it], copies[for_it]]))
                round_it = table[for_it[split.node - split.first]]
                packed = ghosts.pack_crowd(here.take(some))
                lengths = np.array([len(round_it), int(for_it.sum())])
                told[other.rank] = np.concatenate([
                    lengths, round_it.reshape(-1), family[for_it].reshape(-1), packed.reshape(-1)
                ])  # fmt: skip
        heard = comm.swap(told)
    if heard:
        for words in heard.values():
            ends = 2 + 2 * np.cumsum(words[:2])
            table = np.concatenate([table, words[2 : ends[0]].reshape(-1, 2)])
            family = np.concatenate([family, words[ends[0] : ends[1]].reshape(-1, 2)])
            rows = Crowd.joined([rows, ghosts.unpack_crowd(words[ends[1] :])])
        table, family = table[np.argsort(table[:, 0])], family[np.lexsort((family[:, 1], family[:, 0]))]
    return News(table[:, 0].copy(), table[:, 1].copy(), family[:, 0].copy(), family[:, 1].copy(), rows)
