"""Selection among the possible contacts of a node with faces. The selection is the last part of the detection of
node-face contacts in a step.

A node over an edge or a corner of a flat patch of faces has its foot on all faces there, and a possible contact with
each of these faces. If two flush surfaces have equal meshes, a node has five possible contacts on average. Contacts
with equal normals and equal weights act as one contact, so only one of these contacts remains.
"""

import numpy as np

from ...kernels.jit import njit, types
from ..geometry import at, minus
from .facing import RIM, TOUCHING, in_front, outside, reaches_over
from .tables import CONTACT_ROWS, FACES, PAIRS, SLOTS, STEP, needed

_FLAT = 1.0 - 1e-4
"""Smallest cosine of the angle between the normals of two faces of a flat patch. The largest angle is 0.8 degrees.
Chosen value: flat faces approximate the normals of a curved surface with a larger error."""
_ROUNDING = 1e-6
"""Difference of area coordinates. If the margins of two feet to the rims of their faces differ by less, the margins
count as equal. Chosen value: far above rounding errors, so that mirror images choose the images of the same faces, and
far below geometry.MARGIN."""
_NO_CONTACT = -1.0
"""Value in the column of depths that marks a row without contact."""
_I, _F, _N1, _F1 = types.int64, types.float64, types.int32[::1], types.float64[::1]


@njit("void(int32[::1], int32[::1], int32[::1], int32[:, ::1])", cache=True)
def link(earlier, last, found, nodes):  # type: ignore[no-untyped-def]
    """Links the rows ``found`` (n,) of each node in a list: ``last`` (slots,), -1 on entry, has the last place in
    ``found`` of each node, and ``earlier`` (n,) the place before it, -1 for none.
    """
    for q in range(len(found)):
        s = nodes[found[q], 0]
        earlier[q], last[s] = last[s], q


@njit("boolean(int32[:, ::1], float64[:, ::1], int64, int64)", cache=True, forceinline=True)
def _covers(nodes, weights, r, t):  # type: ignore[no-untyped-def]
    """Returns True if row ``t`` has the weights of row ``r`` at all nodes where they count."""
    for a in range(1, 4):
        other = 0.0
        for b in range(1, 4):
            if nodes[t, b] == nodes[r, a]:
                other = weights[t, b]
        if abs(weights[r, a] - other) > RIM:
            return False
    return True


@njit("float64(float64[:, ::1], int64)", cache=True, forceinline=True)
def _margin(weights, row):  # type: ignore[no-untyped-def]
    """Returns the smallest area coordinate of the foot of contact ``row``, in units of _ROUNDING, as a whole number;
    negative if the foot is outside of the face.
    """
    return np.rint(min(-weights[row, 1], -weights[row, 2], -weights[row, 3]) / _ROUNDING)


@njit(types.boolean(CONTACT_ROWS, PAIRS, FACES, _N1, _N1, _N1, _I), cache=True)
def _repeated(out, pairs, faces, found, earlier, last, row):  # type: ignore[no-untyped-def]
    """Returns True if the node of ``row`` has an equal contact with a better face. A face is better if it contains the
    foot with a larger margin or, for equal margins, has a lower id. Equal contacts have weights that differ by at most
    RIM, and normals within _FLAT.
    """
    nodes, weights, m = out.nodes, out.weights, out.normals
    name, q, margin = faces.id[pairs.rows[out.pair[row], 1]], last[nodes[row, 0]], _margin(weights, row)
    while q >= 0:
        t, q = found[q], earlier[q]
        other = _margin(weights, t)
        if other < margin or (other == margin and faces.id[pairs.rows[out.pair[t], 1]] >= name):
            continue
        if m[t, 0] * m[row, 0] + m[t, 1] * m[row, 1] + m[t, 2] * m[row, 2] < _FLAT:
            continue
        if _covers(nodes, weights, row, t) and _covers(nodes, weights, t, row):
            return True
    return False


