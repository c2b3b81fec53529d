"""Tasks of the passes of the fracture criterion (parallel/team.py)."""

from ..kernels.jit import njit, types
from ..parallel.arguments import reader
from ..parallel.team import TASK
from . import criterion
from .records import CANDIDATES, LAW, MESH, POINTS, TABLE

TETS_OF_A_TASK = 4096
"""Number of tets in a task. Chosen value: a task takes 5 us if no facet is overstressed."""
_I1, _U1 = types.int64[::1], types.uint8[::1]
COUNT = CANDIDATES, _U1, MESH, _I1
SEARCH = CANDIDATES, _I1, _I1, _U1, MESH, TABLE, POINTS, LAW
_count, _search = reader(*COUNT), reader(*SEARCH)


@njit(TASK, cache=True)
def count(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: writes the number of overstressed facets of each task to ``counts`` (tasks,)."""
    out, hot, mesh, counts = _count(table)
    counts[first // TETS_OF_A_TASK] = criterion.overstressed(out, 0, 0, hot, mesh, first, stop)


@njit(TASK, cache=True)
def search(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``criterion.overstressed`` and ``criterion.within``. The task writes to its own rows of ``out``:
    ``counts[k]`` rows from row ``begins[k]`` on. Then the task replaces its count by the number of candidates.
    """
    out, begins, counts, hot, mesh, facets, x, law = _search(table)
    k = first // TETS_OF_A_TASK
    begin, end = begins[k], begins[k] + counts[k]
    if end > begin:
        criterion.overstressed(out, begin, end, hot, mesh, first, stop)
        counts[k] = criterion.within(out, mesh, facets, x, law, begin, end)
