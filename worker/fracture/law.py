r"""Kernels of the traction-separation law of cohesive facets; cohesive.py draws the law.

A pair is a node of the first side of a facet and the opposite node; each facet has three pairs. The traction is T = k
d, with the opening d and the secant stiffness k = s(top) / top, where top is the largest opening so far; a pair that
closes can release the energy k (D^2 - lent^2) / 2 per area. D is the present effective opening, and lent is the opening
e at insertion. If D decreased below ``lent``, the pair would release more energy than it absorbed. In that case the
offset of the pair is first multiplied by a factor q below 1:

    d -> q d,   lent^2 -> max(lent^2 - (1 - q^2) D^2, 0),   k unchanged,

After this change of the offset, the recoverable energy k (D^2 - lent^2) / 2 does not change; with q = 0 no energy is
recoverable. The remaining energy is the area under the law from ``lent`` on. The area consists of a triangle up to the
knee and a triangle beyond the knee:

    left = k (knee^2 - lent^2) / 2 + k knee critical / 2,   knee = top, or less if critical would be below 0.
"""

import numpy as np

from ..elements.forces import largest_of, quanta
from ..kernels.jit import njit, types
from ..parallel.arguments import reader
from ..parallel.team import TASK
from ..parallel.words import add
from .columns import COLUMNS, FACETS, Facets

_SLACK = 1e-6
"""Energy that a pair may release beyond the energy that it absorbed, divided by the fracture energy. Chosen value:
above round-off."""
_EXHAUSTED = 1e-6
"""Smallest energy that remains to a pair after unloading, divided by the fracture energy. Chosen value."""


_F1, _F2, _F3 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
_I, _F, _I1, _I2 = types.int64, types.float64, types.int64[::1], types.int64[:, ::1]
OPEN = *COLUMNS, _F2, _I1
UNLOAD = *COLUMNS, _I1, _F2, _F2, _I2, _F1, _F1, _F, types.boolean
FORESEE = *COLUMNS, _F2, _I2, _F1, _F
_read_open, _read_unload, _read_foresee = reader(*OPEN), reader(*UNLOAD), reader(*FORESEE)
FACETS_OF_A_TASK = 256
"""Number of facets in a task; chosen value: a task takes 10 to 20 us, compared with 2 us to start a parallel region."""


@njit(types.void(_F2, _F2, types.int32[::1]), cache=True, error_model="numpy")
def turn(frame, x, nodes):  # type: ignore[no-untyped-def]
    """Sets ``frame`` to three axes of the triangle in the middle between the two sides: normal n, first edge e, and n x
    e.
    """
    for i in range(3):
        a = x[nodes[0], i] + x[nodes[3], i]
        frame[1, i] = x[nodes[1], i] + x[nodes[4], i] - a
        frame[2, i] = x[nodes[2], i] + x[nodes[5], i] - a
    length, across = 0.0, 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[0, i] = frame[1, j] * frame[2, k] - frame[1, k] * frame[2, j]
        length += frame[1, i] * frame[1, i]
        across += frame[0, i] * frame[0, i]
    for i in range(3):
        frame[0, i] /= np.sqrt(across)
        frame[1, i] /= np.sqrt(length)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[2, i] = frame[0, j] * frame[1, k] - frame[0, k] * frame[1, j]


@njit(_F(FACETS, _I, _I), cache=True, error_model="numpy")
def _share(f, m, p):  # type: ignore[no-untyped-def]
    """Returns the ratio s / strength: the remaining traction of a pair divided by its initial strength."""
    law, s = f.softening, f.state
    beyond = s.top[m, p] - law.knee[m, p]
    return 1.0 if beyond <= 0.0 else max(1.0 - beyond / law.critical[m, p], 0.0)


@njit(_F(_F1, _F2, _F1, _F1, _F), cache=True, error_model="numpy")
def _opened(d, frame, apart, offset, shear):  # type: ignore[no-untyped-def]
    """Sets ``d`` to the opening of a pair of nodes; returns the effective opening D. ``apart`` (3,): position of one
    node relative to the other.
    """
    for c in range(3):
        d[c] = offset[c] + frame[c, 0] * apart[0] + frame[c, 1] * apart[1] + frame[c, 2] * apart[2]
    d[0] = max(d[0], 0.0)
    return np.sqrt(d[0] * d[0] + shear * (d[1] * d[1] + d[2] * d[2]))


