"""Heat and bulking in the averaged pressure forms: what nodes are told of besides the change of volume.

An equation of state with heat sees the energy averaged as the volume strain is: heat of a tet alone would drive it
against its neighbours, and volumes of nodes would not resist. So would bulking of its own.
"""

import numpy as np

from ..kernels.jit import njit
from ..materials.law import BULK, DENSITY
from ..model.rows import BULKING, BULKING_STEP, CORNERS, HEAT, MASS, NODAL_WORK, WORK, WORK_AVERAGED, WORK_VISCOUS
from ..model.state import CHUNK
from .pressure import QUANTA
from .tet4 import CORNER_CHANGE, VOLUME_MID

_WORK, _WORK_VISCOUS, _TAKEN = WORK * CHUNK, WORK_VISCOUS * CHUNK, WORK_AVERAGED * CHUNK
_MASS, _HEAT, _NODAL_WORK = MASS * CHUNK, HEAT * CHUNK, NODAL_WORK * CHUNK
_BULKING, _BULKING_STEP, _CORNERS = BULKING * CHUNK, BULKING_STEP * CHUNK, CORNERS * CHUNK
HEATED = NODAL_WORK + 1
"""Rows of a tet with heat; one with bulking has more."""


@njit("void(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy", forceinline=True)
def take_bulking(s, params, i, more):  # type: ignore[no-untyped-def]
    """Adds ``more`` to the bulking of tet ``i``, Pa, and what that stores, for the law has given what its own would
    store to the nodes. As there (materials/johnson_holmquist.py) it is (K m + bulking)^2 / 2K of a volume, of a quarter
    at each corner; none where the matter is wider than without stress.
    """
    bulk, stored = params[BULK], 0.0
    for k in range(4):
        ratio = s[_CORNERS + k * CHUNK + i]
        whole = bulk * (1.0 / ratio - 1.0) + s[_BULKING + i]
        before, after = max(whole, 0.0), max(whole + more, 0.0)
        stored += ratio * (after * after - before * before)
    s[_TAKEN + i] -= 0.125 * s[_MASS + i] / (params[DENSITY] * bulk) * stored
    s[_BULKING + i] += more


@njit("void(int64[:, ::1], float64[::1], float64[::1], float64[::1], float64[::1], uint32[:, ::1], int64)", cache=True)
def scatter_heat(sums, w, s, params, weight, tets, n):  # type: ignore[no-untyped-def]
    """Adds a quarter of what each tet has got of work since the last time, over its mass, to the sums of its nodes.

    By volume, as the volume changes, and in units of the bulk modulus over the density; ``sums`` (nodes, 3).
    """
    unit = params[DENSITY] / params[BULK]
    for i in range(n):
        work = s[_WORK + i] + s[_WORK_VISCOUS + i]
        heat = 0.25 * w[VOLUME_MID + i] * unit * (work - s[_NODAL_WORK + i]) / s[_MASS + i]
        s[_NODAL_WORK + i] = work
        for k in range(4):
            a = tets[i, k]
            sums[a, 2] += np.int64(np.rint(heat * weight[a] * QUANTA))


@njit("void(int64[:, ::1], float64[::1], float64[::1], float64[::1], float64[::1], uint32[:, ::1], int64)", cache=True)
def scatter_bulking(sums, w, s, params, weight, tets, n):  # type: ignore[no-untyped-def]
    """Adds a quarter of the new bulking of each tet to the sums of its nodes, by volume as ``scatter_heat``.

    In units of the bulk modulus. A flat tet, which has no volume here, keeps it for itself.
    """
    per_bulk = 1.0 / params[BULK]
    for i in range(n):
        if w[VOLUME_MID + i] == 0.0:
            take_bulking(s, params, i, s[_BULKING_STEP + i])
        share = 0.25 * w[VOLUME_MID + i] * per_bulk * s[_BULKING_STEP + i]
        s[_BULKING_STEP + i] = 0.0
        for k in range(4):
            a = tets[i, k]
            sums[a, 2] += np.int64(np.rint(share * weight[a] * QUANTA))


@njit(
    "void(int64[:, ::1], float64[::1], float64[::1], float64[::1], float64[::1], uint32[:, ::1], int64, int64)",
    cache=True,
)
def scatter_more(sums, w, s, params, weight, tets, rows, n):  # type: ignore[no-untyped-def]
    """Heat, or bulking: what a tet with so many ``rows`` has."""
    if rows == HEATED:
        scatter_heat(sums, w, s, params, weight, tets, n)
    else:
        scatter_bulking(sums, w, s, params, weight, tets, n)


@njit("void(float64[::1], float64[::1], uint32[:, ::1], int64)", cache=True)
def gather_heat(s, heat, tets, n):  # type: ignore[no-untyped-def]
    """HEAT: what the pressure of each tet sees grows by the mean of the four nodes."""
    for i in range(n):
        s[_HEAT + i] += 0.25 * ((heat[tets[i, 0]] + heat[tets[i, 1]]) + (heat[tets[i, 2]] + heat[tets[i, 3]]))


@njit("void(float64[::1], float64[::1], float64[::1], uint32[:, ::1], boolean[::1], int64)", cache=True)
def gather_bulking(s, params, bulking, tets, flat, n):  # type: ignore[no-untyped-def]
    """BULKING: that of each tet grows by the mean of the four nodes; ``flat`` (n,), or (0,), have their own."""
    quarter = 0.25 * params[BULK]
    for i in range(n):
        if len(flat) == 0 or not flat[i]:
            a, b, c, d = tets[i, 0], tets[i, 1], tets[i, 2], tets[i, 3]
            take_bulking(s, params, i, quarter * ((bulking[a] + bulking[b]) + (bulking[c] + bulking[d])))


@njit("void(float64[::1], float64[::1], int64, int64, float64)", cache=True, error_model="numpy", forceinline=True)
def stretch_corner(w, s, i, k, strain):  # type: ignore[no-untyped-def]
    """The ratio of volumes at corner ``k`` of tet ``i`` after a volume strain; CORNER_CHANGE."""
    half, before = 0.5 * strain, s[_CORNERS + k * CHUNK + i]
    after = before * (1.0 + half) / (1.0 - half)
    s[_CORNERS + k * CHUNK + i], w[CORNER_CHANGE + k * CHUNK + i] = after, after - before


@njit(
    "void(float64[::1], float64[::1], float64[::1], float64[::1], uint32[:, ::1], float64[::1], boolean[::1], int64)",
    cache=True,
)
def gather_corners(w, s, params, bulking, tets, strain, flat, n):  # type: ignore[no-untyped-def]
    """Bulking as a mean over nodes, the ratio of volumes at each node, and CORNER_CHANGE, by how much it has changed.

    Heat stays at the nodes (matter.py).
    """
    gather_bulking(s, params, bulking, tets, flat, n)
    for i in range(n):
        if len(flat) == 0 or not flat[i]:
            for k in range(4):
                stretch_corner(w, s, i, k, strain[tets[i, k]])
