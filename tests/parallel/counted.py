"""A kernel of tasks for tests, which counts the numbers of its range."""

from conoid.worker.kernels.jit import njit, types
from conoid.worker.parallel.arguments import reader
from conoid.worker.parallel.team import TASK

KINDS = (types.int64[::1],)
_counts = reader(*KINDS)


@njit(TASK, cache=False)
def count(table, first, end, thread):  # type: ignore[no-untyped-def]
    """Adds 1 to the counter of each number of the range."""
    (done,) = _counts(table)
    for k in range(first, end):
        done[k] += 1
