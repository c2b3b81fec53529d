"""The state of a rank for a snapshot contains the rows of state that a material has."""

import numpy as np

from conoid.worker.model.rows import DAMAGE
from conoid.worker.model.state import CHUNK, Block, Model, Nodes
from conoid.worker.snapshots.share import copied


def model_of(rows: int) -> Model:
    """Returns two parts of one tet each, with the given number of rows of state; part k has the damage (k + 1) / 4."""
    n, x = 4, np.zeros((4, 3))
    nodes = Nodes(
        np.arange(n), np.zeros(n, np.int32), np.zeros(n, np.int32), np.ones(n, bool), x, x, x, np.ones(n),
        np.zeros((n, 3), np.int64), np.zeros(n),
    )  # fmt: skip
    blocks = []
    for k in range(2):
        state = np.zeros((1, rows, CHUNK))
        state[:, DAMAGE:] = 0.25 * (k + 1)
        tets = np.arange(4, dtype=np.uint32)[None]
        blocks.append(Block(part=k, n=1, tets=tets, id=np.array([k]), state=state, kind=0, eos=0, params=np.zeros(1)))
    return Model(nodes, blocks, ["a", "b"], 2, n)


def test_damage_is_sent_for_parts_whose_law_counts_it() -> None:
    """A part may have the damage row because it has a later row, such as that of pores: in this case the damage row is
    no damage.
    """
    held = np.zeros((0, 2), np.int64)
    share = copied(model_of(DAMAGE + 2), held, {1})
    assert "0.damage" not in share
    assert share["1.damage"].tolist() == [0.5]
    assert "1.damage" not in copied(model_of(DAMAGE), held, {1})
