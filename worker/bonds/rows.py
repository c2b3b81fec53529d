"""Tied rows, made from the pieces of the interface. A tied row is a tied node with its mortar nodes and their
weights.
"""

from dataclasses import dataclass

import numpy as np

from ..model.ids import places
from ..model.state import Flags, Floats, Ints
from .pieces import Pieces

_NOTHING = 1e-12
"""Smallest weight of a row, as a fraction of the area of the row. Smaller weights are treated as round-off."""


@dataclass
class Rows:
    """Table of tied rows, sorted by bond and node."""

    bond: Ints
    """(r,) number of the bond of each row."""
    node: Ints
    """(r,) global id of the tied node of each row."""
    area: Floats
    """(r,) area of the interface that belongs to each row, m^2."""
    row: Ints
    """(e,) number of the row of each weight, ascending."""
    master: Ints
    """(e,) global id of the mortar node of each weight."""
    weight: Floats
    """(e,) weights. The sum of the weights of a row is one."""
    side: Ints
    """(s,) number of the row of each tied face at its node."""
    face: Ints
    """(s, 3) global ids of the corners of each tied face."""

    def take(self, chosen: Flags) -> "Rows":
        """Returns the rows chosen by ``chosen``."""
        again, entries, sides = np.cumsum(chosen) - 1, chosen[self.row], chosen[self.side]
        return Rows(
            self.bond[chosen], self.node[chosen], self.area[chosen], again[self.row[entries]], self.master[entries],
            self.weight[entries], again[self.side[sides]], self.face[sides],
        )  # fmt: skip


def one_each(rows: Rows, intact: Flags) -> Flags:
    """(r,) True for each row that acts. If a node has several ``intact`` (r,) rows, only the row with the largest area
    acts.

    On a line where three parts are tied to each other, a node has rows of two bonds. One of the rows is sufficient to
    join the parts, and two rows are nearly linearly dependent (docs/theory/bonds.md, "Lines of three parts").
    """
    order = np.lexsort((rows.bond, -rows.area, ~intact, rows.node))
    node, first = rows.node[order], np.ones(len(order), bool)
    first[1:] = node[1:] != node[:-1]
    chosen = np.zeros(len(order), bool)
    chosen[order[first]] = True
    return np.asarray(chosen & intact)


def chain(rows: Rows) -> float:
    """Returns a bound of a spectral norm. The matrix consists of the weights of those mortar nodes that are also tied
    nodes of other rows; the result is 0 if there are no such nodes. The bound is sqrt(largest row sum times largest
    column sum) of the absolute weights.
    """
    among = np.isin(rows.master, rows.node)
    if not among.any():
        return 0.0
    weight = np.abs(rows.weight[among])
    _, column = np.unique(rows.master[among], return_inverse=True)
    return float(np.sqrt(np.bincount(rows.row[among], weight).max() * np.bincount(column, weight).max()))


def assembled(pieces: Pieces, slaves: Ints, masters: Ints) -> Rows:
    """Returns the rows that belong to ``pieces``. ``slaves``, ``masters`` (p, 3): global ids of the corners of the tied
    face and the mortar face of each piece.
    """
    p, many = len(pieces), int(max(slaves.max(initial=0), masters.max(initial=0))) + 1
    key = np.repeat(pieces.bond[:, None] * many + slaves, 3, axis=1).reshape(-1)
    other, value = np.tile(masters, (1, 3)).reshape(-1), pieces.weights.reshape(-1)
    names, of = np.unique(key, return_inverse=True)
    area = np.bincount(of, value, len(names)).astype(np.float64)  # bincount returns integers if there are no pieces
    some = area > _NOTHING * area.max(initial=0.0)
    renumbered = np.cumsum(some) - 1
    kept = some[of]
    entry, at = np.unique(renumbered[of[kept]] * many + other[kept], return_inverse=True)
    row, master = entry // many, entry % many
    weight = np.bincount(at, value[kept], len(entry)) / area[some][row]
    large = np.abs(weight) > _NOTHING
    weight = weight[large] / np.bincount(row[large], weight[large], int(some.sum()))[row[large]]
    side, face = _sides(pieces, slaves, names[some], many) if p else (row[:0], slaves[:0])
    return Rows(names[some] // many, names[some] % many, area[some], row[large], master[large], weight, side, face)


def _sides(pieces: Pieces, slaves: Ints, names: Ints, many: int) -> tuple[Ints, Ints]:
    """Returns the tied faces at the node of each row."""
    _, first = np.unique(np.column_stack([pieces.bond, pieces.slave]), axis=0, return_index=True)
    key = (pieces.bond[first, None] * many + slaves[first]).reshape(-1)
    at = places(names, key).astype(np.int64)
    here = np.flatnonzero(at >= 0)
    order = here[np.argsort(at[here], kind="stable")]
    return at[order], slaves[first][order // 3]
