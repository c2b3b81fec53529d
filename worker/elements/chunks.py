"""Steps of a pass over the elements for one chunk: rates and stress, pressure and stable step, forces, marks and peaks.

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
from ..materials.models import press, strengthen, swell
from ..materials.viscosity import bulk_viscosity
from ..model.rows import BULKING_STEP
from . import forces, limits, scratch, tet4
from . import pressure as averaged
from .flat import exclude_flux, own_pressure, own_strain
from .heat_and_bulking import HEATED, gather_corners, gather_heat
from .hot import mark_hot
from .matter import TETS, from_nodes, pressure_place
from .mean import keep_before
from .records import BODY, HOT, LARGEST_FORCE, LARGEST_LIMIT, LIMITING_TET, MARKS, MEANS, WORN
from .wear import SOUND, mark_worn

_NO_TET = 2**62
"""Number that is larger than any global id of a tet."""
_F, _I, _B, _B1, _T2 = types.float64, types.int64, types.boolean, types.boolean[::1], types.uint32[:, ::1]
_F1, _F2, _I1, _I2 = types.float64[::1], types.float64[:, ::1], types.int64[::1], types.int64[:, ::1]


@njit(types.void(_F1, _F2, _T2, _I, _F), cache=True, error_model="numpy")
def rates(w, v, t, n, dt):  # type: ignore[no-untyped-def]
    """Computes the rates of deformation of a chunk of tets from its edges and the velocities of its nodes."""
    tet4.gather(w[scratch.RATE :], v, t, w[:0], n)
    tet4.kinematics(w, n, dt)


@njit(types.void(_F1, _F2, _T2, _I), cache=True, error_model="numpy")
def first_speeds(w, v, t, n):  # type: ignore[no-untyped-def]
    """Sets the row SPEED from the velocities of the nodes, for tets whose volume before the step is not stored."""
    tet4.gather(w[scratch.RATE :], v, t, w[:0], n)
    tet4.speeds(w, n)


@njit(types.void(_I, _F1, _F1, _F1, _I, _F), cache=True, error_model="numpy")
def from_rates(strength, w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Computes the deviatoric stress of a chunk, and the work of this stress. The steps are rotation, elastic trial and
    plastic return.

    If the law acts after the pressure, this function computes only the trial stress; ``return_at_pressure`` then does
    the plastic return.
    """
    predict(w, s, n, params[SHEAR], dt)
    if params[ORDER] == BEFORE_PRESSURE:
        strengthen(strength, w, s, params, n, dt)
        deviatoric_work(w, s, n, dt)


