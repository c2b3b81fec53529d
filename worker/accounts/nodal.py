"""Kernels of the energy ledger: the accounts of nodes at time n."""

from ..kernels.jit import njit, types
from ..parallel.arguments import reader
from ..parallel.team import TASK

NODAL = 10
"""Number of rows of the result of ``of_nodes``."""
_F, _F1, _F2 = types.float64, types.float64[::1], types.float64[:, ::1]
OF_NODES = _F2, _F2, _F2, _F2, types.int64[:, ::1], _F, _F1, _F1, _F1, _F1, types.boolean[::1]
"""Types of the arguments of ``of_nodes``."""
_nodal = reader(*OF_NODES)


@njit("void(float64[::1], float64[::1], int32[::1], float64[::1], float64[::1])", cache=True)
def add_booked(loss, external, nodes, lost, worked):  # type: ignore[no-untyped-def]
    """Add the energies ``lost`` and ``worked`` of the nodes (n,) of a boundary to the columns of all nodes."""
    for i in range(len(nodes)):
        loss[nodes[i]] += lost[i]
        external[nodes[i]] += worked[i]


@njit(TASK, cache=True, error_model="numpy")
def of_nodes(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Set ``out`` (NODAL, nodes) to the energies and momenta of each node at time n; zeros for nodes that are not
    ``owned``.

    Rows: 0 kinetic energy, J; 1 energy lost by impacts, J; 2 external work, J; 3 to 5 momentum, kg m/s; 6 energy lost
    to the change of the step length, J; 7 to 9 angular momentum about the origin, kg m^2/s.
    """
    out, at, before, v, force, shorter, stepping, mass, loss, external, owned = _nodal(table)
    at, before, v, force = at[first:stop], before[first:stop], v[first:stop], force[first:stop]
    stepping, mass, loss = stepping[first:stop], mass[first:stop], loss[first:stop]
    external, owned, out = external[first:stop], owned[first:stop], out[:, first:stop]
    for a in range(len(mass)):
        if not owned[a]:
            out[:, a] = 0.0
            continue
        half, x, y, z = 0.5 * mass[a], before[a, 0], before[a, 1], before[a, 2]
        power = x * force[a, 0] + y * force[a, 1] + z * force[a, 2]
        squares = x * v[a, 0] + y * v[a, 1] + z * v[a, 2]
        # Kinetic energy: 1/2 m v(n-1/2) . v(n+1/2) + 1/4 (dt- - dt+) v(n-1/2) . f(n). The kick has already added the
        # second term to the loss, so the loss is reduced by this term until time n.
        out[0, a], out[1, a], out[2, a] = half * squares + shorter * power, loss[a], external[a]
        # Momentum: p(n) = m (v(n-1/2) + v(n+1/2)) / 2
        p, q, r = half * (x + v[a, 0]), half * (y + v[a, 1]), half * (z + v[a, 2])
        out[3, a], out[4, a], out[5, a], out[6, a] = p, q, r, stepping[a] - shorter * power
        # Angular momentum: x(n) x p(n)
        out[7, a] = at[a, 1] * r - at[a, 2] * q
        out[8, a] = at[a, 2] * p - at[a, 0] * r
        out[9, a] = at[a, 0] * q - at[a, 1] * p
