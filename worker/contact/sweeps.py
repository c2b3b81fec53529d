"""Impulses that keep active contacts from passing: projected Jacobi sweeps whose order does not matter.

Every contact asks for a normal velocity of at least ``wanted``. A sweep corrects each by its own want over a bound of
the l1 norm of its row of the contact matrix (Baker, Falgout, Kolev and Yang 2011): the sum over its nodes k and axes i
of |w_k| |n_i| S_ki / m_k, with S_ki the sum of |w| |n_i| over all contacts at the node. That is exact for one contact
alone and for any number along one normal, and never an overshoot however many share a node. That bound is far from
the diagonal where many share a node, and plain sweeps crawl: so every impulse along a normal goes on as it has changed,
by a share that grows with the sweeps (``momentum``). Impulses never pull; friction is Coulomb's, on the sum over the
sweeps. Impulses are integers: a contact's add up to zero, and no order of contacts or ranks changes a bit. A pair of a
node and a face, and nodes across a crack, begin with their impulses of the step before: what sticks does not creep, and
what is under pressure does not sink in, however few the sweeps are.

A contact that has had no impulse in the step and closes no faster than it may is idle: it changes nothing until sweeps
have moved its nodes by as much as it has left. The others are loaded: their data lie together, and only they are swept.

Kernels call no kernel within a loop over contacts: records of arrays are counted as references at each call.
"""

import numpy as np

from ..jit import njit, types
from .active import (
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
)  # fmt: skip
from .narrow_phase import CRACK
from .need import measure
from .stops import BRACED, stop

SHARES = float(2**30)
"""Quanta per unit of weight."""
_PAIR, _CRACK = 0.8, 1.0
"""Share of the last push along the normal that a node and a face begin with, for all of it would lag behind and make
energy; and nodes across a crack, of which so many press on each other that sweeps cannot make up for any of it
(docs/numerics.md, "Dust under pressure")."""
_ACROSS = (1.0, -1.0, 0.0, 0.0)
"""Weights of the nodes on either side of a crack."""
_ROUNDING = 2.0**-40
"""Of the velocities: far more than what a contact's speed, a sum of twelve products, may be off by."""

_ROWS, _F2, _F, _I = types.int32[::1], types.float64[:, ::1], types.float64, types.int64


@njit(types.void(NODES, CONTACTS, _ROWS), cache=True)
def add_row_weights(active, contacts, some):  # type: ignore[no-untyped-def]
    """Adds |w| |n_i| and |w| of ``some`` contacts to the row weights of their nodes, in quanta."""
    sums, slots, weights, normals = active.row_weights, contacts.slots, contacts.weights, contacts.normals
    for p in some:
        two = slots[p, 2] < 0
        for k in range(2 if two else 4):
            a, weight = slots[p, k], SHARES if two else abs(weights[p, k]) * SHARES
            for i in range(3):
                sums[a, i] += np.int64(np.rint(weight * abs(normals[p, i])))
            sums[a, 3] += np.int64(np.rint(weight))


@njit(types.void(LOADED, CONTACTS, NODES, _I, _I), cache=True, error_model="numpy")
def fill(loaded, contacts, active, first, end):  # type: ignore[no-untyped-def]
    """The data of the loaded contacts from ``first`` to ``end``, whose rows are known; none has an impulse yet.

    Row norms are bounds of l1 norms along the normal and across, 1/kg; infinite where nothing moves.
    """
    slots, weights, normals, fixed, sums = (
        contacts.slots, contacts.weights, contacts.normals, active.fixed, active.row_weights,
    )  # fmt: skip
    normal, tangent = loaded.normal, loaded.tangent
    for q in range(first, end):
        p = loaded.row[q]
        two = slots[p, 2] < 0
        for k in range(4):
            tangent[q, k], loaded.slots[q, k] = _ACROSS[k] if two else weights[p, k], slots[p, k]
        for i in range(3):
            normal[q, i], tangent[q, PUSH_T + i] = normals[p, i], 0.0
        along, across = 0.0, 0.0
        for k in range(2 if two else 4):
            s, weight, most = slots[p, k], abs(tangent[q, k]) / SHARES, 0.0
            for i in range(3):
                along += weight * abs(normal[q, i]) * sums[s, i] * fixed[s, MOBILITY + i]
                most = max(most, fixed[s, MOBILITY + i])
            across += weight * sums[s, 3] * most
        normal[q, WANTED], normal[q, PUSH], normal[q, MU] = contacts.wanted[p], 0.0, contacts.friction[p]
        normal[q, LAST] = 0.0
        normal[q, ROW_NORM] = along if along > 0.0 else np.inf
        tangent[q, ROW_NORM_T] = across if across > 0.0 else np.inf


