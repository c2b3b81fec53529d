"""Before a step moves anything: cohesive facets that would give what nobody has paid let go of some of their traction.

The forces of the present are complete, so how a pair of nodes will open is known but for what contact does. A facet
that lets go changes how those beside it open; so there are two passes over all, from the same forces each: in the
first a pair gives up what alone would keep it from moving back, in the second those that still would give up all.
"""

import numpy as np

from ..clock import Clock
from ..model.state import Nodes
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum
from ..parallel.tags import Tag
from .cohesive import Cohesion


class Release:
    """Asks the facets of one rank; forces of shared nodes are completed between the passes."""

    def __init__(self, cohesion: Cohesion, nodes: Nodes, neighbours: list[Neighbour], comm: Comm) -> None:
        self._cohesion, self._nodes, self._neighbours, self._comm = cohesion, nodes, neighbours, comm
        self._shared: SharedSum | None = None

    def apply(self, clock: Clock) -> None:
        """Corrects the forces of the present; all ranks take part."""
        nodes, steps = self._nodes, np.array([clock.last_dt, clock.mean_dt, clock.dt])
        for whole in (False, True):
            change = np.zeros_like(nodes.force)
            self._cohesion.let_go(change, nodes, steps, whole)
            shared = self._exchange()
            shared.begin(change)
            shared.finish(change)
            nodes.force += change
        self._cohesion.foresee(nodes, clock.mean_dt)

    def free(self) -> None:
        """Gives the messages back to MPI."""
        if self._shared is not None:
            self._shared.free()
            self._shared = None

    def _exchange(self) -> SharedSum:
        if self._shared is None or not self._shared.serves(self._neighbours):
            self.free()
            self._shared = SharedSum(self._comm, self._neighbours, 3, Tag.RELEASE)
        return self._shared
