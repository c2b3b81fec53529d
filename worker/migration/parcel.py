"""Parcels. A parcel is the complete state of some tets, of their nodes, and of the data that belongs to these tets and
nodes. All rows have global ids.

Every stage adds its state to a parcel (``keep``). A stage reads its state from a parcel (``resume``) on the same rank,
on another rank, or in another process. Data that can be computed again bit-identically from the case and the parcel is
not in the parcel.
"""

import pickle
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..model.state import Ints

Table = dict[str, "np.ndarray"]
"""Table: a dictionary of columns of equal length."""


def length(table: Table) -> int:
    """Return the number of rows of a table."""
    return len(next(iter(table.values()))) if table else 0


def take(table: Table, chosen: "np.ndarray") -> Table:
    """Return the rows of a table that are chosen by ``chosen``."""
    return {name: column[chosen] for name, column in table.items()}


def joined(tables: Sequence[Table]) -> Table:
    """Return all rows of several tables that have the same columns. Empty tables are skipped."""
    some = [table for table in tables if table]
    return {name: np.concatenate([table[name] for table in some]) for name in some[0]} if some else {}


def once(table: Table, key: "np.ndarray") -> Table:
    """Return the rows sorted by the column ``key``. If several rows have equal keys, only the first of them is
    returned.
    """
    return take(table, np.unique(key, return_index=True)[1])


@dataclass
class Parcel:
    """The state of tets and nodes in a message or a checkpoint. ``known`` and the names of all columns are equal on all
    ranks.
    """

    known: dict[str, Any] = field(default_factory=dict)
    """Numbers and small arrays that are equal on all ranks."""
    sums: dict[str, Ints] = field(default_factory=dict)
    """Integers of this rank that are terms of sums over the ranks. Only the sums have a meaning."""
    nodes: Table = field(default_factory=dict)
    """Table with one row for each node. The column ``id`` (n,) is ascending after routing. If there is a column
    ``family`` (n,), a tet is sent together with all nodes that have the family of one of its corners."""
    tets: dict[int, Table] = field(default_factory=dict)
    """Tables with one row for each tet; the keys are the numbers of the parts. The columns are ``id`` (n,), ``corners``
    (n, 4), which are global ids of nodes, and the state of the tet."""
    rows: dict[str, Table] = field(default_factory=dict)
    """Tables of other data. Each table has one of three columns that determine the destination of a row. A row is sent
    to the rank of its tet, ``tet`` (k,), to the owner of its node, ``node`` (k,), or to the rank at its position,
    ``at`` (k, 3). The nodes in the column ``with`` (k, m), -1 for no node, are sent with the row. Rows with equal
    ``key`` (k,) are copies of one row."""

    def packed(self) -> Ints:
        """Return the parcel as one flat message."""
        data = pickle.dumps((self.known, self.sums, self.nodes, self.tets, self.rows), protocol=5)
        words = np.zeros(1 + -(-len(data) // 8), np.int64)
        words[0] = len(data)
        words[1:].view(np.uint8)[: len(data)] = np.frombuffer(data, np.uint8)
        return words

    @classmethod
    def unpacked(cls, words: Ints) -> "Parcel":
        """Return the parcel from a message that ``packed`` made."""
        return cls(*pickle.loads(words[1:].view(np.uint8)[: int(words[0])].data))

    @classmethod
    def of(cls, parcels: Sequence["Parcel"]) -> "Parcel":
        """Return the union of parcels; at least one parcel is required. A node that is in several parcels is in the
        union only once.
        """
        nodes = joined([p.nodes for p in parcels])
        parts = sorted({part for p in parcels for part in p.tets})
        names = sorted({name for p in parcels for name in p.rows})
        rows = {name: joined([p.rows.get(name, {}) for p in parcels]) for name in names}
        return cls(
            parcels[0].known,
            {name: np.sum([p.sums[name] for p in parcels], axis=0) for name in parcels[0].sums},
            once(nodes, nodes["id"]) if nodes else {},
            {part: joined([p.tets.get(part, {}) for p in parcels]) for part in parts},
            rows,
        )
