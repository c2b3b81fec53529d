"""Removal of tets from a block: tets from the end of the block fill the gaps."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

_Ints = npt.NDArray[np.int64]
_Indices = npt.NDArray[np.int32]


class Moves(NamedTuple):
    """Removal of some tets of a block, for tables with one row for each tet of the block."""

    n: int
    """Number of tets before the removal."""
    gone: _Ints
    """(g,) places of the removed tets, ascending."""
    holes: _Ints
    """(k,) free places that are filled by other tets."""
    movers: _Ints
    """(k,) old places of the tets that move to the free places."""

    @classmethod
    def of(cls, n: int, gone: _Ints) -> "Moves":
        """Return the removal of the tets ``gone`` from a block of ``n`` tets."""
        left = n - len(gone)
        return cls(n, gone, gone[gone < left], np.setdiff1d(np.arange(left, n), gone))

    @property
    def left(self) -> int:
        """Number of tets after the removal."""
        return self.n - len(self.gone)

    @property
    def places(self) -> _Indices:
        """(n,) new place of each tet; -1 for a removed tet."""
        places = np.arange(self.n, dtype=np.int32)
        places[self.gone] = -1
        places[self.movers] = self.holes
        return places

    def applied(self, table: "np.ndarray") -> "np.ndarray":
        """Move the rows of a ``table`` (n, ...) in place; return its remaining rows. A table without rows is not
        changed.
        """
        if len(table):
            table[self.holes] = table[self.movers]
        return table[: self.left]