@njit(types.void(_I, _F1, _F1, _F1, _I, _F), cache=True, error_model="numpy")
def return_at_pressure(strength, w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Returns the deviatoric stress of a chunk to the yield surface, if the strength depends on the new pressure. Adds
    the work of the new stress to the energies of the tets.
    """
    if params[ORDER] == AFTER_PRESSURE:
        strengthen(strength, w, s, params, n, dt)
        deviatoric_work(w, s, n, dt)


@njit(types.void(_F1, _F1, _F1, _I, _F, _B), cache=True, error_model="numpy")
def viscosity_and_limit(w, s, params, n, dt, averaged):  # type: ignore[no-untyped-def]
    """Computes bulk viscosity and stable step of a chunk at its new pressure. ``averaged`` is True in the averaged
    pressure forms, in which the viscosity resists the averaged volume rate. For materials that dilate the viscosity
    always resists the volume rate of the tet itself.
    """
    if params[ORDER] == FROM_SHAPE:
        stiffen(w, s, params, n)
    linear, shock, quadratic = params[Q_LINEAR], params[Q_SHOCK], params[Q_QUADRATIC]
    if max(linear, shock, quadratic) > 0.0:
        frequency = 1.0 / dt if dt > 0.0 else 0.0
        initial = params[DENSITY] if averaged and params[DILATES] == 0.0 else 0.0
        bulk_viscosity(w, s, n, linear, shock, quadratic, frequency, params[BREAKS] > 0.0, initial)
    else:
        limits.step_limit(w, s, n)
    limits.motion_limit(w, n)


@njit(types.void(_I1, _I1, _I1, _I, _I), cache=True)
def note_peaks(peaks, bits, ids, n, force):  # type: ignore[no-untyped-def]
    """Updates the peaks of a thread by the peaks of a chunk of tets. ``ids``: global ids of the tets; ``force``: bit
    pattern of the largest force of the chunk.
    """
    peaks[LARGEST_FORCE] = max(peaks[LARGEST_FORCE], force)
    limit = 0
    for i in range(n):
        limit = max(limit, bits[scratch.LIMIT + i] & forces.MAGNITUDE)
    if limit > peaks[LARGEST_LIMIT]:
        peaks[LARGEST_LIMIT], peaks[LIMITING_TET] = limit, _NO_TET
    if limit == peaks[LARGEST_LIMIT]:
        for i in range(n):
            if bits[scratch.LIMIT + i] & forces.MAGNITUDE == limit:
                peaks[LIMITING_TET] = min(peaks[LIMITING_TET], ids[i])


@njit(types.void(_I2), cache=True)
def gather_peaks(threads):  # type: ignore[no-untyped-def]
    """Sets the peaks of the first thread to the maximum over all ``threads`` (threads, 8)."""
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
    """Adds the forces of a chunk of tets to the nodal sums; ``ids``: global ids of the tets. Returns the largest force
    as its bit pattern (integer).
    """
    largest = forces.internal_forces(wi, w, s, n, scale)
    forces.scatter_forces(force, wi, t, n)
    note_peaks(peaks, bits, ids, n, largest)
    return largest


@njit(_I(_I2, _F1, _F1, _I1, _I1, _B1, _T2, _I, _F), cache=True, error_model="numpy")
def sum_fluxes(gradient, pressure, w, wi, peaks, flat, t, n, scale):  # type: ignore[no-untyped-def]
    """Adds the pressure gradient of a chunk to the nodal sums, without the ``flat`` tets. Returns the largest
    contribution as its bit pattern (integer).
    """
    largest = averaged.pressure_fluxes(wi, w, pressure, t, n, scale)
    if len(flat) > 0:
        exclude_flux(wi, flat, n)
    averaged.scatter_fluxes(gradient, wi, t, n)
    peaks[LARGEST_FORCE] = max(peaks[LARGEST_FORCE], largest)
    return largest


@njit(_B(MARKS, _I, _I, _F1, _I1, _F1, _F1, _I), cache=True, error_model="numpy", forceinline=True)
def mark(marks, first, last, w, peaks, s, params, rows):  # type: ignore[no-untyped-def]
    """Marks two kinds of tets from ``first`` to ``last`` of a block: the tets that erosion will remove, and the tets
    with overstressed faces, together with these faces. Returns True if any tet or face is marked.

    ``w``, ``s``: scratch and state of the chunk of these tets.
    """
    found, some_hot, n = SOUND, False, last - first
    if len(marks.worn) > 0:
        found = mark_worn(marks.worn[first:last], w, s, params, marks.life, rows, n)
        peaks[WORN] = max(peaks[WORN], found)
    if len(marks.hot) > 0:
        some_hot = mark_hot(marks.hot[first:last], w, s, marks.weakest[first:last], marks.shear, n)
        peaks[HOT] |= some_hot
    return found != SOUND or some_hot


@njit(types.void(_F1, _F2, _T2, _F1, _B, _I), cache=True, error_model="numpy")
def volumes_at_rest(w, x, t, s, shape, n):  # type: ignore[no-untyped-def]
    """Sets the rows VOLUME_MID and DILATATION of a chunk at rest. ``shape``: True if the law computes the stress from
    the undeformed shape.
    """
    if shape:
        tet4.unchanged(w, s, n)
    else:
        tet4.gather(w[scratch.EDGE :], x, t, s[:0], n)
        tet4.at_rest(w, n)


@njit(types.void(_F1, _F1, BODY, MEANS, _T2, _B1, _I), cache=True, error_model="numpy", forceinline=True)
def take_means(w, s, body, means, means_of, flat, n):  # type: ignore[no-untyped-def]
    """Sets the row SEEN to the nodal means for a chunk. Adds the nodal means of heat or bulking to the state of the
    chunk.
    """
    averaged.gather_strains(w, means.strain, means_of, n)
    if body.rows == HEATED:
        gather_heat(s, means.more, means_of, n)
    elif body.rows > BULKING_STEP:
        gather_corners(w, s, body.params, means.more, means_of, means.strain, flat, n)


@njit(types.void(_F1, _F1, _F2, _T2, _B, _I, _F), cache=True, error_model="numpy")
def own_change(w, s, v, t, shape, n, dt):  # type: ignore[no-untyped-def]
    """Sets the rows CHANGE and SPEED of a chunk after the first pass. ``shape``: True if the law computes the stress
    from the undeformed shape.
    """
    if shape:
        averaged.recall_growth(w, s, n, dt)
        if dt <= 0.0:
            first_speeds(w, v, t, n)
    else:
        averaged.recall_flux(w, s, n, dt)


@njit(types.void(_F1, _F1, BODY, _F2, _T2, _B1, _I), cache=True, error_model="numpy", forceinline=True)
def averaged_pressure(w, s, body, matter, means_of, flat, n):  # type: ignore[no-untyped-def]
    """Computes pressure, work of the pressure and the row MODULUS of a chunk in the averaged pressure forms (`nodal`,
    `split`). The pressure is computed from the volume strains of the tets, or it is a mean over their nodes. The
    pressure of ``flat`` tets is computed from their own strain.
    """
    params, eos, rows = body.params, body.eos, body.rows
    if len(flat) > 0:
        own_strain(w, s, params, flat, rows, n)
    swell(eos, w, s, params, n)
    keep_before(w, s, params, n)
    if pressure_place(eos, params) == TETS:
        press(eos, w, s, params, n)
    else:
        alone = s.copy() if len(flat) > 0 else s[:0]
        from_nodes(w, s, params, matter, means_of, n)
        if len(flat) > 0:
            own_pressure(eos, w, s, alone, params, flat, rows, n)
