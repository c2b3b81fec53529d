"""Parcels: the complete state of some tets, of their nodes and of the data that belongs to them, by global ids.

Every stage adds its state to a parcel (``keep``) and reads it from one (``resume``): on the same rank, on another
rank, or in another process. Data that can be computed again from the case and from the parcel, to the same bits, is
not in it.
"""

import pickle
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..model.state import Ints

Table = dict[str, "np.ndarray"]
"""Columns of equal length."""


def length(table: Table) -> int:
    """Return the number of rows of a table."""
    return len(next(iter(table.values()))) if table else 0


def take(table: Table, chosen: "np.ndarray") -> Table:
    """Return the chosen rows of a table."""
    return {name: column[chosen] for name, column in table.items()}


def joined(tables: Sequence[Table]) -> Table:
    """Return all rows of tables that have the same columns; empty tables are skipped."""
    some = [table for table in tables if table]
    return {name: np.concatenate([table[name] for table in some]) for name in some[0]} if some else {}


def once(table: Table, key: "np.ndarray") -> Table:
    """Return the rows by ascending ``key``, the first of rows with equal keys."""
    return take(table, np.unique(key, return_index=True)[1])


@dataclass
class Parcel:
    """A parcel is the state of tets and nodes in a message or a checkpoint. ``known`` and the names of all columns are
    equal on all ranks.
    """

    known: dict[str, Any] = field(default_factory=dict)
    """Numbers and small arrays that are equal on all ranks."""
    sums: dict[str, Ints] = field(default_factory=dict)
    """Integers of this rank; only their sums over the ranks have a meaning."""
    nodes: Table = field(default_factory=dict)
    """Table with a row for each node, and a column ``id`` (n,), ascending after routing. If there is a column
    ``family`` (n,), a tet is sent with all nodes of the families of its corners."""
    tets: dict[int, Table] = field(default_factory=dict)
    """Tables by part, with a row for each tet: ``id`` (n,), ``corners`` (n, 4) global ids of nodes, and the state of
    the tet."""
    rows: dict[str, Table] = field(default_factory=dict)
    """Tables of other data. A row is sent to the rank of a tet, ``tet`` (k,), to the owner of a node, ``node`` (k,),
    or to the rank at a position, ``at`` (k, 3). The nodes in its column ``with`` (k, m), -1 for none, are sent with
    it. Rows with equal ``key`` (k,) are copies of each other."""

    def packed(self) -> Ints:
        """Return the parcel as one flat message."""
        data = pickle.dumps((self.known, self.sums, self.nodes, self.tets, self.rows), protocol=5)
        words = np.zeros(1 + -(-len(data) // 8), np.int64)
        words[0] = len(data)
        words[1:].view(np.uint8)[: len(data)] = np.frombuffer(data, np.uint8)
        return words

    @classmethod
    def unpacked(cls, words: Ints) -> "Parcel":
        """Return the parcel from a message made by ``packed``."""
        return cls(*pickle.loads(words[1:].view(np.uint8)[: int(words[0])].data))

    @classmethod
    def of(cls, parcels: Sequence["Parcel"]) -> "Parcel":
        """Return the union of at least one parcel. A node in several parcels is in the union once."""
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
