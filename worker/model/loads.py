"""Loads on faces of tets: constant nodal forces, and faces under a pressure. Each rank selects its own loads from the
lists of the whole model.
"""

from dataclasses import dataclass

import numpy as np

from .state import Flags, Floats, Ints


@dataclass
class Load:
    """Constant forces on corners of tets, ordered by tet."""

    place: Ints
    """(m,) index of each force in the list of forces of the whole model."""
    tets: Ints
    """(m,) global ids of the tets."""
    nodes: Ints
    """(m,) global ids of the nodes."""
    force: Floats
    """(m, 3) force on each node, N."""

    def take(self, chosen: Flags) -> "Load":
        """Return the forces chosen by ``chosen``."""
        return Load(self.place[chosen], self.tets[chosen], self.nodes[chosen], self.force[chosen])

    def here(self, nodes: Ints, tets: Ints) -> "Load":
        """Return the forces of a rank with the given ``nodes`` and ``tets``: all forces on its nodes."""
        return self.take(np.isin(self.nodes, nodes))


@dataclass
class LoadedFaces:
    """Faces under a pressure that acts along the present normal of each face."""

    tets: Ints
    """(m,) global id of the tet of each face."""
    nodes: Ints
    """(m, 3) global ids of the nodes of each face, anticlockwise seen from outside."""
    scale: float
    """Number of quanta per newton of the nodal forces. All ranks have the same number."""

    def take(self, chosen: Flags) -> "LoadedFaces":
        """Return the faces chosen by ``chosen``."""
        return LoadedFaces(self.tets[chosen], self.nodes[chosen], self.scale)

    def here(self, nodes: Ints, tets: Ints) -> "LoadedFaces":
        """Return the faces of a rank with the given ``nodes`` and ``tets``: the faces of its tets."""
        return self.take(np.isin(self.tets, tets))
