"""Averaged pressure forms. The pressure of a tet is computed from a volume strain that is averaged over its nodes.

Tets with one integration point and their own pressure lock in plastic flow. The form ``nodal`` replaces the volume
strain of a tet by the mean of the values of its nodes. The value of a node is the volume-weighted mean over the tets
around the node (averaged nodal pressure, Bonet and Burton 1998, in rate form). The pressure is stored for each tet, so
that any equation of state can be used and the separation of a node changes no pressure. The form ``split`` adds the
projection form of the operator split for pressure gradients to the nodal balance (Zienkiewicz et al. 1998). The term of
``split`` is an Oñate-Codina stabilisation: it is proportional to the difference between the pressure gradient of a tet
and the mean of the projected gradients of its nodes. The stabilisation vanishes for a linear pressure. Heat and bulking
are averaged in the same way as the volume strain (heat_and_bulking.py).

Nodal sums are integers. Each contribution is divided by the reference volume of the node. Therefore it is of order one
for any size of tets, and one fixed scale, QUANTA, is sufficient for all cases.
"""

import numpy as np

from ..kernels.jit import njit
from ..materials.law import BULK
from ..model.rows import DILATION, MASS, PRESSURE, TET_VOLUME, VOLUME_FLUX, WORK
from ..model.state import CHUNK
from .forces import largest_of, quanta
from .scratch import CHANGE, DILATATION, EDGE, NODAL, SEEN, SPEED, VOLUME, VOLUME_MID, VOLUME_SEEN

QUANTA = float(2**52)
"""Number of quanta for a volume strain of 1, and number of quanta for a relative nodal volume of 1."""

_FLUX, _VOLUME, _MASS = VOLUME_FLUX * CHUNK, TET_VOLUME * CHUNK, MASS * CHUNK
_WORK, _P, _GROWN = WORK * CHUNK, PRESSURE * CHUNK, DILATION * CHUNK
STABILISE = NODAL
"""First scratch row of the four stabilising volume fluxes, m^3/s."""
_PROJECTED = NODAL + 4 * CHUNK
"""First scratch row of the mean projected pressure gradient, Pa/m."""
_DIFFERENCE = NODAL + 7 * CHUNK
"""First scratch row of the pressures of nodes 1, 2, 3 less the pressure of node 0, Pa."""


@njit("void(float64[::1], float64[::1], int64)", cache=True)
def keep_flux(w, s, n):  # type: ignore[no-untyped-def]
    """Stores the volume flux of each tet, m^3/s, for the second pass over the elements."""
    for i in range(n):
        s[_FLUX + i] = w[DILATATION + i] * w[VOLUME_MID + i]


