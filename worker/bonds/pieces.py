"""Pieces of a bonded interface. A piece is the common area of a tied face and a mortar face. Every rank has all
pieces.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..migration.parcel import Table
from ..model.state import Flags, Floats, Ints


@dataclass
class Pieces:
    """Table of pieces, sorted by bond, tied face (column ``slave``) and mortar face (column ``master``). The name of a
    face is 4 * global tet id + local face. The corners of a face have the order of mesh/faces.py.
    """

    bond: Ints
    """(p,) number of the bond in the case."""
    slave: Ints
    """(p,) name of the tied face."""
    master: Ints
    """(p,) name of the mortar face."""
    weights: Floats
    """(p, 9) weight of each pair of a corner of the tied face and a corner of the mortar face, m^2. The three weights
    of a tied corner are successive."""
    of_face: Ints
    """(p,) number of pieces that the tied face of each piece had at the start. A tied face that has lost one of its
    pieces is no longer tied."""

    @classmethod
    def none(cls) -> Self:
        """Returns a table with no pieces."""
        words = np.zeros(0, np.int64)
        return cls(words, words, words, np.zeros((0, 9)), words)

    def __len__(self) -> int:
        return len(self.bond)

    def take(self, chosen: Flags | Ints) -> Self:
        """Returns the pieces chosen by ``chosen``."""
        return type(self)(
            self.bond[chosen], self.slave[chosen], self.master[chosen], self.weights[chosen], self.of_face[chosen]
        )

    def table(self) -> Table:
        """Returns the columns of the pieces for a parcel (a checkpoint or migration message)."""
        return {
            "bond": self.bond, "slave": self.slave, "master": self.master, "weights": self.weights,
            "of_face": self.of_face,
        }  # fmt: skip

    @classmethod
    def of(cls, tables: list[Table]) -> Self:
        """Returns the pieces of several tables, sorted."""
        some = [table for table in tables if table and len(table["bond"])]
        if not some:
            return cls.none()
        columns = {name: np.concatenate([table[name] for table in some]) for name in some[0]}
        found = cls(columns["bond"], columns["slave"], columns["master"], columns["weights"], columns["of_face"])
        return found.take(np.lexsort((found.master, found.slave, found.bond)))

    @classmethod
    def joined(cls, some: "list[Pieces]") -> "Pieces":
        """Returns the pieces of several lists, sorted."""
        return cls.of([each.table() for each in some])
