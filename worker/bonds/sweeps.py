"""Impulses of tied nodes, computed by Jacobi sweeps whose result does not depend on the order of the rows.

A tied row requires zero relative velocity between its tied node s and the point of the mortar side, v_s - sum_j W_j v_j
= 0, along all axes. The impulse J of a row acts on the tied node s, and -W_j J acts on the mortar nodes j. The impulses
of the mortar nodes are rounded to quanta, and the tied node gets minus the sum of these quanta, so that momentum is
conserved exactly. A sweep changes every impulse by the remaining relative velocity divided by a bound of the l1 norm of
its row, and extrapolates the change (Nesterov 1983 for a strongly convex problem; factor in layout.momentum). In every
sweep a row that may break is projected onto its limit (law.py).

A pass over the rows computes the impulses; a pass over the nodes sums the impulses on each node. No task reads data
that another task of the same pass writes, and the sums are sums of integers.
"""

import numpy as np

from ..kernels.jit import njit, types
from ..parallel.arguments import reader
from ..parallel.team import TASK
from . import law
from .records import (
    BREAKS,
    DAMAGE,
    LAST,
    NODES,
    NORMAL,
    OPENING,
    PUSH,
    ROWS,
    SHEAR_STRENGTH,
    STRENGTH,
    WIDEST,
)

_F1 = types.float64[::1]
_F, _I, _F2, _I2, _N1 = types.float64, types.int64, types.float64[:, ::1], types.int64[:, ::1], types.int32[::1]
TASK_SIZE = 256
"""Number of rows or nodes in a task. Chosen value: a task takes about 20 us, compared with 2 us to start a parallel
region."""
ACT = ROWS, NODES, _F, _F, _F, _F
GIVE = ROWS, NODES, _F
MOVE = NODES, _F
_act, _give, _move = reader(*ACT), reader(*GIVE), reader(*MOVE)


@njit(types.void(ROWS, NODES, _F, _F, _F, _F, _I, _I), cache=True, error_model="numpy")
def act(rows, nodes, ahead, mean_dt, dt, scale, first, stop):  # type: ignore[no-untyped-def]
    """Corrects the impulses of the rows from ``first`` to ``stop``. ``ahead``: extrapolation factor; ``mean_dt``: time
    for which the impulses act, s; ``dt``: time step, s; ``scale``: quanta per N s.
    """
    v, state, laws, inverse, change, own = nodes.v, rows.state, rows.laws, rows.inverse, rows.change, rows.own
    node, begin, master, weight = rows.node, rows.begin, rows.master, rows.weight
    for r in range(first, stop):
        s = node[r]
        p, q, w = v[s, 0], v[s, 1], v[s, 2]
        for e in range(begin[r], begin[r + 1]):
            p -= weight[e] * v[master[e], 0]
            q -= weight[e] * v[master[e], 1]
            w -= weight[e] * v[master[e], 2]
        b, old = rows.bond[r], (state[r, PUSH], state[r, PUSH + 1], state[r, PUSH + 2])
        if state[r, DAMAGE] >= 1.0:
            push = 0.0, 0.0, 0.0
        elif laws[b, BREAKS] == 0.0:
            push = old[0] - inverse[r, 0] * p, old[1] - inverse[r, 1] * q, old[2] - inverse[r, 2] * w
        else:
            out, force = (state[r, NORMAL], state[r, NORMAL + 1], state[r, NORMAL + 2]), mean_dt * rows.area[r]
            most, opening = (force * laws[b, STRENGTH], force * laws[b, SHEAR_STRENGTH]), state[r, OPENING]
            play, stiff = state[r, WIDEST] - opening, 1.0 - state[r, DAMAGE]
            step = max(inverse[r, 0], inverse[r, 1], inverse[r, 2])
            push = law.project(old, (p, q, w), out, opening, play, step, most[0], most[1], dt, stiff)
        for i in range(3):
            plain = push[i] if inverse[r, i] > 0.0 else 0.0
            new = plain + ahead * (plain - state[r, LAST + i])
            change[r, i] = new - old[i]
            state[r, PUSH + i], state[r, LAST + i], own[r, i] = new, plain, 0
            for e in range(begin[r], begin[r + 1]):
                own[r, i] += np.int64(np.rint(weight[e] * change[r, i] * scale))