@njit("void(float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def subtract_dilation(w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Subtracts the tet's own dilation of the last step from its pressure. The pressure contains the nodal mean of the
    dilation instead.

    In the last step the law added the tet's own dilation to the pressure, so that the stress was on the yield surface.
    The function ``subtract_dilation`` subtracts the dilation and the work of the dilation. Afterwards DILATATION is the
    trace of the elastic strain rate.
    """
    if dt <= 0.0:
        return
    bulk, frequency = params[BULK], 1.0 / dt
    for i in range(n):
        grown = s[_GROWN + i]
        s[_P + i] -= bulk * grown
        s[_WORK + i] -= 0.5 * bulk * grown * s[_FLUX + i] * dt
        s[_GROWN + i] = 0.0 - grown
        w[DILATATION + i] -= grown * frequency


@njit("void(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def recall_flux(w, s, n, dt):  # type: ignore[no-untyped-def]
    """Sets the row CHANGE to the change of the tet's own volume in the step, m^3. Sets the row SPEED to its rate
    divided by the volume at the end, 1/s.
    """
    for i in range(n):
        w[CHANGE + i] = s[_FLUX + i] * dt
        w[SPEED + i] = s[_FLUX + i] / w[VOLUME + i]


@njit("void(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def recall_growth(w, s, n, dt):  # type: ignore[no-untyped-def]
    """Does the same as ``recall_flux`` for tets that store their volume. Also stores the present volume."""
    frequency = 1.0 / dt if dt > 0.0 else 0.0
    for i in range(n):
        volume = w[VOLUME + i]
        change = volume - s[_VOLUME + i] if dt > 0.0 else 0.0
        w[CHANGE + i] = change
        w[SPEED + i] = change * frequency / volume
        s[_VOLUME + i] = volume


@njit("void(int64[:, ::1], float64[::1], float64[::1], uint32[:, ::1], int64, float64)", cache=True)
def scatter_volumes(sums, w, weight, tets, n, dt):  # type: ignore[no-untyped-def]
    """Adds a quarter of the volume change and a quarter of the volume of each tet to the sums of its nodes.

    ``weight`` (nodes,): 1 / reference volume, 1/m^3; ``sums`` (nodes, 2).
    """
    for i in range(n):
        volume = 0.25 * w[VOLUME_MID + i]
        change = volume * w[DILATATION + i] * dt
        for k in range(4):
            a = tets[i, k]
            quanta = weight[a] * QUANTA
            sums[a, 0] += np.int64(np.rint(change * quanta))
            sums[a, 1] += np.int64(np.rint(volume * quanta))


@njit("void(int64[:, ::1], float64[::1], float64[::1], uint32[:, ::1], int64, float64)", cache=True)
def scatter_stabilised(sums, w, weight, tets, n, dt):  # type: ignore[no-untyped-def]
    """Adds a quarter of the volume change and a quarter of the volume of each tet to the sums of its nodes. The volume
    change includes the stabilising fluxes of ``stabilise``.
    """
    for i in range(n):
        volume = 0.25 * w[VOLUME_MID + i]
        flux = volume * w[DILATATION + i]
        for k in range(4):
            a = tets[i, k]
            quanta = weight[a] * QUANTA
            sums[a, 0] += np.int64(np.rint((flux + w[STABILISE + k * CHUNK + i]) * dt * quanta))
            sums[a, 1] += np.int64(np.rint(volume * quanta))


@njit("void(float64[::1], float64[::1], float64[:, ::1], uint32[:, ::1], int64)", cache=True)
def gather_projection(w, pressure, projected, tets, n):  # type: ignore[no-untyped-def]
    """Sets the nodal pressure differences and the mean projected gradient of ``n`` tets."""
    for i in range(n):
        a, b, c, d = tets[i, 0], tets[i, 1], tets[i, 2], tets[i, 3]
        w[_DIFFERENCE + i] = pressure[b] - pressure[a]
        w[_DIFFERENCE + CHUNK + i] = pressure[c] - pressure[a]
        w[_DIFFERENCE + 2 * CHUNK + i] = pressure[d] - pressure[a]
        for k in range(3):
            w[_PROJECTED + k * CHUNK + i] = 0.25 * (
                (projected[a, k] + projected[b, k]) + (projected[c, k] + projected[d, k])
            )


@njit("void(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def stabilise(w, s, n, dt):  # type: ignore[no-untyped-def]
    """Sets the stabilising volume fluxes dt/2 V / rho grad N_a . (grad p - mean projected grad p), with the area
    vectors b = V grad N at the end of the step.

    The characteristic time of the split is half a step (Zienkiewicz and Codina 1995), which is the largest value that
    the stable step of the tets allows. The four fluxes of a tet sum to zero, so the volume of the body does not change.
    """
    for i in range(n):
        volume, mass = w[VOLUME + i], s[_MASS + i]
        p1, p2, p3 = w[_DIFFERENCE + i], w[_DIFFERENCE + CHUNK + i], w[_DIFFERENCE + 2 * CHUNK + i]
        f1, f2, f3 = 0.0, 0.0, 0.0
        for k in range(3):
            b1 = w[EDGE + k * CHUNK + i]
            b2 = w[EDGE + (3 + k) * CHUNK + i]
            b3 = w[EDGE + (6 + k) * CHUNK + i]
            excess = (p1 * b1 + p2 * b2 + p3 * b3) / volume - w[_PROJECTED + k * CHUNK + i]
            f1 += b1 * excess
            f2 += b2 * excess
            f3 += b3 * excess
        factor = 0.5 * dt * volume / mass
        w[STABILISE + CHUNK + i] = factor * f1
        w[STABILISE + 2 * CHUNK + i] = factor * f2
        w[STABILISE + 3 * CHUNK + i] = factor * f3
        w[STABILISE + i] = -factor * (f1 + f2 + f3)


@njit("void(float64[::1], float64[::1], uint32[:, ::1], int64)", cache=True)
def gather_strains(w, strain, tets, n):  # type: ignore[no-untyped-def]
    """Sets the row SEEN to the mean over the four nodes of the volume strain of the step."""
    for i in range(n):
        w[SEEN + i] = 0.25 * ((strain[tets[i, 0]] + strain[tets[i, 1]]) + (strain[tets[i, 2]] + strain[tets[i, 3]]))


@njit("void(float64[::1], int64, float64)", cache=True)
def own_strains(w, n, dt):  # type: ignore[no-untyped-def]
    """Sets the rows SEEN, VOLUME_SEEN, CHANGE and SPEED in the ``standard`` form, in which each tet uses its own volume
    strain.
    """
    for i in range(n):
        w[VOLUME_SEEN + i] = w[VOLUME_MID + i]
        w[SPEED + i] = w[DILATATION + i]
        w[SEEN + i] = w[DILATATION + i] * dt
        w[CHANGE + i] = w[DILATATION + i] * dt * w[VOLUME_MID + i]


@njit("void(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def own_growth(w, s, n, dt):  # type: ignore[no-untyped-def]
    """Does the same as ``own_strains`` for tets that store their volume. Also stores the present volume."""
    frequency = 1.0 / dt if dt > 0.0 else 0.0
    for i in range(n):
        volume = w[VOLUME + i]
        old = s[_VOLUME + i] if dt > 0.0 else volume
        change = volume - old
        middle = 0.5 * (old + volume)
        strain = change / middle
        w[SPEED + i] = strain * frequency
        w[SEEN + i] = strain
        w[CHANGE + i] = change
        w[VOLUME_SEEN + i] = middle
        s[_VOLUME + i] = volume


@njit("int64(int64[::1], float64[::1], float64[::1], uint32[:, ::1], int64, float64)", cache=True)
def pressure_fluxes(wi, w, pressure, tets, n, scale):  # type: ignore[no-untyped-def]
    """Sets three rows of V grad p / 4 of each tet, N, in quanta of 1 / ``scale``. Returns the largest value as its bit
    pattern (integer).
    """
    b1, b2, b3 = w[EDGE:], w[EDGE + 3 * CHUNK :], w[EDGE + 6 * CHUNK :]
    peak = 0
    for i in range(n):
        p0 = pressure[tets[i, 0]]
        p1, p2, p3 = pressure[tets[i, 1]] - p0, pressure[tets[i, 2]] - p0, pressure[tets[i, 3]] - p0
        fx = 0.25 * (p1 * b1[i] + p2 * b2[i] + p3 * b3[i])
        fy = 0.25 * (p1 * b1[CHUNK + i] + p2 * b2[CHUNK + i] + p3 * b3[CHUNK + i])
        fz = 0.25 * (p1 * b1[2 * CHUNK + i] + p2 * b2[2 * CHUNK + i] + p3 * b3[2 * CHUNK + i])
        wi[i], wi[CHUNK + i], wi[2 * CHUNK + i] = quanta(fx, fy, fz, scale)
        peak = max(peak, largest_of(fx, fy, fz))
    return peak


@njit("void(int64[:, ::1], int64[::1], uint32[:, ::1], int64)", cache=True)
def scatter_fluxes(gradient, wi, tets, n):  # type: ignore[no-untyped-def]
    """Adds V grad p / 4, in quanta, to the sums of the four nodes of each tet."""
    for i in range(n):
        a, b, c, d = tets[i, 0], tets[i, 1], tets[i, 2], tets[i, 3]
        for k in range(3):
            flux = wi[k * CHUNK + i]
            gradient[a, k] += flux
            gradient[b, k] += flux
            gradient[c, k] += flux
            gradient[d, k] += flux
