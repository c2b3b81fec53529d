"""Test whether the active contacts of a step need no impulse. If so, the solver has nothing to do.

A step is quiet under three conditions: no active contact has a stored impulse; no active contact closes faster than its
target; no node of an active contact would end the step behind a wall or a symmetry plane. In a quiet step the sweeps
would not change any bit of the velocities.
"""

from ...kernels.jit import njit, types
from ..narrow_phase.tables import CONTACT_ROWS, CRACK
from .active import KEPT
from .loading import normal_speed
from .stops import STOPS, SURFACE

_F, _N1, _I = types.float64, types.int32[::1], types.int64


@njit(types.boolean(STOPS, SURFACE, types.boolean[::1], _F, types.int64), cache=True)
def _stopped(stops, nodes, loose, dt, a):  # type: ignore[no-untyped-def]
    """True if node ``a`` would end a step of length ``dt``, s, behind a plane of ``stops``; see stops.find and
    stops.stop.
    """
    x, v, mobility, part, local = nodes
    for k in range(len(stops.points)):
        side = stops.sides[k, part[a]]
        if side == 0.0 or (stops.mirrors[k] and local[a] >= 0 and loose[local[a]]):
            continue
        gap, along, speed = 0.0, 0.0, 0.0
        for i in range(3):
            gap += side * stops.normals[k, i] * (x[a, i] - stops.points[k, i])
            if mobility[a, i] > 0.0:
                along += stops.normals[k, i] * stops.normals[k, i]
                speed += side * stops.normals[k, i] * v[a, i]
        if along > 0.0 and not speed >= -gap / dt:
            return True
    return False


@njit(_I(CONTACT_ROWS, _N1, KEPT, STOPS, SURFACE, types.boolean[::1], _F, _I, _I), cache=True)
def needs_impulse(rows, found, kept, stops, nodes, loose, dt, first, stop):  # type: ignore[no-untyped-def]
    """Returns 1 if at least one of the contacts ``found`` from ``first`` to ``stop`` may need an impulse in a step of
    length ``dt``, s, else 0. ``rows``: rows of the narrow phase; ``kept``: stored impulses; ``nodes``: surface nodes;
    ``loose`` (nodes,): nodes without tets.
    """
    for q in range(first, stop):
        p = found[q]
        j = rows.pair[p]
        if (j >= 0 and kept.pairs[j, 0] > 0.0) or (j <= CRACK and kept.cracks[CRACK - j, 0] > 0.0):
            return 1
        a, b, c, d = rows.nodes[p, 0], rows.nodes[p, 1], rows.nodes[p, 2], rows.nodes[p, 3]
        two = b == c
        speed = normal_speed(rows.normals, rows.weights, p, nodes.v, 0, a, b, c, d, two)
        if not speed >= rows.wanted[p]:
            return 1
        for k in range(2 if two else 4):
            if _stopped(stops, nodes, loose, dt, rows.nodes[p, k]):
                return 1
    return 0
