"""Impulses of active contacts: projected Jacobi sweeps, independent of the order of contacts (docs/theory/contact.md).

Every contact has a target for its normal velocity u: u >= ``wanted``. A sweep corrects the impulse of a contact by
(wanted - u) / bound. The value ``bound`` is an upper bound of the l1 norm of the contact's row of the contact matrix
(Baker, Falgout, Kolev and Yang 2011): the sum over its nodes k and axes i of |w_k| |n_i| S_ki / m_k. Here w_k is the
weight of node k, m_k its mass, n the normal, and S_ki the sum of |w| |n_i| over all contacts at the node. The
correction is exact for a single contact and for any number of contacts along one normal, and never overshoots when
contacts share nodes. If many contacts share a node, the bound is far above the diagonal of the matrix, and plain sweeps
converge slowly. Therefore normal impulses are extrapolated by Nesterov's ``momentum``; normal impulses are never
negative. Friction is Coulomb friction and is limited by the normal impulse summed over the sweeps. Impulses are
integers: the impulses of a contact add up to zero, and the result does not depend on the order of contacts or ranks.
Node-face pairs and node pairs across a crack start from their impulses of the last step (warm start). With the warm
start, for any number of sweeps, sticking contacts do not creep and the penetration of compressed contacts does not
increase.

The sweeps include only contacts that have needed an impulse in this step (loading.py).

Kernels call no kernel within a loop over contacts, because numba counts a reference for each array of a record at each
call.
"""

import numpy as np

from ...kernels.jit import njit, types
from ..narrow_phase.tables import CRACK
from .active import (  # fmt: skip
    CHANGED,
    CONTACTS,
    IMPULSE,
    KEPT,
    LAST,
    LOADED,
    MOBILITY,
    MU,
    NODES,
    PUSH,
    PUSH_T,
    ROW_NORM,
    ROW_NORM_T,
    TOTAL,
    WANTED,
    V,
)
from .loading import SHARES

_PAIR, _CRACK = 0.8, 1.0
"""Fractions of the stored normal impulse that the warm start applies: for node-face pairs, and for node pairs across a
crack. For node-face pairs the whole impulse would add energy, because it is out of date by one step. Node pairs across
a crack get a larger fraction, because so many of them press on each other that the sweeps could not restore a missing
part (docs/theory/contact.md, "Dust under pressure")."""

_ROWS, _F, _I = types.int32[::1], types.float64, types.int64


@njit(types.void(NODES, CONTACTS, LOADED, _I), cache=True)
def add_row_weights(active, contacts, loaded, k):  # type: ignore[no-untyped-def]
    """Adds |w| |n_i| and |w| of the contacts of set ``k`` to the row weights of the nodes of these contacts, in
    quanta.
    """
    sums, slots, weights, normals = active.row_weights, contacts.slots, contacts.weights, contacts.normals
    for q in range(loaded.begin[k], loaded.begin[k + 1]):
        p, two = contacts.row[q], slots[q, 2] < 0
        for m in range(2 if two else 4):
            a, weight = slots[q, m], SHARES if two else abs(weights[p, m]) * SHARES
            for i in range(3):
                sums[a, i] += np.int64(np.rint(weight * abs(normals[p, i])))
            sums[a, 3] += np.int64(np.rint(weight))


@njit(types.void(NODES, LOADED, KEPT, _ROWS, _F, _F, _I), cache=True)
def resume(active, loaded, kept, pair, ratio, scale, k):  # type: ignore[no-untyped-def]
    """Warm start of the loaded contacts of set ``k``. The start value is ``ratio`` times the stored values ``kept``,
    along the present normal and across it, divided by the present row norms. The row norms reduce the start value of a
    node that has lost mass by separation, or that shares its load with new contacts.
    """
    words, normal, tangent, slots, row = active.moving_words, loaded.normal, loaded.tangent, loaded.slots, loaded.row
    pairs, cracks, last = kept.pairs, kept.cracks, np.empty(4)
    for q in range(loaded.begin[k], loaded.begin[k] + loaded.many[k]):
        p, along = pair[row[q]], 0.0
        for i in range(4):
            last[i] = pairs[p, i] if p >= 0 else cracks[CRACK - p, i]
        for i in range(3):
            along += last[1 + i] * normal[q, i]
        normal[q, PUSH] = normal[q, LAST] = (_PAIR if p >= 0 else _CRACK) * ratio * last[0] / normal[q, ROW_NORM]
        for i in range(3):
            tangent[q, PUSH_T + i] = ratio * (last[1 + i] - along * normal[q, i]) / tangent[q, ROW_NORM_T]
            change = normal[q, PUSH] * normal[q, i] + tangent[q, PUSH_T + i]
            rest = np.int64(0)
            for j in range(1, 4 if p >= 0 else 2):
                part = np.int64(np.rint(tangent[q, j] * change * scale))
                words[slots[q, j], IMPULSE + i] += part
                rest += part
            words[slots[q, 0], IMPULSE + i] -= rest


@njit(types.float64(_I, _I), cache=True)
def momentum(k, many):  # type: ignore[no-untyped-def]
    """Nesterov's factor for sweep ``k`` of ``many`` (Nesterov 1983; Mazhar, Heyn, Negrut and Tasora 2015 for contact).
    The factor is 0 in the last sweep, so the last sweep is a plain sweep.
    """
    return k / (k + 3.0) if k + 1 < many else 0.0


