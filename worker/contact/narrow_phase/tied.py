"""Tied bonds of the slots (worker/bonds). A pair whose nodes are all tied by one bond has no contact."""

from typing import Protocol

import numpy as np

from ...model.state import Ints
from ..surface.records import SurfaceNodes

NOTHING: Ints = np.zeros(0, np.int64)
"""Value of the bonds for a scene without bonds."""


class Ties(Protocol):
    """Interface of the tied bonds."""

    version: int

    def bits(self, ids: Ints) -> Ints:
        """(k,) bonds of each node, one bit for each bond."""


class Tied:
    """Tied bonds of the slots of a scene; they are updated when the bonds or the slots change."""

    def __init__(self, bonds: Ties) -> None:
        self._bonds, self._ids, self._version, self._found = bonds, NOTHING, -1, NOTHING

    def bits(self, surface_nodes: SurfaceNodes) -> Ints:
        """(slots,) bonds of each slot, one bit for each bond; see Ties.bits."""
        if self._ids is not surface_nodes.id or self._version != self._bonds.version:
            self._ids, self._version = surface_nodes.id, self._bonds.version
            self._found = self._bonds.bits(surface_nodes.id)
        return self._found
