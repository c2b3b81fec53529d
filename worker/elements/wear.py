"""Tets that erosion will remove, because of their plastic strain, damage, volume or stable step.

A tet that becomes flat or inverted must be removed before its altitude passes zero, because its velocity gradient is
proportional to 1 / altitude, so a single such tet would accelerate its nodes without bound. A marked tet is removed in
the next step. The removal of a tet that exceeds only a strain or damage limit is delayed until several tets are removed
together (worker/erosion.py).
"""

import math

import numpy as np

from conoid.cases.model.schema import Erosion

from ..kernels.jit import njit
from ..materials.law import DENSITY
from ..model.rows import (
    DAMAGE,
    MASS,
    PLASTIC_STRAIN,
    PRESSURE,
    S_XX,
    S_XY,
    S_YY,
    S_YZ,
    S_ZX,
    S_ZZ,
    VISCOUS,
    WORK,
    WORK_VISCOUS,
)
from ..model.state import CHUNK, Floats
from .scratch import EDGE, LIMIT, VOLUME, VOLUME_MID

STRAIN, LOW, HIGH, FREQUENCY, DAMAGED = range(5)
"""Indices of the erosion limits in ``life`` of a block: largest plastic strain, smallest and largest ratio of volume to
initial volume, largest 1 / stable step, 1/s, largest damage."""
SOUND, TIRED, BROKEN = range(3)
"""Results of a check. SOUND: no tet has to be removed; TIRED: the removal of all marked tets can be delayed; BROKEN:
some marked tets must be removed in the next step."""

_SIXTH = 1.0 / 6.0
_MASS, _STRAIN, _DAMAGE = MASS * CHUNK, PLASTIC_STRAIN * CHUNK, DAMAGE * CHUNK


def life(erosion: Erosion | None) -> Floats:
    """(5,) limits beyond which erosion removes tets of a part. The limit of the stable step is set after the first
    step.
    """
    if erosion is None:
        return np.full(5, math.inf)
    strain = math.inf if erosion.plastic_strain is None else erosion.plastic_strain
    damage = math.inf if erosion.damage is None else erosion.damage
    return np.array([strain, *erosion.volume, math.inf, damage])


@njit("boolean(float64[::1], int64)", cache=True, error_model="numpy")
def _finite(s, i):  # type: ignore[no-untyped-def]
    """Returns True if stress and work of a tet are finite numbers."""
    total = abs(s[WORK * CHUNK + i]) + abs(s[WORK_VISCOUS * CHUNK + i])
    for row in range(S_XX, VISCOUS + 1):
        total += abs(s[row * CHUNK + i])
    return total < np.inf


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def _release(s, i):  # type: ignore[no-untyped-def]
    """Sets the stress of a tet to zero."""
    for row in range(S_XX, VISCOUS + 1):
        s[row * CHUNK + i] = 0.0


@njit("boolean(float64[::1], int64)", cache=True, error_model="numpy")
def any_inverted(w, n):  # type: ignore[no-untyped-def]
    """Sets the row VOLUME to the volume at the end of the step, in the same way as tet4.end_gradients. Returns True if
    a tet of the chunk is inverted.
    """
    least = np.inf
    for i in range(n):
        e1x, e1y, e1z = w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i]
        e2x, e2y, e2z = w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i]
        e3x, e3y, e3z = w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i]
        bx, by = (e2y * e3z - e2z * e3y) * _SIXTH, (e2z * e3x - e2x * e3z) * _SIXTH
        bz = (e2x * e3y - e2y * e3x) * _SIXTH
        volume = e1x * bx + e1y * by + e1z * bz
        w[VOLUME + i] = volume
        least = min(least, volume)
    return least <= 0.0