@njit(
    types.void(CONTACT_ROWS, _F1, PAIRS, SLOTS, FACES, STEP, _N1, _N1, _N1, _F, _I, _I),
    cache=True,
    error_model="numpy",
)
def admitted(out, depth, pairs, slots, faces, step, found, earlier, last, end, first, stop):  # type: ignore[no-untyped-def]
    """Tests the conditions 6 to 8 (drawing in node_face.py) of the possible contacts ``found`` from ``first`` to
    ``stop``, and completes the rows of the contacts that fulfil these conditions. ``end``: time of the end of the step,
    s after the search.

    ``depth`` (rows,): on entry the gap of node and face at the beginning of the step, m. On return the depth of a node
    that is inside of the body, m; 0 for another contact; _NO_CONTACT for a row that does not fulfil the conditions.
    """
    nodes, weights, normals, x, v, part = out.nodes, out.weights, out.normals, step.x, step.v, step.part
    chains, until_end = slots.first, end + step.dt
    for q in range(first, stop):
        n = found[q]
        s, i, j, k, p = nodes[n, 0], nodes[n, 1], nodes[n, 2], nodes[n, 3], out.pair[n]
        gap0, gap1, b, f = depth[n], out.wanted[n], (-weights[n, 1], -weights[n, 2], -weights[n, 3]), pairs.rows[p, 1]
        depth[n] = _NO_CONTACT
        if min(b[0], b[1], b[2]) <= RIM:
            if _repeated(out, pairs, faces, found, earlier, last, n):  # condition 6, listed in node_face.py
                continue
            e, g = minus(at(x, j), at(x, i)), minus(at(x, k), at(x, i))
            leaves = np.inf if slots.fresh[s] else slots.left[s]
            over = reaches_over(slots.normals, s, b, e, g, faces.size[f])
            if not over and in_front(pairs, chains, faces, step, slots.normals, p, gap0, gap1, leaves, until_end):
                continue  # condition 7
        inside = gap0 < -TOUCHING * faces.size[f]
        if inside:
            leaves = np.inf if slots.fresh[s] else slots.left[s]
            if outside(pairs, chains, faces, x, part, p, -gap0, leaves, until_end):  # condition 8
                continue
        depth[n], rate = -gap0 if inside else 0.0, 0.0
        for a in range(3):  # m . sum(w_k v_k)
            rate += normals[n, a] * (v[s, a] - (b[0] * v[i, a] + b[1] * v[j, a] + b[2] * v[k, a]))
        out.wanted[n] = rate + needed(gap0, gap1, rate, step.give, step.dt)
        out.friction[n] = step.mu[part[s], part[i]]


@njit(_I(_N1, CONTACT_ROWS, _F1, PAIRS, FACES, _N1, _N1, _N1), cache=True)
def nearest(found, out, depth, pairs, faces, part, earlier, last):  # type: ignore[no-untyped-def]
    """Removes rows without contact from ``found``. A node that is behind several faces of a part keeps only its contact
    with the nearest face; if two faces are at the same depth, with the face of lower id. Returns the number of
    remaining contacts. ``earlier`` (n,) and ``last`` (slots,): lists of ``link``; ``last`` is -1 on return.
    """
    for row in found:
        last[out.nodes[row, 0]] = -1
    m = 0
    for q in range(len(found)):
        row = found[q]
        if depth[row] < 0.0:
            continue
        found[m] = row
        if depth[row] == 0.0:
            m += 1
            continue
        s = out.nodes[row, 0]
        h = last[s]
        while h >= 0 and part[out.nodes[found[h], 1]] != part[out.nodes[row, 1]]:
            h = earlier[h]
        if h < 0:
            earlier[m], last[s] = last[s], m
            m += 1
            continue
        same = depth[row] == depth[found[h]]
        lower = faces.id[pairs.rows[out.pair[row], 1]] < faces.id[pairs.rows[out.pair[found[h]], 1]]
        if depth[row] < depth[found[h]] or (same and lower):
            found[h] = row
    for q in range(m):
        last[out.nodes[found[q], 0]] = -1
    return m
