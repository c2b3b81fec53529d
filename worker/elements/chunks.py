"""Steps of a pass over the elements for one chunk: rates and stress, pressure and limit, forces, marks and peaks.

``t`` (n, 4): tets of the chunk; ``s``: its state; ``w`` and ``wi``: scratch (records.py).
"""

from ..kernels.jit import njit, types
from ..materials.elastic import deviatoric_work, predict
from ..materials.hyperelastic import stiffen
from ..materials.law import (
    AFTER_PRESSURE,
    BEFORE_PRESSURE,
    BREAKS,
    DENSITY,
    DILATES,
    FROM_SHAPE,
    ORDER,
    Q_LINEAR,
    Q_QUADRATIC,
    Q_SHOCK,
    SHEAR,
)
from ..materials.models import strengthen
from ..materials.viscosity import bulk_viscosity
from . import pressure as averaged
from . import tet4
from .flat import without_flux
from .hot import mark_hot
from .records import HOT, LARGEST_FORCE, LARGEST_LIMIT, LIMITING_TET, WORN
from .wear import SOUND, mark_worn

_NO_TET = 2**62
"""Greater than any global id of a tet."""
_F, _I, _B, _B1, _T2 = types.float64, types.int64, types.boolean, types.boolean[::1], types.uint32[:, ::1]
_F1, _F2, _I1, _I2 = types.float64[::1], types.float64[:, ::1], types.int64[::1], types.int64[:, ::1]


@njit(types.void(_F1, _F2, _T2, _I, _F), cache=True, error_model="numpy")
def rates(w, v, t, n, dt):  # type: ignore[no-untyped-def]
    """Computes rates of deformation from the edges of a chunk and the velocities of its nodes."""
    tet4.gather(w[tet4.RATE :], v, t, w[:0], n)
    tet4.kinematics(w, n, dt)


@njit(types.void(_F1, _F2, _T2, _I), cache=True, error_model="numpy")
def first_speeds(w, v, t, n):  # type: ignore[no-untyped-def]
    """Sets SPEED of tets whose volume before the step is not stored, from the velocities of their nodes."""
    tet4.gather(w[tet4.RATE :], v, t, w[:0], n)
    tet4.speeds(w, n)


