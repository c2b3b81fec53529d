"""Passes over the elements of a block, chunk by chunk: what the time step calls.

``standard_pass`` does everything in one pass. The averaged pressure forms need two, with the completed nodal sums
between them: ``strain_pass`` (velocity gradient, deviatoric stress, nodal volume sums) and ``force_pass`` (pressure,
viscosity, forces). ``forces_again`` repeats only the sum of forces, in a coarser quantum. Where the strength depends on
the pressure, the plastic return comes after the equation of state, and with it, in two passes, the whole deviatoric
stress: then the second pass makes the velocity gradient again. A law from the shape has no velocity gradient: the first
of two passes finds volumes alone.

Chunks at rest, which no wave has reached, are passed over (rest.py).
"""

from ..kernels.jit import njit, types
from ..materials.law import AFTER_PRESSURE, DILATES, FROM_SHAPE, ORDER
from ..materials.models import press, strengthen, swell
from ..model.rows import BULKING_STEP
from ..model.state import CHUNK
from . import chunks, rest, tet4
from . import matter as matter_of
from . import pressure as averaged
from .barrier import resist
from .flat import keep_out, press_alone, see_own
from .heat_and_bulking import HEATED, gather_corners, gather_heat, scatter_more
from .mean import book_averaged, keep_before
from .records import BODY, LARGEST_LIMIT, LIMITING_TET, MARKS, MEANS, MOTION, SCRATCH
from .wear import any_inside_out, let_go

_F, _I = types.float64, types.int64


@njit(types.void(MOTION, BODY, MARKS, SCRATCH, _I, _I, _F, _F), cache=True, error_model="numpy")
def standard_pass(motion, body, marks, scratch, begin, end, dt, scale):  # type: ignore[no-untyped-def]
    """Stress and forces at n+1 of chunks ``begin`` to ``end``, each tet with its own pressure."""
    x0, x, v, force = motion.x0, motion.x, motion.v, motion.force
    tets, state, params, rows, strength, eos = body.tets, body.state, body.params, body.rows, body.strength, body.eos
    worn, life, hot, weakest, shear = marks.worn, marks.life, marks.hot, marks.weakest, marks.shear
    w, wi, bits, peaks, id, noted = scratch.w, scratch.wi, scratch.bits, scratch.peaks, body.id, body.quiet
    shape, erodes = params[ORDER] == FROM_SHAPE, len(worn) > 0
    for c in range(begin, end):
        t, s = tets[c * CHUNK : (c + 1) * CHUNK], state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        first, last, n = c * CHUNK, c * CHUNK + len(t), len(t)
        ids, quiet = id[first:last], noted[c]
        still = dt > 0.0 and rest.at_rest(v, t, n)
        if still and quiet[rest.NOTED] > 0:
            rest.pass_over(peaks, quiet, LARGEST_LIMIT, LIMITING_TET)
            continue
        before = s.copy() if still else s[:0]
        if shape:
            tet4.gather_moved(w, x0, x, t, s, n)
        else:
            tet4.gather(w[tet4.EDGE :], x, t, s, n)
        upset = s.copy() if erodes and any_inside_out(w, n) else s[:0]
        if shape:
            tet4.end_gradients(w, n)
            strengthen(strength, w, s, params, n, dt)
            averaged.own_growth(w, s, n, dt)
            if dt <= 0.0:
                chunks.first_speeds(w, v, t, n)
        else:
            chunks.rates(w, v, t, n, dt)
            chunks.from_rates(strength, w, s, params, n, dt)
            tet4.end_gradients(w, n)
            averaged.own_strains(w, n, dt)
        press(eos, w, s, params, n)
        chunks.viscosity_and_limit(w, s, params, n, dt, False)
        chunks.return_at_pressure(strength, w, s, params, n, dt)
        if len(upset) > 0:
            let_go(w, s, upset, x, v, t, rows, n, dt)
        marked = chunks.mark(
            worn[first:last], life, hot[first:last], weakest[first:last], shear, w, peaks, s, params, rows, n
        )
        largest = chunks.sum_forces(force, w, wi, bits, peaks, t, s, ids, n, scale)
        quiet[rest.NOTED] = 0
        if still and largest == 0 and not marked and rest.same(before, s):
            rest.note(quiet, bits, ids, n)


