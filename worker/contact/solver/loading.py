"""Selection of the contacts that are swept. A contact is loaded if it has needed an impulse in the step; all other
contacts are idle.

An idle contact closes more slowly than allowed, and needs no new test until sweeps have changed the velocities of its
nodes by more than a margin, its ``reach``. The reach of loaded contacts is infinite. The data of loaded contacts are
contiguous in memory.
"""

import numpy as np

from ...kernels.jit import njit, types
from ..narrow_phase.tables import CRACK
from .active import CONTACTS, KEPT, LAST, LOADED, MOBILITY, MU, NODES, PUSH, PUSH_T, ROW_NORM, ROW_NORM_T, WANTED, V

SHARES = float(2**30)
"""Number of quanta for a weight of 1."""
_ACROSS = (1.0, -1.0, 0.0, 0.0)
"""Weights of the two nodes of a contact across a crack."""
_ROUNDING = 2.0**-40
"""Allowance for round-off, as a fraction of the velocities. The allowance is far above the round-off of the speed of a
contact, which is a sum of twelve products."""
_ROWS, _F1, _F, _I = types.int32[::1], types.float64[::1], types.float64, types.int64


@njit(types.void(LOADED, CONTACTS, NODES, _I, _I), cache=True, error_model="numpy")
def fill(loaded, contacts, active, first, end):  # type: ignore[no-untyped-def]
    """Writes the data of the loaded contacts from ``first`` to ``end``, with zero impulses. On entry ``loaded.row`` has
    the numbers of the contacts; on return it has the rows of the contacts.

    The row norms are bounds of the l1 norms along the normal and across it, 1/kg; infinite if all nodes are held.
    """
    slots, weights, normals, fixed, sums = (
        contacts.slots, contacts.weights, contacts.normals, active.fixed, active.row_weights,
    )  # fmt: skip
    normal, tangent = loaded.normal, loaded.tangent
    for q in range(first, end):
        c = loaded.row[q]
        p, two = contacts.row[c], slots[c, 2] < 0
        loaded.row[q] = p
        for k in range(4):
            tangent[q, k], loaded.slots[q, k] = _ACROSS[k] if two else weights[p, k], slots[c, k]
        for i in range(3):
            normal[q, i], tangent[q, PUSH_T + i] = normals[p, i], 0.0
        along, across = 0.0, 0.0
        for k in range(2 if two else 4):
            s, weight, most = slots[c, k], abs(tangent[q, k]) / SHARES, 0.0
            for i in range(3):
                along += weight * abs(normal[q, i]) * sums[s, i] * fixed[s, MOBILITY + i]
                most = max(most, fixed[s, MOBILITY + i])
            across += weight * sums[s, 3] * most
        normal[q, WANTED], normal[q, PUSH], normal[q, MU] = contacts.wanted[p], 0.0, contacts.friction[p]
        normal[q, LAST] = 0.0
        normal[q, ROW_NORM] = along if along > 0.0 else np.inf
        tangent[q, ROW_NORM_T] = across if across > 0.0 else np.inf


@njit(_I(_ROWS, CONTACTS, _F1, _I, _I), cache=True)
def _due(due, contacts, path, first, end):  # type: ignore[no-untyped-def]
    """Finds the contacts from ``first`` to ``end`` whose nodes have changed their velocities at least as much as the
    reach of the contact. ``path`` (slots,): sum of the velocity changes of each slot. Returns the number of the
    contacts that were found.

    Every sweep tests all contacts, and few of them pass the test. A test takes 1 ns; with signed slot numbers it would
    take 2 ns.
    """
    slots, reach, n = contacts.slots, contacts.reach, 0
    for q in range(first, end):
        paths = path[np.uint32(slots[q, 0])] + path[np.uint32(slots[q, 1])]
        if slots[q, 2] >= 0:
            paths = paths + path[np.uint32(slots[q, 2])] + path[np.uint32(slots[q, 3])]
        if paths >= reach[q]:
            due[n] = q
            n += 1
    return n


@njit(
    "float64(float64[:, ::1], float64[:, ::1], int64, float64[:, ::1], int64, int64, int64, int64, int64, boolean)",
    cache=True, forceinline=True,
)  # fmt: skip
def normal_speed(normals, weights, p, v, column, a, b, c, d, two):  # type: ignore[no-untyped-def]
    """Returns n . sum(w_k v_k) of contact ``p``, m/s. The nodes are a and b if ``two``, else a, b, c and d. The
    velocities are columns of ``v`` from ``column`` on.
    """
    speed = 0.0
    for i in range(column, column + 3):
        if two:
            rate = 0.0 + v[a, i] - v[b, i]
        else:
            rate = 0.0 + weights[p, 0] * v[a, i] + weights[p, 1] * v[b, i]
            rate = rate + weights[p, 2] * v[c, i] + weights[p, 3] * v[d, i]
        speed += normals[p, i - column] * rate
    return speed


@njit(types.void(LOADED, CONTACTS, NODES, _F, _I), cache=True, error_model="numpy")
def load(loaded, contacts, active, fastest, k):  # type: ignore[no-untyped-def]
    """Adds the idle contacts of set ``k`` that close faster than allowed to the loaded contacts.

    The speed of a contact changes by at most the paths of its nodes times its largest weight w. Therefore its reach is
    (speed - wanted) / max |w|, less an allowance for round-off. ``fastest``: bound of the l1 norm of any velocity at
    the start of the step, m/s.
    """
    slots, weights, normals, wanted = contacts.slots, contacts.weights, contacts.normals, contacts.wanted
    moving, path, reach, first, end = active.moving, active.path, contacts.reach, loaded.begin[k], loaded.begin[k + 1]
    before = first + loaded.many[k]
    row = loaded.row[before:]
    n = 0
    for q in range(_due(row, contacts, path, first, end)):
        each = row[q]
        a, b, c, d = slots[each, 0], slots[each, 1], slots[each, 2], slots[each, 3]
        p, most, paths, two = contacts.row[each], 1.0, path[a] + path[b], c < 0
        speed = normal_speed(normals, weights, p, moving, V, a, b, c, d, two)
        if wanted[p] > speed:
            row[n], reach[each] = each, np.inf
            n += 1
            continue
        if not two:
            paths = paths + path[c] + path[d]
            for j in range(4):
                most = max(most, abs(weights[p, j]))
        left = (speed - wanted[p]) / most
        reach[each] = paths + left - _ROUNDING * (fastest + paths + left + abs(wanted[p]))
    fill(loaded, contacts, active, before, before + n)
    loaded.many[k] += n


@njit(types.void(LOADED, CONTACTS, NODES, KEPT, _I), cache=True)
def load_kept(loaded, contacts, active, kept, k):  # type: ignore[no-untyped-def]
    """Adds those contacts of set ``k`` that have a stored impulse (``kept``) of the last step to the loaded contacts.
    On entry all contacts of the set are idle.
    """
    pair, pairs, cracks, first = contacts.pair, kept.pairs, kept.cracks, loaded.begin[k]
    n = first
    for each in range(first, loaded.begin[k + 1]):
        j = pair[contacts.row[each]]
        if (j >= 0 and pairs[j, 0] > 0.0) or (j <= CRACK and cracks[CRACK - j, 0] > 0.0):
            loaded.row[n], contacts.reach[each] = each, np.inf
            n += 1
    fill(loaded, contacts, active, first, n)
    loaded.many[k] = n - first