@njit(types.void(LOADED, CONTACTS, NODES, _F), cache=True, error_model="numpy")
def load(loaded, contacts, active, fastest):  # type: ignore[no-untyped-def]
    """Takes those of the idle contacts among the loaded that close faster than they may.

    The speed of a contact changes by no more than the paths of its nodes times the largest of its weights; an idle one
    is computed anew when they may have used up what it had left. ``fastest``: bound of the l1 norm of any velocity at
    the beginning of the step, m/s.
    """
    slots, weights, normals, wanted = contacts.slots, contacts.weights, contacts.normals, contacts.wanted
    moving, path, reach, idle, count = active.moving, active.path, contacts.reach, loaded.idle, loaded.many
    n, m, row = count[0], 0, loaded.row
    for q in range(count[1]):
        p = idle[q]
        a, b, c, d = slots[p, 0], slots[p, 1], slots[p, 2], slots[p, 3]
        paths = path[a] + path[b] if c < 0 else path[a] + path[b] + path[c] + path[d]
        asks = False
        if paths >= reach[p]:
            speed, most = 0.0, 1.0
            for i in range(3):
                if c < 0:
                    rate = 0.0 + moving[a, V + i] - moving[b, V + i]
                else:
                    rate = 0.0 + weights[p, 0] * moving[a, V + i] + weights[p, 1] * moving[b, V + i]
                    rate = rate + weights[p, 2] * moving[c, V + i] + weights[p, 3] * moving[d, V + i]
                speed += normals[p, i] * rate
            asks = wanted[p] > speed
            if c >= 0:
                for k in range(4):
                    most = max(most, abs(weights[p, k]))
            left = (speed - wanted[p]) / most
            reach[p] = paths + left - _ROUNDING * (fastest + paths + left + abs(wanted[p]))
        row[n], idle[m] = p, p
        n += asks
        m += not asks
    fill(loaded, contacts, active, count[0], n)
    count[0], count[1] = n, m


@njit(types.void(LOADED, CONTACTS, NODES, KEPT), cache=True)
def load_kept(loaded, contacts, active, kept):  # type: ignore[no-untyped-def]
    """Takes those of the idle contacts among the loaded that have ``kept`` an impulse of the step before."""
    pair, idle, count, pairs, cracks = contacts.pair, loaded.idle, loaded.many, kept.pairs, kept.cracks
    n, m = 0, 0
    for q in range(count[1]):
        p = idle[q]
        k = pair[p]
        if (k >= 0 and pairs[k, 0] > 0.0) or (k <= CRACK and cracks[CRACK - k, 0] > 0.0):
            loaded.row[n] = p
            n += 1
        else:
            idle[m] = p
            m += 1
    fill(loaded, contacts, active, 0, n)
    count[0], count[1] = n, m


@njit(types.void(NODES, LOADED, KEPT, _ROWS, _F, _F), cache=True)
def resume(active, loaded, kept, pair, ratio, scale):  # type: ignore[no-untyped-def]
    """The loaded contacts begin with ``ratio`` times what they have ``kept``, along and across the normal as it is now:
    over the row norms as they are now, so that a node that has separated, and is lighter, or that shares its load with
    others begins with less.
    """
    words, normal, tangent, slots, row = active.moving_words, loaded.normal, loaded.tangent, loaded.slots, loaded.row
    pairs, cracks, last = kept.pairs, kept.cracks, np.empty(4)
    for q in range(loaded.many[0]):
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
            for k in range(1, 4 if p >= 0 else 2):
                part = np.int64(np.rint(tangent[q, k] * change * scale))
                words[slots[q, k], IMPULSE + i] += part
                rest += part
            words[slots[q, 0], IMPULSE + i] -= rest


