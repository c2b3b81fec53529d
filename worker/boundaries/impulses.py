"""Kernels that apply impulses of boundaries to nodes and sum the work of these impulses. A kernel is a task over a
range of the nodes of a boundary (boundaries.py).
"""

import numpy as np

from ..kernels.jit import njit, types
from ..parallel.arguments import reader
from ..parallel.team import TASK

_F, _F1, _F2, _N1 = types.float64, types.float64[::1], types.float64[:, ::1], types.int32[::1]
NOTE = _F2, _N1, _F2, _F2, _F1, _F
"""Types of the arguments of ``note``: v (nodes, 3); nodes (n,) of the boundary; velocities v(n-1/2) (n, 3) of these
nodes, m/s; impulses on these nodes (n, 3), N s; account of the work of the impulses (n,), J; and 1/2 with the sign that
the work has in the account."""
_ACT = _F2, _F1, _N1, _F2, _F2, _F1
"""Types of the arguments that all kernels with external work have: v, mass (nodes,), and nodes of the boundary. Then,
for each node of the boundary: v(n-1/2), the impulse and the account, as in ``NOTE``."""
PRESCRIBE = (*_ACT, _F2, _F)
"""Types of the further arguments of ``prescribe``: velocities (n, 3), m/s, with NaN for a free component; and the
factor by which the velocities are multiplied."""
ACCELERATE = (*_ACT, _F1, _F)
"""Types of the further arguments of ``accelerate``: acceleration (3,), m/s^2, and the time for which it acts, s."""
PUSH = (*_ACT, _F2, _F)
"""Types of the further arguments of ``push``: forces (n, 3), N, and the time for which they act, s."""
HOLD = _F2, _N1, types.int64
"""Types of the arguments of ``hold``: vectors (nodes, 3), nodes (n,), and the component that is set to zero."""
_note, _prescribe, _accelerate, _push = reader(*NOTE), reader(*PRESCRIBE), reader(*ACCELERATE), reader(*PUSH)
_hold = reader(*HOLD)


@njit("void(float64[::1], float64[:, ::1], float64[:, ::1], int64, float64)", cache=True)
def book(account, impulse, before, j, factor):  # type: ignore[no-untyped-def]
    """Adds half of the work of an impulse to the ``account``, J: ``factor`` (1/2 with a sign) times the impulse of node
    ``j`` times the velocity ``before``.
    """
    work = 0.0
    for i in range(3):
        work += impulse[j, i] * before[j, i]
    account[j] += factor * work


@njit(TASK, cache=True)
def note(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: stores v(n-1/2), and adds the second half of the work of the last impulses to the account."""
    v, nodes, before, impulse, account, factor = _note(table)
    for j in range(begin, end):
        a = nodes[j]
        for i in range(3):
            before[j, i] = v[a, i]
        book(account, impulse, before, j, factor)


@njit(TASK, cache=True)
def prescribe(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: sets the prescribed velocity components."""
    v, mass, nodes, before, impulse, account, velocity, factor = _prescribe(table)
    for j in range(begin, end):
        a = nodes[j]
        for i in range(3):
            old, given = v[a, i], velocity[j, i]
            new = old if np.isnan(given) else factor * given
            impulse[j, i] = mass[a] * (new - old)
            v[a, i] = new
        book(account, impulse, before, j, 0.5)


@njit(TASK, cache=True)
def accelerate(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: adds one velocity to all nodes."""
    v, mass, nodes, before, impulse, account, acceleration, time = _accelerate(table)
    for j in range(begin, end):
        a = nodes[j]
        for i in range(3):
            gained = time * acceleration[i]
            impulse[j, i] = mass[a] * gained
            v[a, i] += gained
        book(account, impulse, before, j, 0.5)


@njit(TASK, cache=True, error_model="numpy")
def push(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: applies forces for the given time."""
    v, mass, nodes, before, impulse, account, force, time = _push(table)
    for j in range(begin, end):
        a = nodes[j]
        for i in range(3):
            impulse[j, i] = time * force[j, i]
            v[a, i] += impulse[j, i] / mass[a]
        book(account, impulse, before, j, 0.5)


@njit(TASK, cache=True)
def hold(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: sets one component of the vectors of the nodes to zero."""
    vectors, nodes, axis = _hold(table)
    for j in range(begin, end):
        vectors[nodes[j], axis] = 0.0
