"""Velocities with which a search extrapolates the nodes.

A node of a metal is extrapolated with its own velocity. Nodes of a body that breaks vibrate: a free tet has a period of
some ten steps, and the release of 1 GPa in glass makes it vibrate with sigma / (rho c) = 75 m/s. Extrapolation to the
next search with this velocity would be wrong by more than the motion of the node. Therefore a node whose tets may break
gets the velocity of a rigid body with the momentum and the angular momentum of its tets.
"""

import numpy as np

from ...kernels.jit import njit
from ...model.state import Block, Floats, Nodes
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour, complete
from ...parallel.tags import Tag

_QUANTA = 2.0**16
"""Quanta per m/s; with this value sums up to 1e14 m/s do not overflow."""
_THIN = 1e-9
"""Smallest value, over the cube of its trace, of the determinant of the inertia of a tet for which the rotation of
the tet is computed."""


def courses(blocks: list[Block], nodes: Nodes, neighbours: list[Neighbour], comm: Comm) -> Floats:
    """(nodes, 3) extrapolated velocities, m/s: at nodes of tets that may break, the mean of the rigid motions of
    their tets. Collective."""
    sums = np.zeros((nodes.n, 4), np.int64)
    for block in blocks:
        if len(block.bond):
            _add_rigid(sums, block.tets, nodes.x, nodes.v, _QUANTA)
    complete(comm, neighbours, sums, Tag.COURSE)
    tets = sums[:, 3:]
    return np.asarray(np.where(tets > 0, sums[:, :3] / (_QUANTA * np.maximum(tets, 1)), nodes.v))


@njit("float64(float64[::1], float64[::1], float64[::1])", cache=True)
def _det(a, b, c):  # type: ignore[no-untyped-def]
    """a . b x c of three vectors (3,)."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


@njit("void(int64[:, ::1], uint32[:, ::1], float64[:, ::1], float64[:, ::1], float64)", cache=True, error_model="numpy")
def _add_rigid(sums, tets, x, v, quanta):  # type: ignore[no-untyped-def]
    """Adds the rigid motion of each of ``tets`` (n, 4) at its corners, and the count one, to the ``sums`` (nodes, 4).

    The motion is that of four equal masses: u + omega x r with I omega = sum(r x v), solved by Cramer's rule.
    """
    r, u = np.empty((4, 3)), np.empty(3)
    inertia, spin, turn = np.empty((3, 3)), np.empty(3), np.empty(3)
    for e in range(len(tets)):
        spin[:] = 0.0
        inertia[:] = 0.0
        for i in range(3):
            centre, mean = 0.0, 0.0
            for a in range(4):
                centre += 0.25 * x[tets[e, a], i]
                mean += 0.25 * v[tets[e, a], i]
            u[i] = mean
            for a in range(4):
                r[a, i] = x[tets[e, a], i] - centre
        for a in range(4):
            square = r[a, 0] * r[a, 0] + r[a, 1] * r[a, 1] + r[a, 2] * r[a, 2]
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                spin[i] += r[a, j] * v[tets[e, a], k] - r[a, k] * v[tets[e, a], j]
                inertia[i, i] += square
                for m in range(3):
                    inertia[i, m] -= r[a, i] * r[a, m]
        trace = inertia[0, 0] + inertia[1, 1] + inertia[2, 2]
        det = _det(inertia[0], inertia[1], inertia[2])
        turn[:] = 0.0
        if det > _THIN * trace**3:
            turn[0] = _det(spin, inertia[1], inertia[2]) / det
            turn[1] = _det(inertia[0], spin, inertia[2]) / det
            turn[2] = _det(inertia[0], inertia[1], spin) / det
        for a in range(4):
            node = tets[e, a]
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                sums[node, i] += np.int64(np.rint(quanta * (u[i] + turn[j] * r[a, k] - turn[k] * r[a, j])))
            sums[node, 3] += 1