@njit(types.void(FACETS, _I, _I, _F2, _F1, _F), cache=True, error_model="numpy")
def _shorten(f, m, p, frame, d, kept):  # type: ignore[no-untyped-def]
    """Multiplies the present opening ``d`` of a pair by the factor ``kept``, by a change of the offset of the pair. The
    formulas are at the top of the file.
    """
    law, s = f.softening, f.state
    k = law.strength[m, p] * _share(f, m, p) / s.top[m, p]
    for c in range(3):
        along = 0.0
        for i in range(3):
            along += frame[c, i] * s.opening[m, p, i]
        d[c] *= kept
        law.offset[m, p, c] = d[c] - along
    lent = law.lent[m, p] ** 2 - (1.0 - kept * kept) * s.size[m, p] ** 2
    s.size[m, p] *= kept
    law.lent[m, p] = np.sqrt(max(lent, 0.0)) if kept > 0.0 else 0.0
    lent = law.lent[m, p] ** 2
    left = max(f.constants.energy[m] - 3.0 * s.work[m, p] / f.constants.area[m], _EXHAUSTED * f.constants.energy[m])
    left = (
        2.0 / k * left + s.size[m, p] ** 2 - lent
    )  # Squares of openings. Each square is twice an energy divided by k, as are the areas of the triangles.
    knee = min(s.top[m, p], np.sqrt(lent + left))
    law.strength[m, p] = k * knee
    law.critical[m, p] = max(left - (knee * knee - lent), 0.0) / knee
    law.knee[m, p] = s.top[m, p] = knee


