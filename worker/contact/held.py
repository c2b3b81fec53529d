"""Between the nodes of a rank and those of the crowd that it holds: velocities there and back, and what contact cost.

``held`` (h,) places in the crowd and ``local`` (h,) indices on the rank of the same nodes.
"""

from ..jit import njit


@njit("void(float64[:, ::1], float64[:, ::1], int32[::1], int32[::1])", cache=True)
def gather(out, v, held, local):  # type: ignore[no-untyped-def]
    """Velocities of the held nodes."""
    for h in range(len(local)):
        for i in range(3):
            out[held[h], i] = v[local[h], i]


@njit("void(float64[:, ::1], float64[:, ::1], int32[::1], float64[:, ::1], float64[:, ::1], int32[::1])", cache=True)
def take(x, v, held, node_x, node_v, local):  # type: ignore[no-untyped-def]
    """Positions and velocities of the held nodes of a crowd."""
    for h in range(len(held)):
        for i in range(3):
            x[held[h], i], v[held[h], i] = node_x[local[h], i], node_v[local[h], i]


@njit(
    "boolean(float64[:, ::1], int64[:, ::1], int32[::1], int32[::1], float64[:, ::1], int64[:, ::1], int32[::1], "
    "boolean[::1])",
    cache=True,
)
def give_back(node_v, parts, local, held, v, total, part, owned):  # type: ignore[no-untyped-def]
    """Velocities of the held nodes, and the impulses of the owned ones to the sums of their parts; whether any."""
    pushed = False
    for h in range(len(held)):
        for i in range(3):
            j = total[held[h], i]
            node_v[local[h], i] = v[held[h], i]
            pushed |= j != 0
            if owned[local[h]]:
                parts[part[local[h]], i] += j
    return pushed


@njit(
    "void(float64[::1], float64[::1], int32[::1], int32[::1], float64[:, ::1], int64[:, ::1], float64[:, ::1], "
    "float64)",
    cache=True,
)
def book(loss, external, local, held, before, total, mobility, scale):  # type: ignore[no-untyped-def]
    """Half of the impulse times velocity: lost by contact; where a velocity is held, taken in from outside."""
    for h in range(len(held)):
        for i in range(3):
            work = 0.5 * before[held[h], i] * (total[held[h], i] / scale)
            loss[local[h]] -= work
            if mobility[held[h], i] == 0.0:
                external[local[h]] -= work