@njit(types.void(ROWS, NODES, _F, _F, _I, _I), cache=True)
def resume(rows, nodes, ratio, scale, first, stop):  # type: ignore[no-untyped-def]
    """Warm start of the rows from ``first`` to ``stop``. The rows start with ``ratio`` times their last impulses, and
    with the present normals of their faces.
    """
    state, laws, begin = rows.state, rows.laws, rows.begin
    for r in range(first, stop):
        if laws[rows.bond[r], BREAKS] != 0.0 and state[r, DAMAGE] < 1.0:
            out = law.normal(rows, nodes, r)
            for i in range(3):
                state[r, NORMAL + i] = out[i]
        for i in range(3):
            state[r, PUSH + i] *= ratio
            rows.change[r, i] = state[r, LAST + i] = state[r, PUSH + i]
            rows.own[r, i] = 0
            for e in range(begin[r], begin[r + 1]):
                rows.own[r, i] += np.int64(np.rint(rows.weight[e] * rows.change[r, i] * scale))


@njit(types.void(ROWS, NODES, _F, _I, _I), cache=True)
def give(rows, nodes, scale, first, stop):  # type: ignore[no-untyped-def]
    """Sums the impulses, in quanta, that the rows of this rank apply to the nodes from ``first`` to ``stop``."""
    words, share, row, change, own = nodes.words, nodes.share, nodes.row, rows.change, rows.own
    for a in range(first, stop):
        for i in range(3):
            words[a, i] = 0
        for k in range(nodes.first[a], nodes.first[a + 1]):
            r = row[k]
            for i in range(3):
                if np.isnan(share[k]):
                    words[a, i] += own[r, i]
                else:
                    words[a, i] -= np.int64(np.rint(share[k] * change[r, i] * scale))


@njit(types.void(NODES, _F, _I, _I), cache=True)
def move(nodes, scale, first, stop):  # type: ignore[no-untyped-def]
    """Adds the impulses of the rows of all ranks to the velocities of the nodes from ``first`` to ``stop``."""
    v, words, total, mobility = nodes.v, nodes.words, nodes.total, nodes.mobility
    for a in range(first, stop):
        for i in range(3):
            v[a, i] += words[a, i] * (mobility[a, i] / scale)
            total[a, i] += words[a, i]


@njit(types.void(ROWS, NODES, _F, _F, _F, _F, _I), cache=True)
def sweep_all(rows, nodes, ahead, mean_dt, dt, scale, many):  # type: ignore[no-untyped-def]
    """Runs ``many`` sweeps of all rows. The function is used if no row of another rank applies impulses to the nodes of
    this rank.
    """
    for k in range(many):
        act(rows, nodes, ahead if k + 1 < many else 0.0, mean_dt, dt, scale, 0, len(rows.node))
        give(rows, nodes, scale, 0, len(nodes.v))
        move(nodes, scale, 0, len(nodes.v))


@njit(TASK, cache=True)
def act_task(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``act`` for a range of rows."""
    rows, nodes, ahead, mean_dt, dt, scale = _act(table)
    act(rows, nodes, ahead, mean_dt, dt, scale, first, stop)


@njit(TASK, cache=True)
def give_task(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``give`` for a range of nodes."""
    rows, nodes, scale = _give(table)
    give(rows, nodes, scale, first, stop)


@njit(TASK, cache=True)
def move_task(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``move`` for a range of nodes."""
    nodes, scale = _move(table)
    move(nodes, scale, first, stop)


@njit(types.void(_F1, _F1, _N1, _F2, _I2, _F2, _F), cache=True)
def book(loss, external, local, before, total, mobility, scale):  # type: ignore[no-untyped-def]
    """Adds half of the work of the impulses ``total`` (n, 3) on the nodes ``local`` (n,), computed with the velocities
    ``before`` (n, 3). The work is energy that the bonds dissipate. If the velocity of a node is prescribed, a part of
    the work is external work.
    """
    for k in range(len(local)):
        a = local[k]
        for i in range(3):
            work = 0.5 * before[k, i] * (total[k, i] / scale)
            loss[a] -= work
            if mobility[k, i] == 0.0:
                external[a] -= work