@njit(TASK, cache=True, error_model="numpy")
def open_facets(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: computes openings, tractions and work of facets at the positions ``x``. Counts in ``failed`` (tasks,) the
    facets that have failed at all three pairs. The work in a step is the mean of the old and the new force times the
    change of the opening.
    """
    tets, nodes, constants, softening, state, x, failed = _read_open(table)
    f, many = Facets(tets, nodes, constants, softening, state), 0
    law, s = f.softening, f.state
    frame, d, moved = np.empty((3, 3)), np.empty(3), np.empty(3)
    for m in range(first, stop):
        turn(frame, x, f.nodes[m])
        third, holds = f.constants.area[m] / 3.0, False
        for p in range(3):
            for i in range(3):
                now = x[f.nodes[m, 3 + p], i] - x[f.nodes[m, p], i]
                moved[i] = now - s.opening[m, p, i]
                s.work[m, p] += 0.5 * s.pull[m, p, i] * moved[i]
                s.opening[m, p, i] = now
            s.size[m, p] = _opened(d, frame, s.opening[m, p], law.offset[m, p], f.constants.shear[m])
            s.top[m, p] = max(s.top[m, p], s.size[m, p])
            share = _share(f, m, p)
            if share > 0.0 and s.size[m, p] < law.lent[m, p] - _SLACK * f.constants.energy[m] / law.strength[m, p]:
                _shorten(f, m, p, frame, d, 0.0)
                share = 1.0
            holds |= share > 0.0
            stiffness = third * law.strength[m, p] * share / s.top[m, p]
            for i in range(3):
                across = frame[1, i] * d[1] + frame[2, i] * d[2]
                s.pull[m, p, i] = stiffness * (frame[0, i] * d[0] + f.constants.shear[m] * across)
                s.work[m, p] += 0.5 * s.pull[m, p, i] * moved[i]
        many += not holds
    failed[first // FACETS_OF_A_TASK] = many


@njit(types.void(_F1, FACETS, _I, _I, _F2, _I2, _F1, _F), cache=True, error_model="numpy")
def _foresee(ahead, f, m, p, v, force, mass, quantum):  # type: ignore[no-untyped-def]
    """Sets ``ahead`` to the opening velocity of a pair at n+1/2. The velocity is the one that would result if only the
    present nodal forces acted.
    """
    a, b = f.nodes[m, p], f.nodes[m, 3 + p]
    for i in range(3):
        ahead[i] = v[b, i] - v[a, i] + quantum * (force[b, i] / mass[b] - force[a, i] / mass[a])


@njit(TASK, cache=True, error_model="numpy")
def unload(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: unloads pairs that would release more energy in the next step than they absorbed. The traction of a pair is
    lowered as far as needed, or to zero if ``whole``.

    The change of the nodal forces, quanta, is added to ``change`` (3 nodes,). Two tasks may add to one node, so the
    additions are atomic; only pairs that unload add to the array. ``steps``: dt(n-1/2), the mean of both steps,
    dt(n+1/2), s. Velocity changes by other causes than nodal forces, mainly contact, are extrapolated from the last
    step.
    """
    tets, nodes, constants, softening, state, change, x, v, force, mass, steps, scale, whole = _read_unload(table)
    f = Facets(tets, nodes, constants, softening, state)
    law, s = f.softening, f.state
    frame, d, ahead, apart, pull = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for m in range(first, stop):
        turn(frame, x, f.nodes[m])
        for p in range(3):
            a, b, share = f.nodes[m, p], f.nodes[m, 3 + p], _share(f, m, p)
            if law.lent[m, p] == 0.0 or a == b or share == 0.0:
                continue
            _foresee(ahead, f, m, p, v, force, mass, steps[1] / scale)
            for i in range(3):
                pushed = v[b, i] - v[a, i] - s.foreseen[m, p, i]
                apart[i] = s.opening[m, p, i] + steps[2] * (ahead[i] + pushed)
                pull[i] = s.pull[m, p, i]
            short = law.lent[m, p] - _opened(d, frame, apart, law.offset[m, p], f.constants.shear[m])
            if short <= _SLACK * f.constants.energy[m] / law.strength[m, p]:
                continue
            # If a traction is lowered by dF, the pair opens further along the traction, by dt^2 dF (1 / m_a + 1 / m_b).
            # The effective opening D increases by this amount times |T| / (k D).
            size = _opened(d, frame, s.opening[m, p], law.offset[m, p], f.constants.shear[m])
            strength = np.sqrt(pull[0] ** 2 + pull[1] ** 2 + pull[2] ** 2)
            slope = 3.0 * strength / (f.constants.area[m] * law.strength[m, p] * share / s.top[m, p] * size)
            gain = slope * strength * steps[1] * steps[2] * (1.0 / mass[a] + 1.0 / mass[b])
            kept = 0.0 if whole else max(1.0 - short / gain, 0.0)
            old = quanta(pull[0], pull[1], pull[2], scale)
            new = quanta(kept * pull[0], kept * pull[1], kept * pull[2], scale)
            for i in range(3):
                add(change, 3 * a + i, new[i] - old[i])
                add(change, 3 * b + i, old[i] - new[i])
                s.pull[m, p, i] = kept * pull[i]
                s.work[m, p] -= 0.5 * (1.0 - kept) * pull[i] * (v[b, i] - v[a, i]) * steps[0]
            _shorten(f, m, p, frame, d, kept)


@njit(TASK, cache=True, error_model="numpy")
def foresee(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: stores the opening velocities of pairs that would result if only the present nodal forces acted;
    ``quantum``: mean time step divided by the force scale, N s.
    """
    tets, nodes, constants, softening, state, v, force, mass, quantum = _read_foresee(table)
    f = Facets(tets, nodes, constants, softening, state)
    for m in range(first, stop):
        for p in range(3):
            if f.softening.lent[m, p] > 0.0:
                _foresee(f.state.foreseen[m, p], f, m, p, v, force, mass, quantum)


@njit(_I(_I2, types.int32[:, ::1], _F3, _F), cache=True)
def scatter(force, nodes, pull, scale):  # type: ignore[no-untyped-def]
    """Adds the forces, in quanta of 1 / ``scale`` N, to the nodal sums. Returns the largest force as its bit pattern
    (integer).
    """
    peak = 0
    for m in range(len(nodes)):
        for p in range(3):
            fx, fy, fz = pull[m, p, 0], pull[m, p, 1], pull[m, p, 2]
            peak = max(peak, largest_of(fx, fy, fz))
            f = quanta(fx, fy, fz, scale)
            for i in range(3):
                force[nodes[m, p], i] += f[i]
                force[nodes[m, 3 + p], i] -= f[i]
    return peak


@njit("void(int64[:, ::1], int64, int32[:, ::1], float64[:, :, ::1], float64)", cache=True)
def scatter_copies(change, first, nodes, pull, scale):  # type: ignore[no-untyped-def]
    """Adds the forces ``pull`` on facets ``nodes`` (m, 6), in quanta, to ``change``, which has one row for each node
    from ``first`` on.
    """
    for m in range(len(nodes)):
        for k in range(6):
            if nodes[m, k] >= first:
                for i in range(3):
                    force = np.int64(np.rint(pull[m, k % 3, i] * scale))
                    change[nodes[m, k] - first, i] += force if k < 3 else -force


@njit("int64[::1](int32[:, ::1], int64[::1], int64)", cache=True)
def touching(table, some, n):  # type: ignore[no-untyped-def]
    """Returns the indices of the rows of ``table`` (m, 6) that contain at least one node of ``some``; ``n``: number of
    nodes.
    """
    flags, rows, found = np.zeros(n, np.bool_), np.empty(len(table), np.int64), 0
    for a in some:
        flags[a] = True
    for i in range(len(table)):
        for k in range(table.shape[1]):
            if flags[table[i, k]]:
                rows[found] = i
                found += 1
                break
    return rows[:found].copy()
