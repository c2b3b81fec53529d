"""Nodal means of heat and bulking in the averaged pressure forms.

An equation of state with heat uses an energy that is averaged in the same way as the volume strain. The own heat of a
tet would increase its pressure relative to its neighbours, and the averaged volume strain would not reduce this
pressure. Bulking is averaged in the same way as heat.
"""

import numpy as np

from ..kernels.jit import njit
from ..materials.law import BULK, DENSITY
from ..model.rows import BULKING, BULKING_STEP, CORNERS, HEAT, MASS, NODAL_WORK, WORK, WORK_AVERAGED, WORK_VISCOUS
from ..model.state import CHUNK
from .pressure import QUANTA
from .scratch import CORNER_CHANGE, VOLUME_MID

_WORK, _WORK_VISCOUS, _TAKEN = WORK * CHUNK, WORK_VISCOUS * CHUNK, WORK_AVERAGED * CHUNK
_MASS, _HEAT, _NODAL_WORK = MASS * CHUNK, HEAT * CHUNK, NODAL_WORK * CHUNK
_BULKING, _BULKING_STEP, _CORNERS = BULKING * CHUNK, BULKING_STEP * CHUNK, CORNERS * CHUNK
HEATED = NODAL_WORK + 1
"""Number of state rows of a tet with heat. A tet with bulking has more rows."""


@njit("void(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy", forceinline=True)
def take_bulking(s, params, i, more):  # type: ignore[no-untyped-def]
    """Adds ``more`` to the bulking pressure of tet ``i``, Pa. Corrects the row TAKEN by the change of the stored
    energy, because the law has used the energy that its own bulking would store at the nodes.

    As in materials/johnson_holmquist.py, the stored energy per volume is (K m + bulking)^2 / 2K, with a quarter of the
    volume at each corner. The stored energy is zero if the material is expanded beyond zero stress.
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
    """Adds the specific work of each tet since the last step to the sums of its nodes. Each node gets a quarter.

    The heat has the unit bulk modulus / density, and is weighted by volume, in the same way as the volume change.
    ``sums`` (nodes, 3).
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
    """Adds a quarter of the new bulking of each tet to the sums of its nodes, weighted by volume as in
    ``scatter_heat``.

    The unit of bulking in the nodal sum is the bulk modulus. A flat tet has the volume zero in the nodal sum and
    therefore gives no bulking to its nodes.
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
    """Adds heat or bulking to the sums of the nodes; the number of state ``rows`` determines which of the two."""
    if rows == HEATED:
        scatter_heat(sums, w, s, params, weight, tets, n)
    else:
        scatter_bulking(sums, w, s, params, weight, tets, n)


@njit("void(float64[::1], float64[::1], uint32[:, ::1], int64)", cache=True)
def gather_heat(s, heat, tets, n):  # type: ignore[no-untyped-def]
    """Adds the mean heat of the four nodes to the row HEAT, which is the heat in the pressure of each tet."""
    for i in range(n):
        s[_HEAT + i] += 0.25 * ((heat[tets[i, 0]] + heat[tets[i, 1]]) + (heat[tets[i, 2]] + heat[tets[i, 3]]))


@njit("void(float64[::1], float64[::1], float64[::1], uint32[:, ::1], boolean[::1], int64)", cache=True)
def gather_bulking(s, params, bulking, tets, flat, n):  # type: ignore[no-untyped-def]
    """Adds the mean bulking of the four nodes to the row BULKING. Tets that are ``flat``, (n,) or (0,), use their own
    bulking.
    """
    quarter = 0.25 * params[BULK]
    for i in range(n):
        if len(flat) == 0 or not flat[i]:
            a, b, c, d = tets[i, 0], tets[i, 1], tets[i, 2], tets[i, 3]
            take_bulking(s, params, i, quarter * ((bulking[a] + bulking[b]) + (bulking[c] + bulking[d])))


@njit("void(float64[::1], float64[::1], int64, int64, float64)", cache=True, error_model="numpy", forceinline=True)
def stretch_corner(w, s, i, k, strain):  # type: ignore[no-untyped-def]
    """Updates the volume ratio at corner ``k`` of tet ``i`` by a volume strain. Sets the row CORNER_CHANGE."""
    half, before = 0.5 * strain, s[_CORNERS + k * CHUNK + i]
    after = before * (1.0 + half) / (1.0 - half)
    s[_CORNERS + k * CHUNK + i], w[CORNER_CHANGE + k * CHUNK + i] = after, after - before


@njit(
    "void(float64[::1], float64[::1], float64[::1], float64[::1], uint32[:, ::1], float64[::1], boolean[::1], int64)",
    cache=True,
)
def gather_corners(w, s, params, bulking, tets, strain, flat, n):  # type: ignore[no-untyped-def]
    """Updates the bulking as a mean over nodes, the volume ratio at each node, and the row CORNER_CHANGE, which is the
    change of the volume ratio.

    Heat remains at the nodes (matter.py).
    """
    gather_bulking(s, params, bulking, tets, flat, n)
    for i in range(n):
        if len(flat) == 0 or not flat[i]:
            for k in range(4):
                stretch_corner(w, s, i, k, strain[tets[i, k]])
