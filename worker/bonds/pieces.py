"""Pieces of a bonded interface: what a slave face and a master face have in common, as every rank knows them."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..migration.parcel import Table
from ..model.state import Flags, Floats, Ints


@dataclass
class Pieces:
    """By bond, slave face and master face; a face is named 4 * global tet id + local face, its corners in the order of
    mesh/faces.py.
    """

    bond: Ints
    """(p,) number of the bond in the case."""
    slave: Ints
    """(p,) the face whose nodes are tied."""
    master: Ints
    """(p,) the face that they are tied to."""
    weights: Floats
    """(p, 9) of each corner of the slave with each of the master, slave by slave, m^2."""
    of_face: Ints
    """(p,) how many pieces the slave face had at the start: one that has lost a piece is tied no more."""

    @classmethod
    def none(cls) -> Self:
        """No piece."""
        words = np.zeros(0, np.int64)
        return cls(words, words, words, np.zeros((0, 9)), words)

    def __len__(self) -> int:
        return len(self.bond)

    def take(self, chosen: Flags | Ints) -> Self:
        """Some of them."""
        return type(self)(
            self.bond[chosen], self.slave[chosen], self.master[chosen], self.weights[chosen], self.of_face[chosen]
        )

    def table(self) -> Table:
        """The columns, for a parcel."""
        return {
            "bond": self.bond, "slave": self.slave, "master": self.master, "weights": self.weights,
            "of_face": self.of_face,
        }  # fmt: skip

    @classmethod
    def of(cls, tables: list[Table]) -> Self:
        """All pieces of some tables, in order."""
        some = [table for table in tables if table and len(table["bond"])]
        if not some:
            return cls.none()
        columns = {name: np.concatenate([table[name] for table in some]) for name in some[0]}
        found = cls(columns["bond"], columns["slave"], columns["master"], columns["weights"], columns["of_face"])
        return found.take(np.lexsort((found.master, found.slave, found.bond)))

    @classmethod
    def joined(cls, some: "list[Pieces]") -> "Pieces":
        """All of them, in order."""
        return cls.of([each.table() for each in some])
