"""Velocities with which a search extrapolates the nodes.

A node of a metal is extrapolated with its own velocity. Nodes of a body that breaks vibrate: a free tet has a period of
about ten steps, and the release of a stress of 1 GPa in glass makes the tet vibrate with sigma / (rho c) = 75 m/s. With
the velocity of such a vibration, the extrapolation of a node to the next search would have an error that is larger than
the motion of the node. Therefore a node whose tets may break gets the velocity of a rigid body with the momentum and
the angular momentum of its tets.
"""

import numpy as np

from ...elements.colours import TetPass
from ...kernels.jit import njit, types
from ...model.state import CHUNK, Block, Floats, Nodes
from ...parallel.arguments import reader
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour, complete
from ...parallel.tags import Tag
from ...parallel.team import TASK, Team

_QUANTA = 2.0**16
"""Number of quanta per m/s; with this number, sums of velocities up to 1e14 m/s do not overflow."""
_THIN = 1e-9
"""Smallest determinant of the inertia of a tet, divided by the cube of its trace. For a smaller value the rotation of
the tet is not computed."""

_F2 = types.float64[:, ::1]
_RIGID = types.int64[:, ::1], types.uint32[:, ::1], _F2, _F2, types.float64
_read = reader(*_RIGID)


def courses(blocks: list[Block], nodes: Nodes, neighbours: list[Neighbour], comm: Comm, rigid: TetPass) -> Floats:
    """(nodes, 3) extrapolated velocities, m/s. A node of tets that may break gets the mean of the rigid motions of
    these tets. ``rigid``: see rigid_motions. Collective."""
    sums = np.zeros((nodes.n, 4), np.int64)
    for block in blocks:
        if len(block.bond):
            rigid.run(block, nodes.n, sums, block.tets, nodes.x, nodes.v, _QUANTA)
    complete(comm, neighbours, sums, Tag.COURSE)
    tets = sums[:, 3:]
    return np.asarray(np.where(tets > 0, sums[:, :3] / (_QUANTA * np.maximum(tets, 1)), nodes.v))


def rigid_motions(team: Team) -> TetPass:
    """Returns the pass that adds the rigid motion of each tet of a block to its nodes."""
    return TetPass(team, _add_rigid, *_RIGID)


@njit("float64(float64[::1], float64[::1], float64[::1])", cache=True)
def _det(a, b, c):  # type: ignore[no-untyped-def]
    """Triple product (a x b) . c of three vectors (3,)."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


@njit(TASK, cache=True, error_model="numpy", _nrt=True)
def _add_rigid(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: adds the rigid motion of each tet of some chunks to its corners, in ``sums`` (nodes, 4). The fourth column
    is the number of added motions. ``tets`` (n, 4).

    The motion is that of four equal masses: u + omega x r with I omega = sum(r x v), solved by Cramer's rule.
    """
    sums, tets, x, v, quanta = _read(table)
    r, u = np.empty((4, 3)), np.empty(3)
    inertia, spin, turn = np.empty((3, 3)), np.empty(3), np.empty(3)
    for e in range(first * CHUNK, min(stop * CHUNK, len(tets))):
        # 1. Compute the centre, the mean velocity u, and the corners r relative to the centre.
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
        # 2. Compute the angular momentum sum(r x v) and the inertia I of four unit masses.
        for a in range(4):
            square = r[a, 0] * r[a, 0] + r[a, 1] * r[a, 1] + r[a, 2] * r[a, 2]
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                spin[i] += r[a, j] * v[tets[e, a], k] - r[a, k] * v[tets[e, a], j]
                inertia[i, i] += square
                for m in range(3):
                    inertia[i, m] -= r[a, i] * r[a, m]
        # 3. Solve I omega = sum(r x v) by Cramer's rule; omega = 0 for a thin tet.
        trace = inertia[0, 0] + inertia[1, 1] + inertia[2, 2]
        det = _det(inertia[0], inertia[1], inertia[2])
        turn[:] = 0.0
        if det > _THIN * trace**3:
            turn[0] = _det(spin, inertia[1], inertia[2]) / det
            turn[1] = _det(inertia[0], spin, inertia[2]) / det
            turn[2] = _det(inertia[0], inertia[1], spin) / det
        # 4. Add u + omega x r, and the count 1, to the sums of the corners.
        for a in range(4):
            node = tets[e, a]
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                sums[node, i] += np.int64(np.rint(quanta * (u[i] + turn[j] * r[a, k] - turn[k] * r[a, j])))
            sums[node, 3] += 1
