"""Rigid bodies in the sweeps of contact. Each body acts as one node with six degrees of freedom.

Active contacts apply integer impulses to slots (contact/solver/sweeps.py), and the sums of shared slots are completed
as for other nodes. The impulses on the slots of a body, and their moments about its centre, are summed as integers:
first on the rank that owns the node of each slot, then over the ranks. The sums of the impulses change the motion of
the body, and the velocities of its slots are set to this motion. Therefore mass and inertia of a body couple all its
contact rows. The sweeps are Jacobi sweeps, as for shared nodes: the norm of a row is bounded by the l1 norm over all
rows of the body (``norms``), and the result does not depend on the order of contacts and ranks.
"""

import numpy as np

from ..contact.solver.active import IMPULSE, MOBILITY, NODES, V
from ..contact.solver.loading import SHARES
from ..kernels.jit import njit, types

WEIGHTS = 8
"""Number of words of the weights of a body. The words are sums over the slots of the body: of |w| |n_i|, of |arm x (|w|
|n|)|_i divided by the reach, of |w|, and of |arm| |w|."""
WORDS = 6
"""Number of words of an impulse (3), quanta, and of a moment (3), in quanta times the reach of the body."""
_F, _F1, _F2, _F3 = types.float64, types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
_N1, _I2, _B1 = types.int32[::1], types.int64[:, ::1], types.boolean[::1]


@njit(types.void(_I2, NODES, _N1, _N1, _F2, _B1, _F1), cache=True)
def weigh(words, active, slots, body, arms, owned, reach):  # type: ignore[no-untyped-def]
    """Adds the row weights of those ``slots`` (k,) that are ``owned`` (k,) to the sums of their bodies, ``words`` (b,
    WEIGHTS). ``body`` (k,): body of each slot; ``arms`` (k, 3): vectors from the centre of the body, m; ``reach`` (b,):
    a power of two above their lengths.
    """
    sums = active.row_weights
    for k in range(len(slots)):
        if not owned[k]:
            continue
        s, b = slots[k], body[k]
        x, y, z = abs(arms[k, 0]) / reach[b], abs(arms[k, 1]) / reach[b], abs(arms[k, 2]) / reach[b]
        for i in range(3):
            words[b, i] += sums[s, i]
        words[b, 3] += np.int64(np.rint(y * sums[s, 2] + z * sums[s, 1]))
        words[b, 4] += np.int64(np.rint(z * sums[s, 0] + x * sums[s, 2]))
        words[b, 5] += np.int64(np.rint(x * sums[s, 1] + y * sums[s, 0]))
        words[b, 6] += sums[s, 3]
        words[b, 7] += np.int64(np.rint((x + y + z) * sums[s, 3]))


@njit(types.void(NODES, _I2, _N1, _N1, _F2, _F1, _F2, _F3), cache=True, error_model="numpy")
def norms(active, words, slots, body, arms, reach, lightness, yielding):  # type: ignore[no-untyped-def]
    """Sets row weights and mobilities of ``slots``; their products bound a row of the contact matrix: sum_i |n_i| Q_i
    along a normal n, and Q for any direction across. ``words``: sums of ``weigh`` over all ranks; ``lightness`` (b, 3):
    1 / mass, 1/kg; ``yielding`` (b, 3, 3): inverse of the inertia along the axes of space; zero for held motion.
    """
    sums, fixed, moment, along = active.row_weights, active.fixed, np.empty(3), np.empty(3)
    for k in range(len(slots)):
        s, b = slots[k], body[k]
        most, heavy = 0.0, 0.0
        for j in range(3):
            row, moment[j] = 0.0, 0.0
            for i in range(3):
                row += abs(yielding[b, j, i])
                moment[j] += abs(yielding[b, j, i]) * (words[b, 3 + i] * reach[b])
            most, heavy = max(most, row), max(heavy, lightness[b, j])
        for i in range(3):
            j, m = (i + 1) % 3, (i + 2) % 3
            along[i] = lightness[b, i] * words[b, i] + abs(arms[k, m]) * moment[j] + abs(arms[k, j]) * moment[m]
        arm = abs(arms[k, 0]) + abs(arms[k, 1]) + abs(arms[k, 2])
        across = heavy * words[b, 6] + arm * most * (words[b, 7] * reach[b])
        for i in range(3):
            sums[s, i] = np.int64(np.ceil(along[i] / across * SHARES)) if across > 0.0 else 0
            fixed[s, MOBILITY + i] = across / SHARES
        sums[s, 3] = np.int64(SHARES)


@njit("void(int64[:, ::1], int64, int64, int64, int64, float64[:, ::1], int64, float64)", cache=True, forceinline=True)
def add_impulse(words, b, p, q, r, arms, k, reach):  # type: ignore[no-untyped-def]
    """Adds an impulse on the body ``b`` to ``words`` (b, WORDS), and its moment divided by the ``reach`` of the body.
    p, q, r: components of the impulse, quanta; ``k``: index in ``arms`` (n, 3) of its arm.
    """
    x, y, z = arms[k, 0] / reach, arms[k, 1] / reach, arms[k, 2] / reach
    words[b, 0] += p
    words[b, 1] += q
    words[b, 2] += r
    words[b, 3] += np.int64(np.rint(y * r - z * q))
    words[b, 4] += np.int64(np.rint(z * p - x * r))
    words[b, 5] += np.int64(np.rint(x * q - y * p))


@njit(types.void(_I2, NODES, _N1, _N1, _F2, _B1, _F1), cache=True)
def gather(words, active, slots, body, arms, owned, reach):  # type: ignore[no-untyped-def]
    """Moves the impulses of a sweep from ``slots`` to their bodies. Adds the impulses of ``owned`` slots to ``words``
    (b, WORDS), and sets the impulses of all slots to zero.
    """
    moving = active.moving_words
    for k in range(len(slots)):
        s, b = slots[k], body[k]
        p, q, r = moving[s, IMPULSE], moving[s, IMPULSE + 1], moving[s, IMPULSE + 2]
        for i in range(3):
            moving[s, IMPULSE + i] = 0
        if owned[k] and p | q | r:
            add_impulse(words, b, p, q, r, arms, k, reach[b])


@njit(types.void(NODES, _N1, _N1, _F2, _F2, _F2), cache=True)
def spread(active, slots, body, arms, speed, rate):  # type: ignore[no-untyped-def]
    """Sets the velocities of ``slots`` to the motion of their bodies, ``speed`` and ``rate`` (b, 3). Adds the change of
    the velocities to the paths of the slots.
    """
    v, path = active.moving, active.path
    for k in range(len(slots)):
        s, b = slots[k], body[k]
        x, y, z = arms[k, 0], arms[k, 1], arms[k, 2]
        p = speed[b, 0] + (rate[b, 1] * z - rate[b, 2] * y)
        q = speed[b, 1] + (rate[b, 2] * x - rate[b, 0] * z)
        r = speed[b, 2] + (rate[b, 0] * y - rate[b, 1] * x)
        path[s] += abs(p - v[s, V]) + abs(q - v[s, V + 1]) + abs(r - v[s, V + 2])
        v[s, V], v[s, V + 1], v[s, V + 2] = p, q, r
