"""Test whether the active contacts of a step need no impulse. The solver has nothing to do in such a step.

A step is quiet if no active contact has a stored impulse, none closes faster than its target, and no node of an active
contact would end the step behind a wall or a plane of symmetry. All sweeps of the step would then leave the velocities
as they are, to the bit.
"""

import numpy as np

from ...kernels.jit import njit, types
from ...model.growing import Scratch
from ...model.state import Flags
from ...parallel.arguments import reader
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team
from ..narrow_phase.rows import ActiveRows
from ..narrow_phase.tables import CONTACT_ROWS, CRACK
from ..surface.records import SurfaceNodes
from .active import KEPT, Kept
from .loading import normal_speed
from .stops import STOPS, Stops

_CONTACTS = 1024
"""Number of contacts in a task. Chosen value: 20 us of work, compared with 2 us to start a parallel region."""
_F, _F2, _N1, _I1 = types.float64, types.float64[:, ::1], types.int32[::1], types.int64[::1]
_QUIET = _I1, CONTACT_ROWS, _N1, KEPT, STOPS, _F2, _F2, _F2, _N1, _N1, types.boolean[::1], _F
_quiet = reader(*_QUIET)


@njit(types.boolean(STOPS, _F2, _F2, _F2, _N1, _N1, types.boolean[::1], _F, types.int64), cache=True)
def _stopped(stops, x, v, mobility, part, local, loose, dt, a):  # type: ignore[no-untyped-def]
    """Whether node ``a`` would end a step ``dt``, s, behind a plane of ``stops``: see stops.find and stops.stop."""
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


@njit(TASK, cache=True)
def _task(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: writes 1 if a contact from ``first`` to ``stop`` may need an impulse, else 0."""
    out, rows, found, kept, stops, x, v, mobility, part, local, loose, dt = _quiet(table)
    out[first // _CONTACTS] = 1
    for q in range(first, stop):
        p = found[q]
        j = rows.pair[p]
        if (j >= 0 and kept.pairs[j, 0] > 0.0) or (j <= CRACK and kept.cracks[CRACK - j, 0] > 0.0):
            return
        a, b, c, d = rows.nodes[p, 0], rows.nodes[p, 1], rows.nodes[p, 2], rows.nodes[p, 3]
        two = b == c
        speed = normal_speed(rows.normals, rows.weights, p, v, 0, a, b, c, d, two)
        if not speed >= rows.wanted[p]:
            return
        for k in range(2 if two else 4):
            if _stopped(stops, x, v, mobility, part, local, loose, dt, rows.nodes[p, k]):
                return
    out[first // _CONTACTS] = 0


class Quiet:
    """The test, on the threads of a rank."""

    def __init__(self, team: Team) -> None:
        self._pass = Pass(team, _task, *_QUIET, size=_CONTACTS)
        self._scratch = Scratch()

    def holds(self, rows: ActiveRows, nodes: SurfaceNodes, kept: Kept, stops: Stops, loose: Flags, dt: float) -> bool:
        """Whether the contacts ``rows`` of the surface ``nodes`` need no impulse in a step ``dt``, s; ``kept``: stored
        impulses; ``loose`` (nodes,): nodes without tets.
        """
        if not rows.n:
            return True
        out = self._scratch.of("out", self._pass.many(rows.n), np.int64)
        some = nodes.x, nodes.v, nodes.mobility, nodes.part, nodes.local, loose, dt
        self._pass.run(rows.n, out, rows.room, rows.found, kept, stops, *some)
        return not out.any()
