"""Unloading of cohesive facets that would release more energy in the next step than they absorbed.

When the unloading starts, the nodal forces are complete. Therefore the opening of a pair of nodes in the next step is
known, except for the change by contact. Unloading of one facet changes the openings of the neighbouring facets.
Therefore the module makes two passes over all facets. Each pass uses the forces that were present at its start. The
first pass lowers the traction of each pair as far as this pair alone requires; the second pass completely unloads the
pairs that still close too far.
"""

import numpy as np

from ..clock import Clock
from ..kernels.jit import njit
from ..model.state import Ints, Nodes
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour, SharedSum
from ..parallel.tags import Tag
from .cohesive import Cohesion


@njit("void(int64[:, ::1], int64[:, ::1], int32[::1])", cache=True)
def _move(force, change, rows):  # type: ignore[no-untyped-def]
    """Adds the ``change`` of the nodes ``rows`` (k,) to the forces of these nodes, and sets the change to zero. A node
    may occur several times in ``rows``.
    """
    for a in rows:
        for i in range(3):
            force[a, i] += change[a, i]
            change[a, i] = 0


class Unloading:
    """Unloading of cohesive facets on one rank. The forces of shared nodes are completed after each pass."""

    def __init__(self, cohesion: Cohesion, nodes: Nodes, neighbours: list[Neighbour], comm: Comm) -> None:
        self._cohesion, self._nodes, self._neighbours, self._comm = cohesion, nodes, neighbours, comm
        self._shared: SharedSum | None = None
        self._room: Ints = np.zeros((0, 3), np.int64)
        """(rows, 3) changes of the nodal forces in a pass, quanta. The array is zero between two passes."""

    def apply(self, clock: Clock) -> None:
        """Corrects the present nodal forces. Collective."""
        sides = self._cohesion.facets.nodes
        if not len(sides) and not self._neighbours:
            return
        nodes, steps = self._nodes, np.array([clock.last_dt, clock.mean_dt, clock.dt])
        if nodes.n > len(self._room):
            self._room = np.zeros((nodes.n + nodes.n // 2, 3), np.int64)
        change, shared = self._room[: nodes.n], self._exchange()
        for whole in (False, True):
            self._cohesion.unload(change, nodes, steps, whole)
            shared.begin(change)
            shared.finish(change)
            for some in (sides.reshape(-1), *(other.nodes for other in self._neighbours)):
                _move(nodes.force, change, some)
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
