r"""Passes over the elements of a block of tets, chunk by chunk; the time step calls the passes.

::

    standard   x, v --> edges, rates --> stress, pressure, viscosity --> forces --> nodal sums      one pass

    nodal,     x, v --> edges, rates --> (stress) --> volumes --> nodal sums                        strain_pass
    split                                                           |  exchange, nodal.complete
                                                                    v
                        nodal means --> pressure, (stress), viscosity --> forces --> nodal sums     force_pass

``standard_pass`` does all work of the ``standard`` form in one pass. The averaged pressure forms need two passes, and
the nodal sums are completed between the passes. ``forces_again`` repeats only the sum of forces, in a coarser quantum.

The material law (materials/law.py) determines the pass in which the deviatoric stress is computed. For a law that does
not depend on the pressure it is the first pass. For a law that depends on the pressure it is the second pass, after the
equation of state; this pass computes the velocity gradient again. A law that computes the stress from the undeformed
shape has no velocity gradient, so the first of two passes computes volumes only.

A pass over a chunk at rest, which no wave has reached, is omitted (rest.py).
"""

from ..kernels.jit import njit, types
from ..materials.law import AFTER_PRESSURE, DILATES, FROM_SHAPE, ORDER
from ..materials.models import press, strengthen
from ..model.rows import BULKING_STEP
from ..model.state import CHUNK
from . import chunks, rest, scratch, tet4
from . import pressure as averaged
from .barrier import resist
from .flat import exclude_flat
from .heat_and_bulking import scatter_more
from .matter import TETS, pressure_place
from .mean import book_averaged
from .records import BODY, LARGEST_LIMIT, LIMITING_TET, MARKS, MEANS, MOTION, SCRATCH
from .wear import any_inverted, reset_inverted

_F, _I = types.float64, types.int64


@njit(types.void(MOTION, BODY, MARKS, SCRATCH, _I, _I, _F, _F), cache=True, error_model="numpy")
def standard_pass(motion, body, marks, room, begin, end, dt, scale):  # type: ignore[no-untyped-def]
    """Computes stress and forces at n+1 of the chunks from ``begin`` to ``end``; each tet has its own pressure."""
    x0, x, v, force = motion.x0, motion.x, motion.v, motion.force
    tets, state, params, rows, strength, eos = body.tets, body.state, body.params, body.rows, body.strength, body.eos
    w, wi, bits, peaks, noted = room.w, room.wi, room.bits, room.peaks, body.quiet
    shape, erodes = params[ORDER] == FROM_SHAPE, len(marks.worn) > 0
    for c in range(begin, end):
        t, s = tets[c * CHUNK : (c + 1) * CHUNK], state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        first, last, n = c * CHUNK, c * CHUNK + len(t), len(t)
        ids, quiet = body.id[first:last], noted[c]
        # 1. Skip a chunk whose nodes have not moved. Its arrays contain the result of its last pass.
        still = dt > 0.0 and rest.at_rest(v, t, n)
        if still and quiet[rest.NOTED] > 0:
            rest.pass_over(peaks, quiet, LARGEST_LIMIT, LIMITING_TET)
            continue
        before = s.copy() if still else s[:0]
        # 2. Compute the edges at n+1. A law from the undeformed shape also needs the displacements.
        if shape:
            tet4.gather_moved(w, x0, x, t, s, n)
        else:
            tet4.gather(w[scratch.EDGE :], x, t, s, n)
        upset = s.copy() if erodes and any_inverted(w, n) else s[:0]
        # 3. Compute the volume strain and the deviatoric stress (only the trial stress, if the law needs the pressure).
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
        # 4. Compute pressure, viscosity and stable step. Then do the plastic return at the new pressure.
        press(eos, w, s, params, n)
        chunks.viscosity_and_limit(w, s, params, n, dt, False)
        chunks.return_at_pressure(strength, w, s, params, n, dt)
        if len(upset) > 0:
            reset_inverted(w, s, upset, x, v, t, rows, n, dt)
        # 5. Mark tets that meet the erosion criterion and overstressed faces; compute the forces.
        marked = chunks.mark(marks, first, last, w, peaks, s, params, rows)
        largest = chunks.sum_forces(force, w, wi, bits, peaks, t, s, ids, n, scale)
        quiet[rest.NOTED] = 0
        if still and largest == 0 and not marked and rest.same(before, s):
            rest.note(quiet, bits, ids, n)


