"""Corner nodes of the faces of bonded interfaces. The corners are updated after separations of nodes."""

import numpy as np

from ..mesh.faces import FACES
from ..model.ids import IdIndex
from ..model.state import Flags, Ints, Model
from ..parallel.comm import Comm


class Faces:
    """Faces of all bonds on one rank. The name of a face is 4 * global tet id + local face."""

    def __init__(self, names: Ints, model: Model) -> None:
        """``names``: names of the faces, ascending. All ranks have the same names."""
        self.names, self._model = names, model
        self.corners: Ints = np.full((len(names), 3), -1)
        """(f, 3) global ids of the corners at the last call of ``follow``; -1 for removed faces. The array is equal on
        all ranks."""
        self._block, self._place = np.full((2, len(names)), -1)

    def changed(self) -> bool:
        """Returns True if a face of this rank was removed or has new corners since the last call of ``follow``."""
        lost = (self._block >= 0) & ~self._stay()
        here = (self._block >= 0) & ~lost
        return bool(lost.any() or (self._here(here) != self.corners[here]).any())

    def follow(self, comm: Comm) -> None:
        """Updates the array ``corners`` on all ranks. Collective."""
        self._locate(~self._stay())
        here = self._block >= 0
        rows = np.column_stack([np.flatnonzero(here), self._here(here)])
        every = comm.join(rows).reshape(-1, 4)
        self.corners = np.full((len(self.names), 3), -1)
        self.corners[every[:, 0]] = every[:, 1:]

    def here(self, names: Ints) -> Flags:
        """Returns flags: True for each face of a tet of this rank."""
        return np.asarray(self._block[np.searchsorted(self.names, names)] >= 0)

    def of(self, names: Ints) -> Ints:
        """(k, 3) corners of the faces with the given names."""
        return self.corners[np.searchsorted(self.names, names)]

    def _stay(self) -> Flags:
        """Returns flags of faces. A flag is True if the tet of the face is in the same row of its block as before; it
        is False for other faces and for faces of other ranks.
        """
        found = np.zeros(len(self.names), bool)
        for b, block in enumerate(self._model.blocks):
            some = np.flatnonzero((self._block == b) & (self._place < block.n))
            found[some] = block.id[self._place[some]] == self.names[some] // 4
        return found

    def _locate(self, some: Flags) -> None:
        self._block[some] = self._place[some] = -1
        for b, block in enumerate(self._model.blocks):
            tets = self.names[some] // 4
            at = IdIndex(block.id[: block.n]).places(tets)
            found = at >= 0
            rows = np.flatnonzero(some)[found]
            self._block[rows], self._place[rows] = b, at[found]

    def _here(self, some: Flags) -> Ints:
        """(k, 3) present corners of faces of this rank, as global ids of nodes."""
        corners = np.empty((len(self.names), 3), np.int64)
        for b, block in enumerate(self._model.blocks):
            rows = np.flatnonzero(some & (self._block == b))
            tets = block.tets[self._place[rows]]
            corners[rows] = self._model.nodes.id[tets[np.arange(len(rows))[:, None], FACES[self.names[rows] % 4]]]
        return corners[some]
