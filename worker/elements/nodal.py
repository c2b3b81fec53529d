"""Nodal part of the averaged pressure forms, as tasks. The tasks compute the nodal means for the second pass from the
sums of the first pass over the tets.
"""

from ..kernels.jit import njit, types
from ..parallel.arguments import reader
from ..parallel.team import TASK
from .matter import press_node
from .pressure import QUANTA
from .records import MEANS

_FLAG, _F1 = types.boolean, types.float64[::1]
COMPLETE = (MEANS, _F1, _FLAG, _F1, _FLAG, types.int32[::1], types.int64[::1], types.float64[:, ::1])
"""Types of the arguments of ``complete``: means; (nodes,) array for volumes; flag, True if heat or bulking is averaged;
(nodes,) bulk modulus, Pa; flag, True if there are nodal pressures; (nodes,) part of each node; (parts,) TETS or LINEAR;
(parts, SIZE) constants."""
PROJECT = (MEANS, _F1, types.float64)
"""Types of the arguments of ``project``: means, nodal volumes, and number of quanta per newton of the sums."""
_complete, _project = reader(*COMPLETE), reader(*PROJECT)


@njit(TASK, cache=True, error_model="numpy")
def complete(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: computes nodal values from completed sums, and sets the sums to zero. The nodal values are the volume
    strain of the step, heat or bulking, nodal pressures at n+1, and nodal volumes, m^3; ``project`` uses the volumes. A
    node without tets has the strain zero.
    """
    means, volumes, more, bulk, pressed, part, kinds, params = _complete(table)
    sums, strain, extra, split, matter = means.sums, means.strain, means.more, means.split, means.matter
    pressure, gradient = means.pressure, means.gradient
    for a in range(begin, end):
        volume = sums[a, 1]
        found = sums[a, 0] / volume if volume > 0 else 0.0
        strain[a] = found
        if more:
            extra[a] = sums[a, 2] / volume if volume > 0 else 0.0
        if pressed:
            press_node(matter[a], found, kinds[part[a]], params[part[a]])
        if split:
            pressure[a] -= bulk[a] * found
            gradient[a, 0] = gradient[a, 1] = gradient[a, 2] = 0
            volumes[a] = max(volume, 1) / (means.weight[a] * QUANTA)
        for k in range(sums.shape[1]):
            sums[a, k] = 0


@njit(TASK, cache=True, error_model="numpy")
def project(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: computes the projected pressure gradient of nodes from the completed sums."""
    means, volumes, scale = _project(table)
    gradient, projected = means.gradient, means.projected
    for a in range(begin, end):
        per_volume = scale * volumes[a]
        for k in range(3):
            projected[a, k] = gradient[a, k] / per_volume