@njit(types.void(MOTION, BODY, MARKS, SCRATCH, MEANS, _I, _I, _F), cache=True, error_model="numpy")
def strain_pass(motion, body, marks, room, means, begin, end, dt):  # type: ignore[no-untyped-def]
    """Computes the nodal sums of volume and volume change, which include the stabilising fluxes if the form is
    ``split``. Computes the deviatoric stress at n+1, if the law does not need the pressure.

    A law from the undeformed shape is applied here if the nodes need its work for their heat, else in ``force_pass``.
    For a chunk marked as at rest only the volumes are computed, because the nodal means need them.
    """
    x0, x, v, w = motion.x0, motion.x, motion.v, room.w
    tets, state, params, rows, strength = body.tets, body.state, body.params, body.rows, body.strength
    sums, weight, split = means.sums, means.weight, means.split
    shape, more, erodes = params[ORDER] == FROM_SHAPE, rows > BULKING_STEP, len(marks.worn) > 0
    for c in range(begin, end):
        t, s = tets[c * CHUNK : (c + 1) * CHUNK], state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        n, means_of = len(t), body.averages[c * CHUNK : (c + 1) * CHUNK]
        flat, quiet = body.flat[c * CHUNK : c * CHUNK + n], body.quiet[c]
        # 1. Compute only the volumes of a chunk at rest.
        still = not split and dt > 0.0 and rest.at_rest(v, t, n)
        if still and quiet[rest.NOTED] > 0:
            chunks.volumes_at_rest(w, x, t, s, shape, n)
            if len(flat) > 0:
                exclude_flat(w, flat, n)
            averaged.scatter_volumes(sums, w, weight, means_of, n, dt)
            continue
        # 2. Compute the edges at n+1. Compute also the displacements, if a law from the undeformed shape is applied in
        # this pass.
        if shape and more:
            tet4.gather_moved(w, x0, x, t, s, n)
        else:
            tet4.gather(w[scratch.EDGE :], x, t, s[:0] if shape else s, n)
        before = s.copy() if still else s[:0]
        upset = s.copy() if erodes and any_inverted(w, n) else s[:0]
        # 3. Compute volume change and deviatoric stress.
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
            reset_inverted(w, s, upset, x, v, t, rows, n, dt)
        if not shape:
            averaged.keep_flux(w, s, n)
        if params[DILATES] > 0.0:
            averaged.subtract_dilation(w, s, params, n, dt)
        # 4. Add volumes, and heat or bulking, to the nodal sums. Flat tets are left out.
        if len(flat) > 0:
            exclude_flat(w, flat, n)
        if more:
            scatter_more(sums, w, s, params, weight, means_of, rows, n)
        quiet[rest.NOTED] = 0
        quiet[rest.STEADY] = 1 if still and rest.same(before, s) else 0
        if split:
            if not shape:
                tet4.end_gradients(w, n)
            averaged.gather_projection(w, means.pressure, means.projected, means_of, n)
            averaged.stabilise(w, s, n, dt)
            if len(flat) > 0:
                exclude_flat(w, flat, n)
            averaged.scatter_stabilised(sums, w, weight, means_of, n, dt)
        else:
            averaged.scatter_volumes(sums, w, weight, means_of, n, dt)


