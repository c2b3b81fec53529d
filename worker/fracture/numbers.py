"""Numbers of fragments. If a fragment breaks, its largest piece keeps the number, and each other piece gets a new
number.
"""

import numpy as np

from ..model.ids import places
from ..model.state import Ints
from ..parallel.comm import Comm

UNKNOWN = -1
"""Value for a tet that has no fragment number yet."""


def numbered(before: Ints, labels: Ints, first: int, comm: Comm) -> tuple[Ints, Ints]:
    """Returns two arrays: (n,) the fragment number of each tet; and (k, 3) the old number, the new number, and the
    number of tets that have both. The rows of the second array are ascending and equal on all ranks. Collective.

    ``before`` (n,): old fragment numbers of the tets, or UNKNOWN; ``labels`` (n,): label of the fragment of each tet.
    New numbers start at ``first`` and have the order of the labels. If several pieces have equally many tets, the piece
    with the smallest label keeps the number.
    """
    rows = _in_common(before, labels, comm)
    names = np.unique(rows[:, 1])
    numbers = np.full(len(names), UNKNOWN, np.int64)
    order = np.lexsort((rows[:, 1], -rows[:, 2], rows[:, 0]))
    kept = order[np.append(True, np.diff(rows[order, 0]) != 0)[: len(order)]]
    kept = kept[rows[kept, 0] != UNKNOWN]
    numbers[places(names, rows[kept, 1])] = rows[kept, 0]
    new = numbers == UNKNOWN
    numbers[new] = first + np.arange(new.sum())
    rows[:, 1] = numbers[places(names, rows[:, 1])]
    return numbers[places(names, labels)], rows[np.lexsort((rows[:, 1], rows[:, 0]))]


def _in_common(before: Ints, labels: Ints, comm: Comm) -> Ints:
    """(k, 3) old number, label, and the number of tets on all ranks that have this number and this label."""
    old, of_old = np.unique(before, return_inverse=True)
    new, of_new = np.unique(labels, return_inverse=True)
    both, tets = np.unique(of_old * len(new) + of_new, return_counts=True)
    mine = np.column_stack([old[both // max(len(new), 1)], new[both % max(len(new), 1)], tets])
    every = np.concatenate([np.zeros((0, 3), np.int64), *comm.share(mine)])
    rows, at = np.unique(every[:, :2], axis=0, return_inverse=True)
    common = np.zeros(len(rows), np.int64)
    np.add.at(common, at.reshape(-1), every[:, 2])
    return np.column_stack([rows, common])
