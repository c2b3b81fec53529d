"""Contact of nodes across cracks, and the width of cracks."""

import numpy as np

from ...kernels.jit import njit, prefetch, types
from ...model.cache_lines import LINE
from ..geometry import at, cross, dot, half, minus, plus
from .tables import CONTACT_ROWS, CRACK, DEEP_SELF, NEAR, STEP, needed

_WIDE = 0.2
"""Ratio of the width of a crack to the typical size of a face, from which on the sides of the crack are surface. With
0.1, 33 of the 38 searches in the first 500 steps of the glass bar are caused by cracks that open without having been
included in a search; with 0.2, 2 of 32 searches."""
_FORESEEN = 0.5
"""Fraction of the width _WIDE. The faces of a crack that is wider are in the broad phase, so that their candidate pairs
exist when the crack opens."""
_AHEAD = 8
"""Distance, in cracks, by which kernels prefetch the data of nodes."""


@njit("int64[::1](int32[:, ::1], float64[:, ::1], float64)", cache=True)
def widening(cracks, x, typical):  # type: ignore[no-untyped-def]
    """Returns the rows of those ``cracks`` (m, 6) whose faces must be in the broad phase, because the cracks are wide
    at the positions ``x`` (slots, 3). The nodes of the cracks are given by slots; ``typical``: size of a face, m.
    """
    rows, n = np.empty(len(cracks), np.int64), 0
    for c in range(len(cracks)):
        if cracks[c, 0] < 0:
            continue
        most = 0.0
        for k in range(3):
            p, q, apart = cracks[c, k], cracks[c, 3 + k], 0.0
            for i in range(3):
                apart += (x[q, i] - x[p, i]) ** 2
            most = max(most, apart)
        if most >= (_FORESEEN * _WIDE * typical) ** 2:
            rows[n] = c
            n += 1
    return rows[:n].copy()


# A crack between face (0, 1, 2) of one tet, counter-clockwise seen from outside of it, and nodes (3, 4, 5) across, seen
# along the facet (nodes 2 and 5 behind):
#
#       3 -------- 4           side of the other tet       m: unit normal of the mean of both sides, from (0, 1, 2)
#       |   ^ m    |           width_k = x_(3+k) - x_k     gap = m . width_k, weights (1, -1) of nodes 3 + k and k
#       0 -------- 1           side of the first tet
#
# Conditions of a contact of the pair k = 0, 1, 2:
# 1. The two nodes of the pair have separated.
# 2. With h the size of the facet: the gap is at most NEAR h at the end of the step, and at least -DEEP_SELF h at
#    the start of the step.
# 3. The parts of the two nodes may be in contact.
# The sides of the crack become surface when the gap of a pair reaches _WIDE times the typical size of a face.


@njit(
    types.UniTuple(types.int64, 2)(  # type: ignore[no-untyped-call]
        CONTACT_ROWS, types.int64, types.int64[::1], types.int32[:, ::1], types.float64, STEP, types.int64, types.int64
    ),
    cache=True,
    error_model="numpy",
)
def across(out, base, opening, cracks, typical, step, first, stop):  # type: ignore[no-untyped-def]
    """Writes contacts of nodes across the ``cracks`` (m, 6; -1 for cracks of other ranks) from ``first`` to ``stop``.
    The contacts are written to the rows of ``out`` from ``base + 3 first`` on.

    ``typical``: size of a face, m. Returns the number of contacts, and the number of cracks that have become wide
    enough to open. Writes the numbers of the cracks that open to ``opening`` (m,), from ``first`` on.
    """
    x, v, part, mu, dt = step.x, step.v, step.part, step.mu, step.dt
    n, wide = base + 3 * first, first
    for c in range(first, stop):
        for k in range(6):
            near = max(cracks[min(c + _AHEAD, len(cracks) - 1), k], 0)
            prefetch(x, LINE * near)
            prefetch(v, 3 * near)
        if cracks[c, 0] < 0:
            continue
        start = plus(at(x, cracks[c, 0]), at(x, cracks[c, 3]))
        e = half(minus(plus(at(x, cracks[c, 1]), at(x, cracks[c, 4])), start))
        f = half(minus(plus(at(x, cracks[c, 2]), at(x, cracks[c, 5])), start))
        m = cross(e, f)
        twice = np.sqrt(dot(m, m))
        size, m = np.sqrt(twice), (m[0] / twice, m[1] / twice, m[2] / twice)
        most = 0.0
        for k in range(3):
            p, q = cracks[c, k], cracks[c, 3 + k]
            if p == q:  # condition 1: the nodes have separated
                continue
            width = minus(at(x, q), at(x, p))
            most = max(most, dot(width, width))
            gap0, speed = dot(m, width), dot(m, minus(at(v, q), at(v, p)))
            gap1 = gap0 + dt * speed
            if not (gap1 <= NEAR * size and gap0 >= -DEEP_SELF * size and mu[part[p], part[q]] >= 0.0):  # items 2, 3
                continue
            out.nodes[n, 0], out.nodes[n, 1], out.nodes[n, 2], out.nodes[n, 3] = q, p, p, p
            out.weights[n, 0], out.weights[n, 1], out.weights[n, 2], out.weights[n, 3] = 1.0, -1.0, 0.0, 0.0
            out.normals[n, 0], out.normals[n, 1], out.normals[n, 2] = m
            out.wanted[n] = speed + needed(gap0, gap1, speed, step.give, dt)
            out.friction[n], out.pair[n] = mu[part[p], part[q]], CRACK - (3 * c + k)
            n += 1
        if most >= (_WIDE * typical) ** 2:  # the crack opens
            opening[wide] = c
            wide += 1
    return n - base - 3 * first, wide - first