@njit(types.void(MOTION, BODY, MARKS, SCRATCH, MEANS, _I, _I, _F, _F), cache=True, error_model="numpy")
def force_pass(motion, body, marks, room, means, begin, end, dt, scale):  # type: ignore[no-untyped-def]
    """Computes pressure from the nodal means, viscosity and forces at n+1. If the form is ``split``, also computes
    pressure gradients.
    """
    x0, x, v, force = motion.x0, motion.x, motion.v, motion.force
    tets, state, params, rows, strength = body.tets, body.state, body.params, body.rows, body.strength
    w, wi, bits, peaks, noted = room.w, room.wi, room.bits, room.peaks, body.quiet
    shape, more, erodes = params[ORDER] == FROM_SHAPE, rows > BULKING_STEP, len(marks.worn) > 0
    by_tets = pressure_place(body.eos, params) == TETS
    for c in range(begin, end):
        t, s = tets[c * CHUNK : (c + 1) * CHUNK], state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        first, last, n = c * CHUNK, c * CHUNK + len(t), len(t)
        ids, flat, quiet, means_of = body.id[first:last], body.flat[first:last], noted[c], body.averages[first:last]
        # 1. Keep the last result of a chunk at rest, if the first pass did not change the chunk and its nodes have no
        # strain.
        still = quiet[rest.STEADY] != 0 and rest.without(means.strain, means_of, n)
        if still and more:
            still = rest.without(means.more, means_of, n)
        if still and quiet[rest.NOTED] > 0:
            rest.pass_over(peaks, quiet, LARGEST_LIMIT, LIMITING_TET)
            continue
        before = s.copy() if still else s[:0]
        # 2. Compute edges and V grad N at n+1.
        if shape and not more:
            tet4.gather_moved(w, x0, x, t, s, n)
        else:
            tet4.gather(w[scratch.EDGE :], x, t, s, n)
        upset = s.copy() if erodes and any_inverted(w, n) else s[:0]
        # 3. Compute the trial stress of a law that needs the pressure. Compute the deviatoric stress from the
        # undeformed shape, unless the first pass did.
        if params[ORDER] == AFTER_PRESSURE:
            chunks.rates(w, v, t, n, dt)
            chunks.from_rates(strength, w, s, params, n, dt)
        tet4.end_gradients(w, n)
        if shape and not more:
            strengthen(strength, w, s, params, n, dt)
        # 4. Compute volume strain, heat and bulking from the nodal means; then compute the pressure.
        chunks.take_means(w, s, body, means, means_of, flat, n)
        chunks.own_change(w, s, v, t, shape, n, dt)
        chunks.averaged_pressure(w, s, body, means.matter, means_of, flat, n)
        # 5. Compute viscosity, stable step and inversion barrier. Then do the plastic return at the new pressure.
        chunks.viscosity_and_limit(w, s, params, n, dt, True)
        if not erodes:
            resist(w, s, params, n)
        chunks.return_at_pressure(strength, w, s, params, n, dt)
        if by_tets:
            book_averaged(w, s, params, n)
        if len(upset) > 0:
            reset_inverted(w, s, upset, x, v, t, rows, n, 0.0)
        # 6. Mark tets that meet the erosion criterion and overstressed faces; compute forces and pressure gradients.
        marked = chunks.mark(marks, first, last, w, peaks, s, params, rows)
        largest = chunks.sum_forces(force, w, wi, bits, peaks, t, s, ids, n, scale)
        if means.split:
            fluxes = chunks.sum_fluxes(means.gradient, means.pressure, w, wi, peaks, flat, means_of, n, scale)
            largest = max(largest, fluxes)
        quiet[rest.NOTED] = 0
        if still and largest == 0 and not marked and rest.same(before, s):
            rest.note(quiet, bits, ids, n)


@njit(types.void(MOTION, BODY, SCRATCH, MEANS, _I, _I, _F), cache=True, error_model="numpy")
def forces_again(motion, body, room, means, begin, end, scale):  # type: ignore[no-untyped-def]
    """Sums the forces of the present stress again, in another quantum. State and stable step do not change."""
    w, wi, bits, peaks, rows = room.w, room.wi, room.bits, room.peaks, body.rows
    for c in range(begin, end):
        t, s = body.tets[c * CHUNK : (c + 1) * CHUNK], body.state[c * rows * CHUNK : (c + 1) * rows * CHUNK]
        first, last, n = c * CHUNK, c * CHUNK + len(t), len(t)
        tet4.gather(w[scratch.EDGE :], motion.x, t, s, n)
        tet4.end_gradients(w, n)
        w[scratch.LIMIT : scratch.LIMIT + n] = 0.0
        chunks.sum_forces(motion.force, w, wi, bits, peaks, t, s, body.id[first:last], n, scale)
        if means.split:
            flat, means_of = body.flat[first:last], body.averages[first:last]
            chunks.sum_fluxes(means.gradient, means.pressure, w, wi, peaks, flat, means_of, n, scale)
