"""Numbering of the nodes of active contacts. The kernels copy data between local nodes, surface nodes of the scene and
slots of the solver.

``held`` (h,): rows of surface nodes; ``local`` (h,): local indices of the same nodes; ``places`` (slots,): rows of the
nodes of active contacts; ``index`` (surface_nodes,): local index of each surface node, -1 for a ghost of a node of
another rank.
"""

import numpy as np

from ...kernels.jit import njit, prefetch, types
from .active import CHANGED, IMPULSE, MOBILITY, NODES, TOTAL, V

_SMALL = 16
"""Number of low bits of an impulse that the residual ignores. The ignored part is below 2^-30 of the largest impulse
(fixed_point.py), so that the sum over 2^28 nodes does not overflow."""
_AHEAD = 16
"""Distance, in nodes, by which kernels prefetch the data of nodes."""
_I2, _N1, _N2, _U1 = types.int64[:, ::1], types.int32[::1], types.int32[:, ::1], types.uint8[::1]
_F1, _F2, _F, _I, _I1, _B1 = (
    types.float64[::1], types.float64[:, ::1], types.float64, types.int64, types.int64[::1], types.boolean[::1],
)  # fmt: skip


@njit(types.void(_F2, _F2, _N1, _F2, _F2, _N1, _I, _I), cache=True)
def take(x, v, held, node_x, node_v, local, first, stop):  # type: ignore[no-untyped-def]
    """Copies positions and velocities of the local nodes ``held`` from ``first`` to ``stop`` to the surface nodes."""
    for h in range(first, stop):
        near = 3 * local[min(h + _AHEAD, len(held) - 1)]
        prefetch(node_x, near)
        prefetch(node_v, near)
        for i in range(3):
            x[held[h], i], v[held[h], i] = node_x[local[h], i], node_v[local[h], i]


@njit(types.void(_U1, _N1, _N2, _N1, _N1, _U1, _I2, _I, _I, _I), cache=True)
def mark(touched, set_of, nodes, found, zone, shared, many, task, first, stop):  # type: ignore[no-untyped-def]
    """Task: writes the number of the set of each contact in ``found[first:stop]`` to ``set_of``; counts the contacts of
    this task in each set, in ``many`` (tasks, sets).

    A contact belongs to the smallest box (zones.py) with all its nodes; ``zone`` (surface_nodes,): zone of each node.
    There are two groups of sets: first the sets of contacts with a ``shared`` (surface_nodes,) node, then the sets of
    contacts without such a node. ``nodes`` (room, 4); ``touched`` (surface_nodes,): set to 1 for all nodes of the
    contacts.
    """
    sets = many.shape[1] // 2
    zones = (sets + 1) // 2
    for q in range(first, stop):
        p = found[q]
        at, border = zones + zone[nodes[p, 0]], False
        for k in range(2 if nodes[p, 1] == nodes[p, 2] else 4):
            a = nodes[p, k]
            touched[a] = 1
            border |= shared[a] != 0
            box = zones + zone[a]
            while box != at:
                if box > at:
                    box >>= 1
                else:
                    at >>= 1
        set_of[q] = (0 if border else sets) + sets - at
        many[task, set_of[q]] += 1


@njit(_I(_I1, _I), cache=True)
def offsets(counts, many):  # type: ignore[no-untyped-def]
    """Replaces each of the first ``many`` counts by the sum of the counts before it. Returns the sum of all counts."""
    n = 0
    for k in range(many):
        counts[k], n = n, n + counts[k]
    return n


@njit(types.void(_I1, _I2, _I2, _I), cache=True)
def set_offsets(begin, begins, many, tasks):  # type: ignore[no-untyped-def]
    """Sets ``begin`` (sets + 1,) to the first row of each set. Sets ``begins`` (tasks, sets) to the first row of each
    task in each set. ``many`` (tasks, sets): number of contacts. Only the first ``tasks`` tasks are used.
    """
    n = 0
    for kind in range(many.shape[1]):
        begin[kind] = n
        for k in range(tasks):
            begins[k, kind] = n
            n += many[k, kind]
    begin[many.shape[1]] = n