@njit(types.void(MOTION, BODY, MARKS, SCRATCH, MEANS, _I, _I, _F), cache=True, error_model="numpy")
def strain_pass(motion, body, marks, scratch, means, begin, end, dt):  # type: ignore[no-untyped-def]
    """The nodal sums of volume change, with ``split`` stabilised; deviatoric stress at n+1 of laws that act so early.

    A law from the shape does where the nodes must have its work, for their heat; else it acts in ``force_pass``. Of a
    chunk that is noted as at rest only the volumes, which the mean over its nodes' tets needs.
    """
    x0, x, v, w = motion.x0, motion.x, motion.v, scratch.w
    tets, state, params, rows, strength = body.tets, body.state, body.params, body.rows, body.strength
    sums, weight, split, pressure, projected = means.sums, means.weight, means.split, means.pressure, means.projected
    apart, noted, averages = body.flat, body.quiet, body.averages
    shape, more, erodes = params[ORDER] == FROM_SHAPE, rows > BULKING_STEP, len(marks.worn) > 0
    for c in range(begin, end):
        t, s = tets[c * CHUNK : (c + 1) * CHUNK], state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        n, means_of = len(t), averages[c * CHUNK : (c + 1) * CHUNK]
        flat, quiet = apart[c * CHUNK : c * CHUNK + n], noted[c]
        still = not split and dt > 0.0 and rest.at_rest(v, t, n)
        if still and quiet[rest.NOTED] > 0:
            if shape:
                tet4.unchanged(w, s, n)
            else:
                tet4.gather(w[tet4.EDGE :], x, t, s[:0], n)
                tet4.at_rest(w, n)
            if len(flat) > 0:
                keep_out(w, flat, n)
            averaged.scatter_volumes(sums, w, weight, means_of, n, dt)
            continue
        if shape and more:
            tet4.gather_moved(w, x0, x, t, s, n)
        else:
            tet4.gather(w[tet4.EDGE :], x, t, s[:0] if shape else s, n)
        before = s.copy() if still else s[:0]
        upset = s.copy() if erodes and any_inside_out(w, n) else s[:0]
        if shape:
            tet4.end_gradients(w, n) if more or split else tet4.volumes(w, n)
            tet4.growth(w, s, n, dt)
            if more:
                strengthen(strength, w, s, params, n, dt)
        else:
            chunks.rates(w, v, t, n, dt)
            if params[ORDER] != AFTER_PRESSURE:
                chunks.from_rates(strength, w, s, params, n, dt)
        if len(upset) > 0:
            let_go(w, s, upset, x, v, t, rows, n, dt)
        if not shape:
            averaged.keep_flux(w, s, n)
        if params[DILATES] > 0.0:
            averaged.tell_dilation(w, s, params, n, dt)
        if len(flat) > 0:
            keep_out(w, flat, n)
        if more:
            scatter_more(sums, w, s, params, weight, means_of, rows, n)
        quiet[rest.NOTED] = 0
        quiet[rest.STEADY] = 1 if still and rest.same(before, s) else 0
        if split:
            if not shape:
                tet4.end_gradients(w, n)
            averaged.gather_projection(w, pressure, projected, means_of, n)
            averaged.stabilise(w, s, n, dt)
            if len(flat) > 0:
                keep_out(w, flat, n)
            averaged.scatter_stabilised(sums, w, weight, means_of, n, dt)
        else:
            averaged.scatter_volumes(sums, w, weight, means_of, n, dt)


