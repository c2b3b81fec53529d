"""Between the nodes of a rank, those of the crowd, and the slots of the active set.

``held`` (h,) places in the crowd and ``local`` (h,) indices on the rank of the same nodes. ``places`` (slots,) where
the nodes of the active set stand in the crowd, and ``index`` (crowd,) what each of the crowd is on the rank, -1 for a
copy.
"""

import numpy as np

from ..jit import njit, prefetch, several, types
from .active import CHANGED, IMPULSE, MOBILITY, NODES, TOTAL, V

_NAMED = -2
"""Of a node that a contact has and that has no slot yet."""
_SMALL = 16
"""Bits of an impulse that do not count in what is unsettled: 2^-30 of the largest (fixed_point.py), so that the sum
over 2^28 nodes fits."""
_AHEAD = 16
"""How many nodes ahead is brought near what is gathered from the rank's own."""
_I2, _N1, _N2 = types.int64[:, ::1], types.int32[::1], types.int32[:, ::1]
_F1, _F2, _F, _I, _I1, _B1 = (
    types.float64[::1], types.float64[:, ::1], types.float64, types.int64, types.int64[::1], types.boolean[::1],
)  # fmt: skip


@njit("void(float64[:, ::1], float64[:, ::1], int32[::1], int32[::1])", cache=True)
def gather(out, v, held, local):  # type: ignore[no-untyped-def]
    """Velocities of the held nodes."""
    for h in range(len(local)):
        prefetch(v, 3 * local[min(h + _AHEAD, len(local) - 1)])
        for i in range(3):
            out[held[h], i] = v[local[h], i]


@njit("void(float64[:, ::1], float64[:, ::1], int32[::1], float64[:, ::1], float64[:, ::1], int32[::1])", cache=True)
def take(x, v, held, node_x, node_v, local):  # type: ignore[no-untyped-def]
    """Positions and velocities of the held nodes of a crowd."""
    for h in range(len(held)):
        near = 3 * local[min(h + _AHEAD, len(held) - 1)]
        prefetch(node_x, near)
        prefetch(node_v, near)
        for i in range(3):
            x[held[h], i], v[held[h], i] = node_x[local[h], i], node_v[local[h], i]


@njit(_I(_N1, _N1, _N1), cache=True)
def number_shared(places, slot, shared):  # type: ignore[no-untyped-def]
    """The first slots: one for each place of ``shared``, where one may stand several times. Returns how many."""
    m = 0
    for a in shared:
        if slot[a] < 0:
            slot[a], places[m] = m, a
            m += 1
    return m


@njit(several(_I, _I)(_N2, _F1, _N1, _N1, _N2, _N2, _I, _I), cache=True)
def number(slots, reach, places, slot, rows, nodes, n, shared):  # type: ignore[no-untyped-def]
    """Numbers the nodes (room, 4) of ``n`` contacts, in the order of the crowd, behind the ``shared`` slots.

    ``slots`` (room, 4): the third is -1 in the row of a crack, whose second node stands there three times; ``reach``
    (room,): -1, no contact is known to be idle; ``places`` (slots,) and its inverse ``slot`` (crowd,); ``rows`` (2,
    room): the contacts with a shared slot, and those without. Returns the number of slots, and of the first of them.
    """
    m, border, inner = shared, 0, 0
    for p in range(n):
        for k in range(2 if nodes[p, 1] == nodes[p, 2] else 4):
            if slot[nodes[p, k]] < 0:
                slot[nodes[p, k]] = _NAMED
    for a in range(len(slot)):
        if slot[a] == _NAMED:
            slot[a], places[m] = m, a
            m += 1
    for p in range(n):
        two = nodes[p, 1] == nodes[p, 2]
        least, reach[p] = m, -1.0
        for k in range(2 if two else 4):
            slots[p, k] = slot[nodes[p, k]]
            least = min(least, slots[p, k])
        if two:
            slots[p, 2], slots[p, 3] = -1, -1
        if least < shared:
            rows[0, border] = p
            border += 1
        else:
            rows[1, inner] = p
            inner += 1
    return m, border


@njit(_F(NODES, _N1, _F2, _F2), cache=True)
def load(active, places, v, mobility):  # type: ignore[no-untyped-def]
    """Takes velocities and mobilities (crowd, 3) to the slots, all without an impulse. Returns the largest l1 norm of a
    velocity, m/s.
    """
    moving, words, fixed, total, sums = (
        active.moving, active.moving_words, active.fixed, active.fixed_words, active.row_weights,
    )  # fmt: skip
    fastest = 0.0
    for s in range(len(places)):
        a = places[s]
        fastest = max(fastest, abs(v[a, 0]) + abs(v[a, 1]) + abs(v[a, 2]))
        for i in range(3):
            moving[s, V + i], fixed[s, MOBILITY + i] = v[a, i], mobility[a, i]
            words[s, IMPULSE + i] = total[s, TOTAL + i] = sums[s, i] = 0
        sums[s, 3], total[s, CHANGED], active.path[s] = 0, 0, 0.0
    return fastest


@njit(types.boolean(_F2, _I2, _I1, _I2, _N1, NODES, _N1, _N1, _N1, _B1), cache=True)
def leave(node_v, parts, unsettled, total, slot, active, places, index, part, owned):  # type: ignore[no-untyped-def]
    """Velocities to the nodes that this rank holds, impulses of the step to ``total`` (crowd, 3), and those of owned
    nodes to the sums of their parts and to what is ``unsettled`` (2,) of them, see need.py; no node has a slot any
    more. Whether any held node was pushed.
    """
    moving, words = active.moving, active.fixed_words
    pushed = False
    for s in range(len(places)):
        a = places[s]
        h = index[a]
        slot[a] = -1
        size = np.int64(0)
        for i in range(3):
            j = words[s, TOTAL + i]
            size += abs(j)
            total[a, i] = j
            if h >= 0:
                node_v[h, i] = moving[s, V + i]
                pushed |= j != 0
                if owned[h]:
                    parts[part[h], i] += j
        if h >= 0 and owned[h]:
            unsettled[0] += words[s, CHANGED] >> _SMALL
            unsettled[1] += size >> _SMALL
    return pushed