@njit(types.void(NODES, LOADED, _F, _F, _I), cache=True, error_model="numpy")
def sweep(active, loaded, ahead, scale, k):  # type: ignore[no-untyped-def]
    """Adds the corrections of the loaded contacts of set ``k`` to the impulses of the nodes. The corrections of one
    contact add up to zero. ``ahead``: Nesterov's factor. The row norms R and R_t are explained in
    docs/theory/contact.md, "Several contacts of a node".
    """
    values, words = active.moving, active.moving_words
    first = loaded.begin[k]
    normal, tangent, slots = loaded.normal[first:], loaded.tangent[first:], loaded.slots[first:]
    rate, change = np.empty(3), np.empty(3)
    for q in range(loaded.many[k]):
        a, b, c, d = slots[q, 0], slots[q, 1], slots[q, 2], slots[q, 3]
        # 1. Compute the relative velocity rate = sum(w_k v_k) and its normal component u = n . rate.
        speed = 0.0
        for i in range(3):
            if c < 0:
                rate[i] = 0.0 + values[a, V + i] - values[b, V + i]
            else:
                rate[i] = 0.0 + tangent[q, 0] * values[a, V + i] + tangent[q, 1] * values[b, V + i]
                rate[i] = rate[i] + tangent[q, 2] * values[c, V + i] + tangent[q, 3] * values[d, V + i]
            speed += normal[q, i] * rate[i]
        old, mu = normal[q, PUSH], normal[q, MU]
        # 2. Compute the normal impulse p = max(0, p_old + (wanted - u) / R), extrapolated by ahead (p - p_last).
        least = max(0.0, old + (normal[q, WANTED] - speed) / normal[q, ROW_NORM])
        push = max(0.0, least + ahead * (least - normal[q, LAST]))
        normal[q, LAST] = least
        if push == old and (old == 0.0 or mu == 0.0):
            continue
        normal[q, PUSH] = push
        for i in range(3):
            change[i] = (push - old) * normal[q, i]
        # 3. Compute the friction impulse t = t_old - (rate - u n) / R_t, scaled back to |t| <= mu p.
        if mu > 0.0:
            size = 0.0
            for i in range(3):
                rate[i] = tangent[q, PUSH_T + i] - (rate[i] - speed * normal[q, i]) / tangent[q, ROW_NORM_T]
                size += rate[i] * rate[i]
            most = mu * push
            factor = most / np.sqrt(size) if size > most * most else 1.0
            for i in range(3):
                change[i] += factor * rate[i] - tangent[q, PUSH_T + i]
                tangent[q, PUSH_T + i] = factor * rate[i]
        # 4. Add w_k (dp n + dt) to node k, in quanta. Add minus the sum of the others to the first node.
        for i in range(3):
            if c < 0:
                rest = np.int64(np.rint(-change[i] * scale))
            else:
                rest = np.int64(np.rint(tangent[q, 1] * change[i] * scale))
                part = np.int64(np.rint(tangent[q, 2] * change[i] * scale))
                last = np.int64(np.rint(tangent[q, 3] * change[i] * scale))
                words[c, IMPULSE + i] += part
                words[d, IMPULSE + i] += last
            words[b, IMPULSE + i] += rest
            if c >= 0:
                rest += part + last
            words[a, IMPULSE + i] -= rest


@njit(types.void(NODES, _F, types.boolean, _I, _I), cache=True)
def give(active, scale, last, first, stop):  # type: ignore[no-untyped-def]
    """Converts the completed impulses of a sweep at the slots from ``first`` to ``stop`` into velocity changes dv = j /
    m. Adds the impulses to the impulses of the step, and sets the impulses of the sweep to zero. In the ``last`` sweep
    of a step, stores the l1 norm of the impulses.
    """
    v, words, path = active.moving[first:stop], active.moving_words[first:stop], active.path[first:stop]
    mobility, total, a_quantum = active.fixed[first:stop], active.fixed_words[first:stop], 1.0 / scale
    if last:
        for s in range(stop - first):
            total[s, CHANGED] = abs(words[s, IMPULSE]) + abs(words[s, IMPULSE + 1]) + abs(words[s, IMPULSE + 2])
    for s in range(stop - first):
        if words[s, IMPULSE] | words[s, IMPULSE + 1] | words[s, IMPULSE + 2]:
            length = 0.0
            for i in range(3):
                j = words[s, IMPULSE + i]
                change = j * (mobility[s, MOBILITY + i] * a_quantum)
                length += abs(change)
                v[s, V + i] += change
                total[s, TOTAL + i] += j
                words[s, IMPULSE + i] = 0
            path[s] += length


@njit(types.void(KEPT, LOADED, _ROWS, _I), cache=True)
def store(kept, loaded, pair, k):  # type: ignore[no-untyped-def]
    """Stores the impulses of the loaded contacts of set ``k`` in ``kept``, multiplied by their row norms."""
    pairs, cracks, normal, tangent, row = kept.pairs, kept.cracks, loaded.normal, loaded.tangent, loaded.row
    last = np.empty(4)
    for q in range(loaded.begin[k], loaded.begin[k] + loaded.many[k]):
        p = pair[row[q]]
        last[0] = normal[q, PUSH] * normal[q, ROW_NORM]
        if not last[0] > 0.0:
            continue
        for i in range(3):
            last[1 + i] = tangent[q, PUSH_T + i] * tangent[q, ROW_NORM_T]
        for i in range(4):
            if p >= 0:
                pairs[p, i] = last[i]
            elif p <= CRACK:
                cracks[CRACK - p, i] = last[i]