@njit(types.void(MOTION, BODY, MARKS, SCRATCH, MEANS, _I, _I, _F, _F), cache=True, error_model="numpy")
def force_pass(motion, body, marks, scratch, means, begin, end, dt, scale):  # type: ignore[no-untyped-def]
    """Pressure from the averaged volume strain, with heat or bulking where there is ``more``, viscosity and forces at
    n+1; with ``split``, pressure gradients.
    """
    x0, x, v, force = motion.x0, motion.x, motion.v, motion.force
    tets, state, params, rows, strength, eos = body.tets, body.state, body.params, body.rows, body.strength, body.eos
    worn, life, hot, weakest, shear = marks.worn, marks.life, marks.hot, marks.weakest, marks.shear
    w, wi, bits, peaks, id, noted = scratch.w, scratch.wi, scratch.bits, scratch.peaks, body.id, body.quiet
    strain, told, gradient, pressure = means.strain, means.more, means.gradient, means.pressure
    split, apart, matter, averages = means.split, body.flat, means.matter, body.averages
    shape, more, erodes = params[ORDER] == FROM_SHAPE, rows > BULKING_STEP, len(worn) > 0
    by_tets = matter_of.whose(eos, params) == matter_of.TETS
    for c in range(begin, end):
        t, s = tets[c * CHUNK : (c + 1) * CHUNK], state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        first, last, n = c * CHUNK, c * CHUNK + len(t), len(t)
        ids, flat, quiet, means_of = id[first:last], apart[first:last], noted[c], averages[first:last]
        still = quiet[rest.STEADY] != 0 and rest.without(strain, means_of, n)
        if still and more:
            still = rest.without(told, means_of, n)
        if still and quiet[rest.NOTED] > 0:
            rest.pass_over(peaks, quiet, LARGEST_LIMIT, LIMITING_TET)
            continue
        before = s.copy() if still else s[:0]
        if shape and not more:
            tet4.gather_moved(w, x0, x, t, s, n)
        else:
            tet4.gather(w[tet4.EDGE :], x, t, s, n)
        upset = s.copy() if erodes and any_inside_out(w, n) else s[:0]
        if params[ORDER] == AFTER_PRESSURE:
            chunks.rates(w, v, t, n, dt)
            chunks.from_rates(strength, w, s, params, n, dt)
        tet4.end_gradients(w, n)
        if shape and not more:
            strengthen(strength, w, s, params, n, dt)
        averaged.gather_strains(w, strain, means_of, n)
        if more:
            if rows == HEATED:
                gather_heat(s, told, means_of, n)
            else:
                gather_corners(w, s, params, told, means_of, strain, flat, n)
        if shape:
            averaged.recall_growth(w, s, n, dt)
            if dt <= 0.0:
                chunks.first_speeds(w, v, t, n)
        else:
            averaged.recall_flux(w, s, n, dt)
        if len(flat) > 0:
            see_own(w, s, params, flat, rows, n)
        swell(eos, w, s, params, n)
        keep_before(w, s, params, n)
        if by_tets:
            press(eos, w, s, params, n)
        else:
            alone = s.copy() if len(flat) > 0 else s[:0]
            matter_of.take_means(w, s, params, matter, means_of, n)
            if len(flat) > 0:
                press_alone(eos, w, s, alone, params, flat, rows, n)
        chunks.viscosity_and_limit(w, s, params, n, dt, True)
        if not erodes:
            resist(w, s, params, n)
        chunks.return_at_pressure(strength, w, s, params, n, dt)
        if by_tets:
            book_averaged(w, s, params, n)
        if len(upset) > 0:
            let_go(w, s, upset, x, v, t, rows, n, 0.0)
        marked = chunks.mark(
            worn[first:last], life, hot[first:last], weakest[first:last], shear, w, peaks, s, params, rows, n
        )
        largest = chunks.sum_forces(force, w, wi, bits, peaks, t, s, ids, n, scale)
        if split:
            largest = max(largest, chunks.sum_fluxes(gradient, pressure, w, wi, peaks, flat, means_of, n, scale))
        quiet[rest.NOTED] = 0
        if still and largest == 0 and not marked and rest.same(before, s):
            rest.note(quiet, bits, ids, n)


@njit(types.void(MOTION, BODY, SCRATCH, MEANS, _I, _I, _F), cache=True, error_model="numpy")
def forces_again(motion, body, scratch, means, begin, end, scale):  # type: ignore[no-untyped-def]
    """The forces of the present stress once more, in another quantum; changes no state and no limit."""
    w, wi, bits, peaks, rows = scratch.w, scratch.wi, scratch.bits, scratch.peaks, body.rows
    for c in range(begin, end):
        t, s = body.tets[c * CHUNK : (c + 1) * CHUNK], body.state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        first, last, n = c * CHUNK, c * CHUNK + len(t), len(t)
        tet4.gather(w[tet4.EDGE :], motion.x, t, s, n)
        tet4.end_gradients(w, n)
        w[tet4.LIMIT : tet4.LIMIT + n] = 0.0
        chunks.sum_forces(motion.force, w, wi, bits, peaks, t, s, body.id[first:last], n, scale)
        if means.split:
            flat, means_of = body.flat[first:last], body.averages[first:last]
            chunks.sum_fluxes(means.gradient, means.pressure, w, wi, peaks, flat, means_of, n, scale)
