"""Initial values of nodes that are copies of other nodes."""

from ..kernels.jit import njit


@njit(
    "void(int32[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], int64[:, ::1], float64[::1], "
    "int64[::1], float64[::1], int64)",
    cache=True,
)
def inherit(part, x0, x, v, mass, force, stepping, parents, masses, n):  # type: ignore[no-untyped-def]
    """Set the rows from ``n`` on of nodal columns.

    The new rows are copies of ``parents`` (k,) with zero force and zero lost energy. Each copy takes its mass
    ``masses`` (k,), kg, from its parent.
    """
    for c in range(len(parents)):
        a = parents[c]
        part[n + c] = part[a]
        for i in range(3):
            x0[n + c, i], x[n + c, i], v[n + c, i], force[n + c, i] = x0[a, i], x[a, i], v[a, i], 0
        mass[n + c], stepping[n + c] = masses[c], 0.0
        mass[a] -= masses[c]
