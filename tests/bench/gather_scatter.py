"""Lower limit of the cost of any tet code: read positions and velocities of four nodes, and add to the forces of four
nodes.

The loop computes no mechanics. The measured speed is an upper limit on this machine for any loop over the elements with
one pass over the mesh.
"""

import time

import numpy as np
from numba import njit

from conoid.worker.simulation import Simulation


@njit("void(float64[:, ::1], float64[:, ::1], int64[:, ::1], uint32[:, ::1])", error_model="numpy")
def _sweep(x, v, force, tets):  # type: ignore[no-untyped-def]
    for i in range(len(tets)):
        a, b, c, d = tets[i, 0], tets[i, 1], tets[i, 2], tets[i, 3]
        for k in range(3):
            f1 = np.int64((x[b, k] - x[a, k]) * (v[b, k] - v[a, k]))
            f2 = np.int64((x[c, k] - x[a, k]) * (v[c, k] - v[a, k]))
            f3 = np.int64((x[d, k] - x[a, k]) * (v[d, k] - v[a, k]))
            force[b, k] += f1
            force[c, k] += f2
            force[d, k] += f3
            force[a, k] -= f1 + f2 + f3


class GatherScatter:
    """Loops over the mesh of a simulation, in the order of its tets, on separate arrays."""

    def __init__(self, sim: Simulation) -> None:
        nodes = sim.model.nodes
        self._x, self._v, self.force = nodes.x.copy(), nodes.v.copy(), np.zeros((nodes.n, 3), np.int64)
        self._tets = [block.tets for block in sim.model.blocks]

    def sweeps(self, count: int) -> float:
        """Returns the CPU time of ``count`` loops, s."""
        begin = time.thread_time()
        for _ in range(count):
            for tets in self._tets:
                _sweep(self._x, self._v, self.force, tets)
        return time.thread_time() - begin
