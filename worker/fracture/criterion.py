"""Which facets pass the criterion: the traction on a facet, from the stress of the tets on either side.

A facet breaks by sqrt(<t_n>^2 + w t_s^2), with the Macaulay bracket that the paper's eq. (1) lacks, and under pressure
by sqrt(w) <t_s - mu |t_n|> (Camacho and Ortiz 1996). Both are bounded by the first form, which is convex: the mean of
two tractions passes only where one of them does. So the pass over the elements marks each tet's own faces that pass,
and only facets with such a face are looked at. Of those, only the ones whose mean traction reaches the weakest face of
the tets on either side can pass, and only they are told: strengths are computed for few.
"""

import numpy as np

from ..jit import njit
from ..mesh.faces import FACES
from ..state import CHUNK, INTACT, PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ

_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_P = PRESSURE * CHUNK
_NEAR = 1.0 - 1e-12
"""Of the weakest strength: a facet's own is computed anew with other nodes once they have separated, and may round
otherwise; both of its sides must tell it all the same.
"""


@njit("void(float64[::1], float64[::1], int64, int64, float64[::1])", cache=True)
def traction(t, state, rows, e, normal):  # type: ignore[no-untyped-def]
    """``t`` (3,): stress of tet ``e`` without the viscous part times ``normal``, Pa."""
    at = (e // CHUNK) * rows * CHUNK + e % CHUNK
    p = state[at + _P]
    xx, yy, zz = state[at + _SXX] - p, state[at + _SYY] - p, state[at + _SZZ] - p
    yz, zx, xy = state[at + _SYZ], state[at + _SZX], state[at + _SXY]
    nx, ny, nz = normal[0], normal[1], normal[2]
    t[0], t[1], t[2] = xx * nx + xy * ny + zx * nz, xy * nx + yy * ny + yz * nz, zx * nx + yz * ny + zz * nz


@njit("float64(float64[::1], float64[:, ::1], uint32[::1], int64)", cache=True, error_model="numpy")
def outward(normal, x, tet, face):  # type: ignore[no-untyped-def]
    """Unit normal of a face of a tet, out of it, from the present positions; returns the area, m^2.

    Computed in the order of the nodes' ids, so that the two sides have the same bits with opposite signs.
    """
    a, b, c = tet[FACES[face, 0]], tet[FACES[face, 1]], tet[FACES[face, 2]]
    sign = 1.0
    if a > b:
        a, b, sign = b, a, -sign
    if b > c:
        b, c, sign = c, b, -sign
    if a > b:
        a, b, sign = b, a, -sign
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        normal[i] = (x[b, j] - x[a, j]) * (x[c, k] - x[a, k]) - (x[b, k] - x[a, k]) * (x[c, j] - x[a, j])
    length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    for i in range(3):
        normal[i] *= sign / length
    return 0.5 * length


@njit("float64(float64[::1], float64[::1], float64, float64)", cache=True)
def effective(t, normal, weight, friction):  # type: ignore[no-untyped-def]
    """The effective traction, Pa, of a traction ``t`` on a facet."""
    along = t[0] * normal[0] + t[1] * normal[1] + t[2] * normal[2]
    across = max(t[0] * t[0] + t[1] * t[1] + t[2] * t[2] - along * along, 0.0)
    if along >= 0.0:
        return np.sqrt(along * along + weight * across)
    return np.sqrt(weight) * max(np.sqrt(across) + friction * along, 0.0)


@njit(
    "int64(int32[:, ::1], float64[:, ::1], int64[::1], uint8[::1], uint8[:, ::1], int32[:, ::1], int32[:, ::1], "
    "int64[::1], uint32[:, ::1], float64[::1], float64[:, ::1], float64[::1], int64, float64, float64)",
    cache=True,
)
def look(out, tractions, chosen, hot, bond, across, beside, ids, tets, state, x, weakest, rows, weight, friction):  # type: ignore[no-untyped-def]
    """Tractions on the intact facets within this rank that have a hot face, of the tets at ``chosen``, and reach what
    is ``weakest`` (tets,), Pa, on either side.

    Fills ``out`` (m, 2), place and face on the side of the smaller tet id, and ``tractions`` (m, 4), the vector on that
    side's outward normal and the effective traction, Pa; returns how many there are.
    """
    n = 0
    normal, one, two = np.empty(3), np.empty(3), np.empty(3)
    for e in chosen:
        for k in range(4):
            if not (hot[e] >> k) & 1 or bond[e, k] != INTACT or beside[e, k] < 0:
                continue
            other, far = beside[e, k], across[e, k] % 4
            first = ids[e] < ids[other]
            if not first and (hot[other] >> far) & 1:
                continue
            a, b, face = (e, other, k) if first else (other, e, far)
            outward(normal, x, tets[a], face)
            traction(one, state, rows, a, normal)
            traction(two, state, rows, b, normal)
            for i in range(3):
                one[i] = 0.5 * (one[i] + two[i])
                tractions[n, i] = one[i]
            out[n, 0], out[n, 1] = a, face
            tractions[n, 3] = effective(one, normal, weight, friction)
            n += tractions[n, 3] >= _NEAR * max(weakest[a], weakest[b])
    return n


@njit(
    "void(float64[:, ::1], int64[::1], int32[:, ::1], boolean[::1], uint8[:, ::1], uint32[:, ::1], float64[::1], "
    "float64[:, ::1], int64)",
    cache=True,
)
def own_tractions(tractions, chosen, sides, first, bond, tets, state, x, rows):  # type: ignore[no-untyped-def]
    """``tractions`` (m, 3), Pa, of this rank's tets on the intact ones of the ``chosen`` facets, which it shares with
    another rank, on the outward normal of the side of the smaller tet id. ``sides`` (m, 2): place and face; ``first``
    (m,): whether that side is this one.
    """
    normal = np.empty(3)
    for m in chosen:
        if bond[sides[m, 0], sides[m, 1]] == INTACT:
            outward(normal, x, tets[sides[m, 0]], sides[m, 1])
            if not first[m]:
                normal *= -1.0
            traction(tractions[m], state, rows, sides[m, 0], normal)


@njit(
    "int64(int64[::1], float64[:, ::1], int64[::1], float64[:, ::1], float64[:, ::1], int32[:, ::1], boolean[::1], "
    "uint8[:, ::1], uint32[:, ::1], float64[:, ::1], float64[::1], float64, float64)",
    cache=True,
)
def meet(out, tractions, chosen, own, theirs, sides, first, bond, tets, x, weakest, weight, friction):  # type: ignore[no-untyped-def]
    """Means of this rank's ``own`` (m, 3) tractions and ``theirs``, with the effective ones, Pa, on those of the
    ``chosen`` facets that are intact and where they reach what is ``weakest`` (tets,) on this side.

    Fills ``out``, which of the m they are, and ``tractions`` (., 4); returns how many there are.
    """
    n = 0
    normal = np.empty(3)
    for m in chosen:
        e = sides[m, 0]
        if bond[e, sides[m, 1]] != INTACT:
            continue
        outward(normal, x, tets[e], sides[m, 1])
        if not first[m]:
            normal *= -1.0
        for i in range(3):
            tractions[n, i] = 0.5 * (own[m, i] + theirs[m, i])
        tractions[n, 3] = effective(tractions[n, :3], normal, weight, friction)
        out[n] = m
        n += tractions[n, 3] >= _NEAR * weakest[e]
    return n