@njit(types.void(_I, _F1, _F1, _F1, _I, _F), cache=True, error_model="numpy")
def from_rates(strength, w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Computes the deviatoric stress of a chunk and its work: rotation, elastic trial, plastic return.

    For a law that acts after the pressure only the trial stress; ``return_at_pressure`` completes it.
    """
    predict(w, s, n, params[SHEAR], dt)
    if params[ORDER] == BEFORE_PRESSURE:
        strengthen(strength, w, s, params, n, dt)
        deviatoric_work(w, s, n, dt)


@njit(types.void(_I, _F1, _F1, _F1, _I, _F), cache=True, error_model="numpy")
def return_at_pressure(strength, w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Returns the deviatoric stress of a chunk to a strength that depends on the new pressure; books the work of the
    new stress.
    """
    if params[ORDER] == AFTER_PRESSURE:
        strengthen(strength, w, s, params, n, dt)
        deviatoric_work(w, s, n, dt)


@njit(types.void(_F1, _F1, _F1, _I, _F, _B), cache=True, error_model="numpy")
def viscosity_and_limit(w, s, params, n, dt, averaged):  # type: ignore[no-untyped-def]
    """Computes bulk viscosity and stable step of a chunk at its new pressure; ``averaged``: True in the averaged
    pressure forms, in which the viscosity resists a mean rate, except for materials that dilate.
    """
    if params[ORDER] == FROM_SHAPE:
        stiffen(w, s, params, n)
    linear, shock, quadratic = params[Q_LINEAR], params[Q_SHOCK], params[Q_QUADRATIC]
    if max(linear, shock, quadratic) > 0.0:
        frequency = 1.0 / dt if dt > 0.0 else 0.0
        initial = params[DENSITY] if averaged and params[DILATES] == 0.0 else 0.0
        bulk_viscosity(w, s, n, linear, shock, quadratic, frequency, params[BREAKS] > 0.0, initial)
    else:
        tet4.step_limit(w, s, n)
    tet4.motion_limit(w, n)


@njit(types.void(_I1, _I1, _I1, _I, _I), cache=True)
def note_peaks(peaks, bits, ids, n, force):  # type: ignore[no-untyped-def]
    """Raises the peaks by those of a chunk of tets with these global ids, whose largest force has the bits
    ``force``.
    """
    peaks[LARGEST_FORCE] = max(peaks[LARGEST_FORCE], force)
    limit = 0
    for i in range(n):
        limit = max(limit, bits[tet4.LIMIT + i] & tet4.MAGNITUDE)
    if limit > peaks[LARGEST_LIMIT]:
        peaks[LARGEST_LIMIT], peaks[LIMITING_TET] = limit, _NO_TET
    if limit == peaks[LARGEST_LIMIT]:
        for i in range(n):
            if bits[tet4.LIMIT + i] & tet4.MAGNITUDE == limit:
                peaks[LIMITING_TET] = min(peaks[LIMITING_TET], ids[i])


@njit(types.void(_I2), cache=True)
def gather_peaks(threads):  # type: ignore[no-untyped-def]
    """Raises the peaks of the first of the ``threads`` (threads, 8) to the maximum over all."""
    peaks = threads[0]
    for t in range(1, len(threads)):
        mine = threads[t]
        for place in (LARGEST_FORCE, WORN, HOT):
            peaks[place] = max(peaks[place], mine[place])
        if mine[LARGEST_LIMIT] > peaks[LARGEST_LIMIT]:
            peaks[LARGEST_LIMIT], peaks[LIMITING_TET] = mine[LARGEST_LIMIT], mine[LIMITING_TET]
        elif mine[LARGEST_LIMIT] == peaks[LARGEST_LIMIT]:
            peaks[LIMITING_TET] = min(peaks[LIMITING_TET], mine[LIMITING_TET])


@njit(_I(_I2, _F1, _I1, _I1, _I1, _T2, _F1, _I1, _I, _F), cache=True, error_model="numpy")
def sum_forces(force, w, wi, bits, peaks, t, s, ids, n, scale):  # type: ignore[no-untyped-def]
    """Adds the forces of a chunk of tets with these global ids to the nodal sums; returns the bits of the largest."""
    largest = tet4.internal_forces(wi, w, s, n, scale)
    tet4.scatter_forces(force, wi, t, n)
    note_peaks(peaks, bits, ids, n, largest)
    return largest


@njit(_I(_I2, _F1, _F1, _I1, _I1, _B1, _T2, _I, _F), cache=True, error_model="numpy")
def sum_fluxes(gradient, pressure, w, wi, peaks, flat, t, n, scale):  # type: ignore[no-untyped-def]
    """Adds the pressure gradient of a chunk to the nodal sums, without ``flat`` tets; returns the bits of the
    largest.
    """
    largest = averaged.pressure_fluxes(wi, w, pressure, t, n, scale)
    if len(flat) > 0:
        without_flux(wi, flat, n)
    averaged.scatter_fluxes(gradient, wi, t, n)
    peaks[LARGEST_FORCE] = max(peaks[LARGEST_FORCE], largest)
    return largest


@njit(_B(_B1, _F1, types.uint8[::1], _F1, _F, _F1, _I1, _F1, _F1, _I, _I), cache=True, error_model="numpy")
def mark(worn, life, hot, weakest, shear, w, peaks, s, params, rows, n):  # type: ignore[no-untyped-def]
    """Marks the ``worn`` tets of a chunk and its ``hot`` faces; returns True if there are any."""
    found, some_hot = SOUND, False
    if len(worn) > 0:
        found = mark_worn(worn, w, s, params, life, rows, n)
        peaks[WORN] = max(peaks[WORN], found)
    if len(hot) > 0:
        some_hot = mark_hot(hot, w, s, weakest, shear, n)
        peaks[HOT] |= some_hot
    return found != SOUND or some_hot
