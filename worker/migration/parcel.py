"""A parcel: the complete state of some tets, of the nodes that they need, and of what goes with them, by global ids.

Every stage adds to a parcel what it must remember (``keep``), and takes it back from one (``resume``): on the same
rank, on another, or in another process on another day. What can be computed again from the case and from the rest, to
the same bits, is in no parcel.
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
    """Number of rows."""
    return len(next(iter(table.values()))) if table else 0


def take(table: Table, chosen: "np.ndarray") -> Table:
    """Some of the rows."""
    return {name: column[chosen] for name, column in table.items()}


def joined(tables: Sequence[Table]) -> Table:
    """All rows of tables that have the same columns; tables without any are passed by."""
    some = [table for table in tables if table]
    return {name: np.concatenate([table[name] for table in some]) for name in some[0]} if some else {}


def once(table: Table, key: "np.ndarray") -> Table:
    """The rows by ascending ``key``, the first of those that have the same."""
    return take(table, np.unique(key, return_index=True)[1])


@dataclass
class Parcel:
    """See the module. ``known`` and the names of all columns are the same on all ranks."""

    known: dict[str, Any] = field(default_factory=dict)
    """What all ranks know alike: numbers and small arrays."""
    sums: dict[str, Ints] = field(default_factory=dict)
    """What adds up over the ranks."""
    nodes: Table = field(default_factory=dict)
    """A row a node; ``id`` (n,) among the columns, ascending when a parcel is whole. Where there is a column ``family``
    (n,), the corners of a tet bring along all nodes of their families."""
    tets: dict[int, Table] = field(default_factory=dict)
    """By part, a row a tet: ``id`` (n,), ``corners`` (n, 4) global ids, and the rest."""
    rows: dict[str, Table] = field(default_factory=dict)
    """Tables of other things. They go where their ``tet`` (k,) goes, or to the owner of their ``node`` (k,), or to
    where they are, ``at`` (k, 3). Nodes ``with`` them (k, m), -1 for none, come along, rows of one
    ``key`` (k,) are copies of each other."""

    def packed(self) -> Ints:
        """One flat message."""
        data = pickle.dumps((self.known, self.sums, self.nodes, self.tets, self.rows), protocol=5)
        words = np.zeros(1 + -(-len(data) // 8), np.int64)
        words[0] = len(data)
        words[1:].view(np.uint8)[: len(data)] = np.frombuffer(data, np.uint8)
        return words

    @classmethod
    def unpacked(cls, words: Ints) -> "Parcel":
        """What ``packed`` made one message of."""
        return cls(*pickle.loads(words[1:].view(np.uint8)[: int(words[0])].data))

    @classmethod
    def of(cls, parcels: Sequence["Parcel"]) -> "Parcel":
        """All of them as one; nodes that several hold are there once. At least one."""
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
