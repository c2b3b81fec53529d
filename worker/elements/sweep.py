"""Passes over the elements of a block, chunk by chunk: what the time step calls.

``standard_pass`` does everything in one pass. The averaged pressure forms need two, with the completed nodal sums
between them: ``strain_pass`` (velocity gradient, deviatoric stress, nodal volume sums) and ``force_pass`` (pressure,
viscosity, forces). ``forces_again`` repeats only the sum of forces, in a coarser quantum. Where the strength depends on
the pressure, the plastic return comes after the equation of state, and with it, in two passes, the whole deviatoric
stress: then the second pass makes the velocity gradient again. A law from the shape has no velocity gradient: the first
of two passes finds volumes alone.

Chunks at rest, which no wave has reached, are passed over (rest.py).

``peaks`` collects what the step needs of all tets of a rank; ``LARGEST_LIMIT`` and the names beside it are its places.
"""

from ..jit import njit
from ..materials.elastic import deviatoric_work, predict
from ..materials.hyperelastic import stiffen
from ..materials.law import (
    AFTER_PRESSURE,
    BEFORE_PRESSURE,
    BREAKS,
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
from ..state import CHUNK, UNTOLD
from . import pressure as averaged
from . import rest, tet4
from .barrier import resist
from .flat import keep_out, see_own, without_flux
from .hot import mark_hot
from .mean import book_averaged, keep_before
from .wear import SOUND, any_inside_out, let_go, mark_worn

LARGEST_LIMIT, LIMITING_TET, LARGEST_FORCE, WORN, HOT = range(5)
"""Places in ``peaks``: bits of the largest one-over-stable-step, 1/s; smallest global id of the tets that have it; bits
of the largest force, N; what is found of worn-out tets (wear.py); whether faces are hot (hot.py)."""
PEAKS = 5
"""Number of these places."""
_LIMIT = tet4.LIMIT
_NO_TET = 2**62
"""Larger than any global id of a tet."""
_F1, _F2, _I1, _I2, _T2 = "float64[::1]", "float64[:, ::1]", "int64[::1]", "int64[:, ::1]", "uint32[:, ::1]"
_B1 = "boolean[::1]"


@njit(f"void({_F1}, {_F2}, {_T2}, int64, float64)", cache=True, error_model="numpy")
def rates(w, v, t, n, dt):  # type: ignore[no-untyped-def]
    """Rates of deformation, from the edges of a chunk and its nodes' velocities."""
    tet4.gather(w[tet4.RATE :], v, t, w[:0], n)
    tet4.kinematics(w, n, dt)


@njit(f"void({_F1}, {_F2}, {_T2}, int64)", cache=True, error_model="numpy")
def first_speeds(w, v, t, n):  # type: ignore[no-untyped-def]
    """SPEED of tets that know no volume before the present one: by their nodes' velocities."""
    tet4.gather(w[tet4.RATE :], v, t, w[:0], n)
    tet4.speeds(w, n)


@njit(f"void(int64, {_F1}, {_F1}, {_F1}, int64, float64)", cache=True, error_model="numpy")
def from_rates(strength, w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """The deviatoric stress of a chunk, and its work, by rotation, elastic trial and plastic return.

    With a law that acts after the pressure only the trial: ``return_at_pressure`` does the rest.
    """
    predict(w, s, n, params[SHEAR], dt)
    if params[ORDER] == BEFORE_PRESSURE:
        strengthen(strength, w, s, params, n, dt)
        deviatoric_work(w, s, n, dt)


@njit(f"void(int64, {_F1}, {_F1}, {_F1}, int64, float64)", cache=True, error_model="numpy")
def return_at_pressure(strength, w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Plastic return of a chunk whose strength depends on the new pressure; books the work of the new deviator."""
    if params[ORDER] == AFTER_PRESSURE:
        strengthen(strength, w, s, params, n, dt)
        deviatoric_work(w, s, n, dt)


@njit(f"void(int64, {_F1}, {_F1}, {_F1}, int64, float64)", cache=True, error_model="numpy")
def pressure_and_limit(eos, w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Equation of state, bulk viscosity and stable step of a chunk."""
    press(eos, w, s, params, n)
    if params[ORDER] == FROM_SHAPE:
        stiffen(w, s, params, n)
    linear, shock, quadratic = params[Q_LINEAR], params[Q_SHOCK], params[Q_QUADRATIC]
    if max(linear, shock, quadratic) > 0.0:
        frequency = 1.0 / dt if dt > 0.0 else 0.0
        bulk_viscosity(w, s, n, linear, shock, quadratic, frequency, params[BREAKS] > 0.0)
    else:
        tet4.step_limit(w, s, n)
    tet4.motion_limit(w, n)


@njit(f"void({_I1}, {_I1}, {_I1}, int64, int64)", cache=True)
def note_peaks(peaks, bits, ids, n, force):  # type: ignore[no-untyped-def]
    """Raises the peaks by a chunk of tets with these global ids, whose largest force has the bits ``force``."""
    peaks[LARGEST_FORCE] = max(peaks[LARGEST_FORCE], force)
    limit = 0
    for i in range(n):
        limit = max(limit, bits[_LIMIT + i] & tet4.MAGNITUDE)
    if limit > peaks[LARGEST_LIMIT]:
        peaks[LARGEST_LIMIT], peaks[LIMITING_TET] = limit, _NO_TET
    if limit == peaks[LARGEST_LIMIT]:
        for i in range(n):
            if bits[_LIMIT + i] & tet4.MAGNITUDE == limit:
                peaks[LIMITING_TET] = min(peaks[LIMITING_TET], ids[i])


@njit(
    f"int64({_I2}, {_F1}, {_I2}, boolean, {_B1}, {_T2}, {_F1}, {_F1}, {_I1}, {_I1}, {_I1}, {_I1}, int64, float64)",
    cache=True,
    error_model="numpy",
)
def sum_forces(force, pressure, gradient, split, flat, t, s, w, wi, bits, peaks, ids, n, scale):  # type: ignore[no-untyped-def]
    """Adds the forces of a chunk, and with ``split`` its share of the pressure gradient; returns the largest."""
    largest = tet4.internal_forces(wi, w, s, n, scale)
    tet4.scatter_forces(force, wi, t, n)
    if split:
        largest = max(largest, averaged.pressure_fluxes(wi, w, pressure, t, n, scale))
        if len(flat) > 0:
            without_flux(wi, flat, n)
        averaged.scatter_fluxes(gradient, wi, t, n)
    note_peaks(peaks, bits, ids, n, largest)
    return largest


@njit(
    f"void({_F2}, {_F2}, {_F2}, {_I2}, {_T2}, {_F1}, {_F1}, {_F1}, {_I1}, {_I1}, {_I1}, {_I1}, {_B1}, {_F1}, "
    f"uint8[::1], {_F1}, {_I2}, float64, int64, int64, int64, int64, int64, float64, float64)",
    cache=True,
    error_model="numpy",
)
def standard_pass(  # type: ignore[no-untyped-def]
    x0, x, v, force, tets, state, params, w, wi, bits, peaks, ids, worn, life, hot, weakest, quiet, shear, strength,
    eos, rows, begin, end, dt, scale
):  # fmt: skip
    """Stress and forces at n+1 of chunks ``begin`` to ``end``, each tet with its own pressure."""
    shape = params[ORDER] == FROM_SHAPE
    for c in range(begin, end):
        t = tets[c * CHUNK : (c + 1) * CHUNK]
        s = state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        n = len(t)
        still = dt > 0.0 and rest.at_rest(v, t, n)
        if still and quiet[c, rest.NOTED] > 0:
            rest.pass_over(peaks, quiet[c], LARGEST_LIMIT, LIMITING_TET)
            continue
        before = s.copy() if still else s[:0]
        if shape:
            tet4.gather_moved(w, x0, x, t, s, n)
        else:
            tet4.gather(w[tet4.EDGE :], x, t, s, n)
        upset = s.copy() if len(worn) > 0 and any_inside_out(w, n) else s[:0]
        if shape:
            tet4.end_gradients(w, n)
            strengthen(strength, w, s, params, n, dt)
            averaged.own_growth(w, s, n, dt)
            if dt <= 0.0:
                first_speeds(w, v, t, n)
        else:
            rates(w, v, t, n, dt)
            from_rates(strength, w, s, params, n, dt)
            tet4.end_gradients(w, n)
            averaged.own_strains(w, n, dt)
        pressure_and_limit(eos, w, s, params, n, dt)
        return_at_pressure(strength, w, s, params, n, dt)
        if len(upset) > 0:
            let_go(w, s, upset, x, v, t, rows, n, dt)
        found, some_hot = SOUND, False
        if len(worn) > 0:
            found = mark_worn(worn[c * CHUNK : c * CHUNK + n], w, s, params, life, rows, n)
            peaks[WORN] = max(peaks[WORN], found)
        if len(hot) > 0:
            at = c * CHUNK
            some_hot = mark_hot(hot[at : at + n], w, s, weakest[at : at + n], shear, n)
            peaks[HOT] |= some_hot
        largest = tet4.internal_forces(wi, w, s, n, scale)
        tet4.scatter_forces(force, wi, t, n)
        note_peaks(peaks, bits, ids[c * CHUNK : c * CHUNK + n], n, largest)
        quiet[c, rest.NOTED] = 0
        if still and largest == 0 and found == SOUND and not some_hot and rest.same(before, s):
            rest.note(quiet[c], bits, ids[c * CHUNK : c * CHUNK + n], n)


@njit(
    f"void({_F2}, {_F2}, {_F2}, {_I2}, {_F1}, {_F1}, {_F2}, boolean, {_T2}, {_F1}, {_F1}, {_F1}, {_B1}, {_B1}, "
    f"{_I2}, int64, int64, int64, int64, float64)",
    cache=True,
    error_model="numpy",
)
def strain_pass(  # type: ignore[no-untyped-def]
    x0, x, v, sums, weight, pressure, projected, split, tets, state, params, w, flat, worn, quiet, strength, rows,
    begin, end, dt
):  # fmt: skip
    """The nodal sums of volume change, with ``split`` stabilised; deviatoric stress at n+1 of laws that act so early.

    A law from the shape does where the nodes must have its work, for their heat; else it acts in ``force_pass``. Of a
    chunk that is noted as at rest only the volumes, which the mean over its nodes' tets needs.
    """
    shape, early = params[ORDER] == FROM_SHAPE, rows > UNTOLD
    for c in range(begin, end):
        t = tets[c * CHUNK : (c + 1) * CHUNK]
        s = state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        n = len(t)
        still = not split and dt > 0.0 and rest.at_rest(v, t, n)
        if still and quiet[c, rest.NOTED] > 0:
            if shape:
                tet4.unchanged(w, s, n)
            else:
                tet4.gather(w[tet4.EDGE :], x, t, s[:0], n)
                tet4.at_rest(w, n)
            if len(flat) > 0:
                keep_out(w, flat[c * CHUNK : c * CHUNK + n], n)
            averaged.scatter_volumes(sums, w, weight, t, n, dt)
            continue
        if shape and early:
            tet4.gather_moved(w, x0, x, t, s, n)
        else:
            tet4.gather(w[tet4.EDGE :], x, t, s[:0] if shape else s, n)
        before = s.copy() if still else s[:0]
        upset = s.copy() if len(worn) > 0 and any_inside_out(w, n) else s[:0]
        if shape:
            tet4.end_gradients(w, n) if early or split else tet4.volumes(w, n)
            tet4.growth(w, s, n, dt)
            if early:
                strengthen(strength, w, s, params, n, dt)
        else:
            rates(w, v, t, n, dt)
            if params[ORDER] != AFTER_PRESSURE:
                from_rates(strength, w, s, params, n, dt)
        if len(upset) > 0:
            let_go(w, s, upset, x, v, t, rows, n, dt)
        if not shape:
            averaged.keep_flux(w, s, n)
        if params[DILATES] > 0.0:
            averaged.tell_dilation(w, s, params, n, dt)
        if len(flat) > 0:
            keep_out(w, flat[c * CHUNK : c * CHUNK + n], n)
        if rows > UNTOLD:
            averaged.scatter_more(sums, w, s, params, weight, t, rows, n)
        quiet[c, rest.NOTED] = 0
        quiet[c, rest.STEADY] = 1 if still and rest.same(before, s) else 0
        if split:
            if not shape:
                tet4.end_gradients(w, n)
            averaged.gather_projection(w, pressure, projected, t, n)
            averaged.stabilise(w, s, n, dt)
            if len(flat) > 0:
                keep_out(w, flat[c * CHUNK : c * CHUNK + n], n)
            averaged.scatter_stabilised(sums, w, weight, t, n, dt)
        else:
            averaged.scatter_volumes(sums, w, weight, t, n, dt)


@njit(
    f"void({_F2}, {_F2}, {_F2}, {_F1}, {_F1}, {_I2}, {_F1}, {_I2}, boolean, {_T2}, {_F1}, {_F1}, {_F1}, {_I1}, {_I1}, "
    f"{_I1}, {_I1}, {_B1}, {_B1}, {_F1}, uint8[::1], {_F1}, {_I2}, float64, int64, int64, int64, int64, int64, "
    "float64, float64)",
    cache=True,
    error_model="numpy",
)
def force_pass(  # type: ignore[no-untyped-def]
    x0, x, v, strain, more, force, pressure, gradient, split, tets, state, params, w, wi, bits, peaks, ids, flat, worn,
    life, hot, weakest, quiet, shear, strength, eos, rows, begin, end, dt, scale
):  # fmt: skip
    """Pressure from the averaged volume strain and ``more``, heat or bulking (nodes,), viscosity and forces at n+1;
    with ``split``, pressure gradients.
    """
    shape, early = params[ORDER] == FROM_SHAPE, rows > UNTOLD
    for c in range(begin, end):
        t = tets[c * CHUNK : (c + 1) * CHUNK]
        s = state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        n = len(t)
        still = quiet[c, rest.STEADY] != 0 and rest.without(strain, t, n)
        if still and rows > UNTOLD:
            still = rest.without(more, t, n)
        if still and quiet[c, rest.NOTED] > 0:
            rest.pass_over(peaks, quiet[c], LARGEST_LIMIT, LIMITING_TET)
            continue
        before = s.copy() if still else s[:0]
        if shape and not early:
            tet4.gather_moved(w, x0, x, t, s, n)
        else:
            tet4.gather(w[tet4.EDGE :], x, t, s, n)
        upset = s.copy() if len(worn) > 0 and any_inside_out(w, n) else s[:0]
        if params[ORDER] == AFTER_PRESSURE:
            rates(w, v, t, n, dt)
            from_rates(strength, w, s, params, n, dt)
        tet4.end_gradients(w, n)
        if shape and not early:
            strengthen(strength, w, s, params, n, dt)
        averaged.gather_strains(w, strain, t, n)
        own = flat[c * CHUNK : c * CHUNK + n] if len(flat) > 0 else flat
        if rows > UNTOLD:
            averaged.gather_more(w, s, params, more, t, strain, own, rows, n)
        if shape:
            averaged.recall_growth(w, s, n, dt)
            if dt <= 0.0:
                first_speeds(w, v, t, n)
        else:
            averaged.recall_flux(w, s, n, dt)
        if len(own) > 0:
            see_own(w, s, params, own, rows, n)
        swell(eos, w, s, params, n)
        keep_before(w, s, params, n)
        pressure_and_limit(eos, w, s, params, n, dt)
        if len(worn) == 0:
            resist(w, s, params, n)
        return_at_pressure(strength, w, s, params, n, dt)
        book_averaged(w, s, params, n)
        if len(upset) > 0:
            let_go(w, s, upset, x, v, t, rows, n, 0.0)
        found, some_hot = SOUND, False
        if len(worn) > 0:
            found = mark_worn(worn[c * CHUNK : c * CHUNK + n], w, s, params, life, rows, n)
            peaks[WORN] = max(peaks[WORN], found)
        if len(hot) > 0:
            at = c * CHUNK
            some_hot = mark_hot(hot[at : at + n], w, s, weakest[at : at + n], shear, n)
            peaks[HOT] |= some_hot
        largest = sum_forces(
            force, pressure, gradient, split, own, t, s, w, wi, bits, peaks, ids[c * CHUNK : c * CHUNK + n], n, scale
        )
        quiet[c, rest.NOTED] = 0
        if still and largest == 0 and found == SOUND and not some_hot and rest.same(before, s):
            rest.note(quiet[c], bits, ids[c * CHUNK : c * CHUNK + n], n)


@njit(
    f"void({_F2}, {_I2}, {_F1}, {_I2}, boolean, {_B1}, {_T2}, {_F1}, {_F1}, {_I1}, {_I1}, {_I1}, {_I1}, "
    "int64, int64, int64, float64)",
    cache=True,
    error_model="numpy",
)
def forces_again(  # type: ignore[no-untyped-def]
    x, force, pressure, gradient, split, flat, tets, state, w, wi, bits, peaks, ids, rows, begin, end, scale
):
    """The forces of the present stress once more, in another quantum; changes no state and no limit."""
    for c in range(begin, end):
        t = tets[c * CHUNK : (c + 1) * CHUNK]
        s = state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        n = len(t)
        tet4.gather(w[tet4.EDGE :], x, t, s, n)
        tet4.end_gradients(w, n)
        w[_LIMIT : _LIMIT + n] = 0.0
        own = flat[c * CHUNK : c * CHUNK + n] if len(flat) > 0 else flat
        sum_forces(
            force, pressure, gradient, split, own, t, s, w, wi, bits, peaks, ids[c * CHUNK : c * CHUNK + n], n, scale
        )
