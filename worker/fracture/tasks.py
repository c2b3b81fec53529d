"""Tasks of the passes of the fracture criterion (parallel/team.py)."""

from ..kernels.jit import njit, types
from ..parallel.arguments import reader
from ..parallel.team import TASK
from . import criterion
from .records import CANDIDATES, LAW, MESH, POINTS, TABLE

TETS_OF_A_TASK = 4096
"""Number of tets in a task. Chosen value: a task takes 5 us where no facet is overstressed."""
_I, _I1 = types.int64, types.int64[::1]
SEARCH = CANDIDATES, _I, types.uint8[::1], MESH, TABLE, POINTS, LAW, _I1, _I1
_search = reader(*SEARCH)


@njit(TASK, cache=True)
def search(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``criterion.overstressed`` and ``criterion.within``, in ``each`` rows of ``out`` for each task; writes the
    numbers of overstressed facets to ``needed`` (tasks,), and of candidates to ``counts`` (tasks,).
    """
    out, each, hot, mesh, facets, x, law, needed, counts = _search(table)
    k = first // TETS_OF_A_TASK
    needed[k] = criterion.overstressed(out, k * each, (k + 1) * each, hot, mesh, first, stop)
    counts[k] = criterion.within(out, mesh, facets, x, law, k * each, k * each + min(needed[k], each))