@njit(types.float64(_I, _I), cache=True)
def momentum(k, many):  # type: ignore[no-untyped-def]
    """How far impulses go on in sweep ``k`` of ``many`` as they have changed (Nesterov 1983; Mazhar, Heyn, Negrut and
    Tasora 2015 for contact); not at all in the last, which ends with impulses that a plain sweep has made.
    """
    return k / (k + 3.0) if k + 1 < many else 0.0


@njit(types.void(NODES, LOADED, _F, _F), cache=True, error_model="numpy")
def sweep(active, loaded, ahead, scale):  # type: ignore[no-untyped-def]
    """Adds the corrections of the loaded contacts to the impulses of their nodes; they add up to zero. ``ahead``: of
    what an impulse along the normal has changed by since the last sweep, how much it goes on.
    """
    values, words = active.moving, active.moving_words
    normal, tangent, slots = loaded.normal, loaded.tangent, loaded.slots
    rate, change = np.empty(3), np.empty(3)
    for q in range(loaded.many[0]):
        a, b, c, d = slots[q, 0], slots[q, 1], slots[q, 2], slots[q, 3]
        speed = 0.0
        for i in range(3):
            if c < 0:
                rate[i] = 0.0 + values[a, V + i] - values[b, V + i]
            else:
                rate[i] = 0.0 + tangent[q, 0] * values[a, V + i] + tangent[q, 1] * values[b, V + i]
                rate[i] = rate[i] + tangent[q, 2] * values[c, V + i] + tangent[q, 3] * values[d, V + i]
            speed += normal[q, i] * rate[i]
        old, mu = normal[q, PUSH], normal[q, MU]
        least = max(0.0, old + (normal[q, WANTED] - speed) / normal[q, ROW_NORM])
        push = max(0.0, least + ahead * (least - normal[q, LAST]))
        normal[q, LAST] = least
        if push == old and (old == 0.0 or mu == 0.0):
            continue
        normal[q, PUSH] = push
        for i in range(3):
            change[i] = (push - old) * normal[q, i]
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


@njit(types.void(NODES, _I, _F), cache=True)
def give(active, n, scale):  # type: ignore[no-untyped-def]
    """Turns the completed impulses of a sweep at ``n`` slots into velocities, adds them to those of the step and clears
    them.
    """
    v, words, mobility, total, path = (
        active.moving, active.moving_words, active.fixed, active.fixed_words, active.path,
    )  # fmt: skip
    for s in range(n):
        if words[s, IMPULSE] | words[s, IMPULSE + 1] | words[s, IMPULSE + 2]:
            length = 0.0
            for i in range(3):
                j = words[s, IMPULSE + i]
                change = j * (mobility[s, MOBILITY + i] / scale)
                length += abs(change)
                v[s, V + i] += change
                total[s, TOTAL + i] += j
                words[s, IMPULSE + i] = 0
            path[s] += length


@njit(types.void(NODES, LOADED, CONTACTS, _F, _F, _F), cache=True)
def correct(active, loaded, contacts, fastest, ahead, scale):  # type: ignore[no-untyped-def]
    """``load`` and ``sweep``."""
    load(loaded, contacts, active, fastest)
    sweep(active, loaded, ahead, scale)


@njit(types.void(NODES, LOADED, CONTACTS, BRACED, _F, _I, _F, _I), cache=True)
def sweep_all(active, loaded, contacts, braced, fastest, n, scale, many):  # type: ignore[no-untyped-def]
    """``many`` sweeps (``correct``, ``give``, ``stop``) of contacts of which no other rank shares a node."""
    for k in range(many):
        correct(active, loaded, contacts, fastest, momentum(k, many), scale)
        if k + 1 == many:
            measure(active, n)
        give(active, n, scale)
        stop(active, braced)


@njit(types.void(KEPT, LOADED, _ROWS), cache=True)
def store(kept, loaded, pair):  # type: ignore[no-untyped-def]
    """What loaded contacts have ``kept``: their impulses times their row norms."""
    pairs, cracks, normal, tangent, row = kept.pairs, kept.cracks, loaded.normal, loaded.tangent, loaded.row
    last = np.empty(4)
    for q in range(loaded.many[0]):
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