@njit("UniTuple(float64, 2)(float64[::1], float64[:, ::1], float64[:, ::1], uint32[::1], int64, float64)", cache=True)
def _half_of_last(s, x, v, tet, i, dt):  # type: ignore[no-untyped-def]
    """Returns half of the work that the nodes of tet ``i`` do against the forces of the tet at n, during the motion
    from n to n+1, J. The work is returned in two parts: without viscosity, and of viscosity.

    The formula is 1/2 dt sum v_a . (stress b_a), b_a = V grad N_a at x(n) = x(n+1) - dt v.
    """
    e, u = np.empty((3, 3)), np.empty((3, 3))
    for k in range(3):
        for j in range(3):
            u[k, j] = v[tet[k + 1], j] - v[tet[0], j]
            e[k, j] = x[tet[k + 1], j] - x[tet[0], j] - dt * u[k, j]
    work, flux = 0.0, 0.0
    for k in range(3):
        p, q = e[(k + 1) % 3], e[(k + 2) % 3]
        bx, by, bz = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]
        ux, uy, uz = u[k]
        flux += ux * bx + uy * by + uz * bz
        sx = s[S_XX * CHUNK + i] * bx + s[S_XY * CHUNK + i] * by + s[S_ZX * CHUNK + i] * bz
        sy = s[S_XY * CHUNK + i] * bx + s[S_YY * CHUNK + i] * by + s[S_YZ * CHUNK + i] * bz
        sz = s[S_ZX * CHUNK + i] * bx + s[S_YZ * CHUNK + i] * by + s[S_ZZ * CHUNK + i] * bz
        work += ux * sx + uy * sy + uz * sz
    half = 0.5 * dt / 6.0
    return half * (work - s[PRESSURE * CHUNK + i] * flux), -half * s[VISCOUS * CHUNK + i] * flux


@njit(
    "void(float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], uint32[:, ::1], int64, int64, "
    "float64)",
    cache=True,
    error_model="numpy",
)
def reset_inverted(w, s, before, x, v, tets, rows, n, dt):  # type: ignore[no-untyped-def]
    """Resets inverted tets of a chunk to their state ``before`` the step, with zero stress.

    The stress at the end of the step never acts on a node. The stress at the start of the step has done half of its
    work in the step ``dt``; this function adds this half to the energies of the tet. The reset tets do not contribute
    to the nodal means.
    """
    for i in range(n):
        if w[VOLUME + i] <= 0.0:
            work, viscous = _half_of_last(before, x, v, tets[i], i, dt)
            for row in range(rows):
                s[row * CHUNK + i] = before[row * CHUNK + i]
            s[WORK * CHUNK + i] += work
            s[WORK_VISCOUS * CHUNK + i] += viscous
            _release(s, i)
            w[VOLUME_MID + i] = 0.0


@njit(
    "int64(boolean[::1], float64[::1], float64[::1], float64[::1], float64[::1], int64, int64)",
    cache=True,
    error_model="numpy",
)
def mark_worn(worn, w, s, params, life, rows, n):  # type: ignore[no-untyped-def]
    """Marks the tets of a chunk that erosion will remove. If the removal of a tet cannot be delayed, the tet no longer
    limits the time step. Returns SOUND, TIRED or BROKEN.

    The stress of an inverted tet is set to zero before it acts on a node. A tet whose stress is not a number is not
    removed: its limit becomes NaN, which ends the run with an error that names the tet.
    """
    found = SOUND
    for i in range(n):
        ratio = w[VOLUME + i] * params[DENSITY] / s[_MASS + i]
        inverted = w[VOLUME + i] <= 0.0
        if not _finite(s, i) or not (inverted or (w[VOLUME + i] > 0.0 and w[LIMIT + i] >= 0.0)):
            w[LIMIT + i] = np.nan
        elif inverted or not (life[LOW] <= ratio <= life[HIGH] and w[LIMIT + i] <= life[FREQUENCY]):
            worn[i] = True
            w[LIMIT + i] = 0.0
            found = BROKEN
            if inverted:
                _release(s, i)
        else:
            tired = rows > PLASTIC_STRAIN and s[_STRAIN + i] > life[STRAIN]
            if tired or (rows > DAMAGE and s[_DAMAGE + i] >= life[DAMAGED]):
                worn[i] = True
                found = max(found, TIRED)
    return found