@njit(types.void(_N1, _N1, _U1, _I, _I, _I), cache=True)
def number(places, slot, touched, n, first, stop):  # type: ignore[no-untyped-def]
    """Numbers the ``touched`` surface nodes from ``first`` to ``stop`` in their order; the numbers start at ``n``.
    Clears the flags ``touched``. ``slot`` (surface_nodes,) becomes the inverse of ``places``.
    """
    for a in range(first, stop):
        if touched[a]:
            places[n], slot[a], touched[a] = a, n, 0
            n += 1


@njit(types.void(_N1, _N2, _F1, _I2, _N1, _N1, _N2, _N1, _I, _I, _I), cache=True)
def sort(row, slots, reach, begins, set_of, found, nodes, slot, task, first, stop):  # type: ignore[no-untyped-def]
    """Orders the contacts ``found`` from ``first`` to ``stop`` by their sets, as idle contacts. Writes their rows,
    their slots, and the ``reach`` -1, so that every contact is computed in the first sweep.

    ``begins`` (tasks, sets): offset of this task in each set, which is advanced to its end; ``slot`` (surface_nodes,):
    see ``number``.
    """
    for q in range(first, stop):
        p, kind = found[q], set_of[q]
        at = begins[task, kind]
        begins[task, kind] += 1
        row[at], reach[at] = p, -1.0
        for k in range(4):
            slots[at, k] = slot[nodes[p, k]]
        if nodes[p, 1] == nodes[p, 2]:
            slots[at, 2] = -1


@njit(_F(NODES, _N1, _F2, _F2, _I, _I), cache=True)
def load(active, places, v, mobility, first, stop):  # type: ignore[no-untyped-def]
    """Copies velocities and mobilities (surface_nodes, 3) to the slots from ``first`` to ``stop``, and clears the
    impulses of these slots. Returns the largest l1 norm of a velocity, m/s.
    """
    moving, words, fixed, total, sums = (
        active.moving, active.moving_words, active.fixed, active.fixed_words, active.row_weights,
    )  # fmt: skip
    fastest = 0.0
    for s in range(first, stop):
        a = places[s]
        fastest = max(fastest, abs(v[a, 0]) + abs(v[a, 1]) + abs(v[a, 2]))
        for i in range(3):
            moving[s, V + i], fixed[s, MOBILITY + i] = v[a, i], mobility[a, i]
            words[s, IMPULSE + i] = total[s, TOTAL + i] = sums[s, i] = 0
        sums[s, 3], total[s, CHANGED], active.path[s] = 0, 0, 0.0
    return fastest


@njit(types.void(_F2, _I2, _I1, _I2, NODES, _N1, _N1, _N1, _B1, _I, _I), cache=True)
def leave(node_v, parts, unsettled, total, active, places, index, part, owned, first, stop):  # type: ignore[no-untyped-def]
    """Copies the velocities of the slots from ``first`` to ``stop`` to the local nodes, and the impulses of the step to
    ``total`` (surface_nodes, 3). Adds the impulses of owned nodes to the sums of their parts and to the residual
    ``unsettled`` (3,); the first two words of the residual are those of sweep_count.py; the third word is the number of
    local nodes with an impulse.
    """
    moving, words = active.moving, active.fixed_words
    for s in range(first, stop):
        a = places[s]
        h = index[a]
        size = np.int64(0)
        for i in range(3):
            j = words[s, TOTAL + i]
            size += abs(j)
            total[a, i] = j
            if h >= 0:
                node_v[h, i] = moving[s, V + i]
                if owned[h]:
                    parts[part[h], i] += j
        if h >= 0:
            unsettled[2] += size != 0
            if owned[h]:
                unsettled[0] += words[s, CHANGED] >> _SMALL
                unsettled[1] += size >> _SMALL
