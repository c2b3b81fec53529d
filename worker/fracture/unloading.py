"""Unloading of cohesive facets that would release more energy in the next step than they absorbed.

Nodal forces are complete, so the opening of a pair of nodes in the next step is known, except the change by contact.
Unloading of one facet changes the openings of the neighbouring facets. There are therefore two passes over all facets,
each with the forces at its beginning. The first pass lowers the traction of each pair as far as this pair alone
requires. The second pass completely unloads the pairs that still close too far.
"""

import numpy as np

from ..clock import Clock
from ..model.state import Nodes
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum
from ..parallel.tags import Tag
from .cohesive import Cohesion


class Unloading:
    """Unloading on one rank; the forces of shared nodes are completed after each pass."""

    def __init__(self, cohesion: Cohesion, nodes: Nodes, neighbours: list[Neighbour], comm: Comm) -> None:
        self._cohesion, self._nodes, self._neighbours, self._comm = cohesion, nodes, neighbours, comm
        self._shared: SharedSum | None = None

    def apply(self, clock: Clock) -> None:
        """Corrects the present nodal forces. Collective."""
        nodes, steps = self._nodes, np.array([clock.last_dt, clock.mean_dt, clock.dt])
        for whole in (False, True):
            change = np.zeros_like(nodes.force)
            self._cohesion.unload(change, nodes, steps, whole)
            shared = self._exchange()
            shared.begin(change)
            shared.finish(change)
            nodes.force += change
        self._cohesion.foresee(nodes, clock.mean_dt)

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        if self._shared is not None:
            self._shared.free()
            self._shared = None

    def _exchange(self) -> SharedSum:
        if self._shared is None or not self._shared.serves(self._neighbours):
            self.free()
            self._shared = SharedSum(self._comm, self._neighbours, 3, Tag.RELEASE)
        return self._shared
