"""Chunks at rest: chunks of tets that no wave has reached yet. A pass over a chunk at rest changes no value. Therefore
the pass is omitted, and the results are identical.

A chunk is marked as at rest after a complete pass under three conditions: all its nodes had zero velocity, the pass
changed no bit of its state, and the pass computed zero forces. A further pass would have the same result and the same
stable step. The results are equal because a pass depends only on the state, the nodal velocities, the positions, which
are constant at rest, and the time step, which is multiplied by zeros.
"""

import numpy as np

from ..kernels.jit import njit
from .forces import MAGNITUDE
from .scratch import LIMIT

NOTED, TET, STEADY = range(3)
"""Indices in the row of a chunk in ``Block.quiet``. NOTED: bit pattern of its largest 1 / stable step, 1/s; 0 if the
chunk is not marked as at rest. TET: smallest global id of its tets that have this limit. STEADY: 1 if the first of two
passes left its state unchanged."""


@njit("boolean(float64[:, ::1], uint32[:, ::1], int64)", cache=True)
def at_rest(v, tets, n):  # type: ignore[no-untyped-def]
    """Returns True if the velocity of all nodes of a chunk is exactly zero."""
    for i in range(n):
        for j in range(4):
            a = tets[i, j]
            for k in range(3):
                if np.float64(v[a, k]).view(np.int64) != 0:
                    return False
    return True


@njit("boolean(float64[::1], uint32[:, ::1], int64)", cache=True)
def without(strain, tets, n):  # type: ignore[no-untyped-def]
    """Returns True if all nodes of a chunk have zero volume strain in the step."""
    for i in range(n):
        for j in range(4):
            if np.float64(strain[tets[i, j]]).view(np.int64) != 0:
                return False
    return True


@njit("boolean(float64[::1], float64[::1])", cache=True)
def same(before, after):  # type: ignore[no-untyped-def]
    """Returns True if two states are bit-identical."""
    differ = np.int64(0)
    for i in range(len(before)):
        differ |= np.float64(before[i]).view(np.int64) ^ np.float64(after[i]).view(np.int64)
    return differ == 0


@njit("void(int64[::1], int64[::1], int64[::1], int64)", cache=True)
def note(quiet, bits, ids, n):  # type: ignore[no-untyped-def]
    """Marks a chunk as at rest. Stores the largest 1 / stable step from the pass over the chunk, and the smallest id of
    the tets that have it.
    """
    limit, first = 0, 0
    for i in range(n):
        own = bits[LIMIT + i] & MAGNITUDE
        if own > limit or (own == limit and ids[i] < first):
            limit, first = own, ids[i]
    quiet[NOTED], quiet[TET] = limit, first


@njit("void(int64[::1], int64[::1], int64, int64)", cache=True)
def pass_over(peaks, quiet, place, tet):  # type: ignore[no-untyped-def]
    """Updates the ``peaks`` with the values of a chunk that is marked as at rest. Its largest 1 / stable step goes to
    index ``place``, the smallest id of the tets that have it to index ``tet``.
    """
    if quiet[NOTED] > peaks[place]:
        peaks[place], peaks[tet] = quiet[NOTED], quiet[TET]
    elif quiet[NOTED] == peaks[place]:
        peaks[tet] = min(peaks[tet], quiet[TET])
