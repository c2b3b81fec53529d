"""Work of the contact impulses of a step, computed for the normal impulses, for friction, and for the supports of held
nodes.
"""

import numpy as np

from ...kernels.jit import njit, types
from .active import LOADED, MU, NODES, PUSH, PUSH_T, V

_I2, _N1 = types.int64[:, ::1], types.int32[::1]
_F1, _F2, _F, _I = types.float64[::1], types.float64[:, ::1], types.float64, types.int64


@njit(types.void(_I2, LOADED, NODES, _F2, _N1, _F, _I), cache=True)
def cost(words, loaded, active, before, places, joule, k):  # type: ignore[no-untyped-def]
    """Adds two energies to ``words``: the energy that the normal impulses of set ``k`` take from the bodies, and the
    energy that the first half of the impulses returns to the bodies. The rows of ``words`` are two limbs, in quanta of
    1 / ``joule`` J.

    An impulse J that changes the normal speed from u(n-1/2) to u(n+1/2) takes the energy -J (u(n-1/2) + u(n+1/2)) / 2.
    The energy ledger at time n contains the first half of the energy of an impulse. ``before`` (surface_nodes, 3):
    velocities v(n-1/2); ``places``: rows of the slots.
    """
    values, normal, tangent, slots = active.moving, loaded.normal, loaded.tangent, loaded.slots
    value = np.empty(2)
    for q in range(loaded.begin[k], loaded.begin[k] + loaded.many[k]):
        push = normal[q, PUSH]
        if push > 0.0:
            early, late = 0.0, 0.0
            for j in range(2 if slots[q, 2] < 0 else 4):
                s = slots[q, j]
                for i in range(3):
                    share = tangent[q, j] * normal[q, i]
                    early += share * before[places[s], i]
                    late += share * values[s, V + i]
            value[0] = -0.5 * push * (early + late)
            value[1] = 0.5 * push * early
            for m in range(2):
                high = np.rint(value[m] * joule)
                words[0, m] += np.int64(high)
                words[1, m] += np.int64(np.rint((value[m] * joule - high) * 2.0**30))


@njit(types.void(_I2, LOADED, NODES, _F2, _N1, _F, _I), cache=True)
def heat(words, loaded, active, before, places, joule, k):  # type: ignore[no-untyped-def]
    """Adds two energies to ``words``: the work of friction of set ``k``, which is mean sliding velocity times impulse;
    and the half of this work that is computed with v(n+1/2), which the energy ledger at time n does not contain. The
    rows of ``words`` are two limbs, in quanta of 1 / ``joule`` J.
    """
    values, normal, tangent, slots = active.moving, loaded.normal, loaded.tangent, loaded.slots
    value = np.empty(2)
    for q in range(loaded.begin[k], loaded.begin[k] + loaded.many[k]):
        if normal[q, MU] > 0.0 and normal[q, PUSH] > 0.0:
            early, late, many = 0.0, 0.0, 2 if slots[q, 2] < 0 else 4
            for i in range(3):
                push = tangent[q, PUSH_T + i]
                for j in range(many):
                    early += push * tangent[q, j] * before[places[slots[q, j]], i]
                    late += push * tangent[q, j] * values[slots[q, j], V + i]
            value[0] = -0.5 * (early + late)
            value[1] = -0.5 * late
            for m in range(2):
                high = np.rint(value[m] * joule)
                words[0, m] += np.int64(high)
                words[1, m] += np.int64(np.rint((value[m] * joule - high) * 2.0**30))


@njit(types.void(types.int64[:, :, ::1], LOADED, _N1, _N1, _F, _I), cache=True)
def between(words, loaded, places, part, scale, k):  # type: ignore[no-untyped-def]
    """Adds the impulses of the contacts of set ``k`` between two parts to ``words`` (parts, parts, 3), in quanta of 1 /
    ``scale`` N s; the two parts get opposite signs. ``part`` (surface_nodes,): part of each node; ``places``: rows of
    the slots.
    """
    normal, tangent, slots = loaded.normal, loaded.tangent, loaded.slots
    for q in range(loaded.begin[k], loaded.begin[k] + loaded.many[k]):
        many, one = 2 if slots[q, 2] < 0 else 4, part[places[slots[q, 0]]]
        other, share = one, 0.0
        for j in range(many):
            each = part[places[slots[q, j]]]
            if each == one:
                share += tangent[q, j]
            else:
                other = each
        if other == one:
            continue
        for i in range(3):
            given = np.int64(np.rint(share * (normal[q, PUSH] * normal[q, i] + tangent[q, PUSH_T + i]) * scale))
            words[one, other, i] += given
            words[other, one, i] -= given


@njit(types.void(_F1, _F1, _N1, _N1, _F2, _I2, _F2, _F, _I, _I), cache=True)
def book(loss, external, places, index, before, total, mobility, scale, first, stop):  # type: ignore[no-untyped-def]
    """Adds half of impulse times velocity, at the ``places`` from ``first`` to ``stop``, to the energy lost by contact.
    If a velocity is held, the work is added to the external work. ``index``: see slot_numbers.py.
    """
    for s in range(first, stop):
        a = places[s]
        h = index[a]
        if h >= 0:
            for i in range(3):
                work = 0.5 * before[a, i] * (total[a, i] / scale)
                loss[h] -= work
                if mobility[a, i] == 0.0:
                    external[h] -= work
