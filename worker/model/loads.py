"""Loads on faces of tets, as lists that are cut by rank: constant nodal forces, and faces under a pressure."""

from dataclasses import dataclass

import numpy as np

from .state import Flags, Floats, Ints


@dataclass
class Load:
    """Constant forces on corners of tets, in the order of the tets."""

    place: Ints
    """(m,) of each among all of the load."""
    tets: Ints
    """(m,) global ids."""
    nodes: Ints
    """(m,) global ids."""
    force: Floats
    """(m, 3) N."""

    def take(self, chosen: Flags) -> "Load":
        """Some of them."""
        return Load(self.place[chosen], self.tets[chosen], self.nodes[chosen], self.force[chosen])

    def here(self, nodes: Ints, tets: Ints) -> "Load":
        """What a rank needs that holds these nodes and tets: all forces on its nodes."""
        return self.take(np.isin(self.nodes, nodes))


@dataclass
class LoadedFaces:
    """Faces on which a pressure acts that follows the surface."""

    tets: Ints
    """(m,) global ids."""
    nodes: Ints
    """(m, 3) global ids, anticlockwise from outside."""
    scale: float
    """Quanta per newton of the forces on nodes; the same on all ranks."""

    def take(self, chosen: Flags) -> "LoadedFaces":
        """Some of them."""
        return LoadedFaces(self.tets[chosen], self.nodes[chosen], self.scale)

    def here(self, nodes: Ints, tets: Ints) -> "LoadedFaces":
        """What a rank needs that holds these nodes and tets: the faces of its tets."""
        return self.take(np.isin(self.tets, tets))
