"""Faces, edges and candidate pairs after a node separation (split). The module replaces corners by copies, and finds
new pairs. A new pair is a pair that a copy gets from its parent, or a pair whose members had a common node before the
separation.
"""

from typing import NamedTuple

import numpy as np

from ...kernels.jit import njit, several, types
from ...model.state import Indices
from ...model.topology import KEY

_I, _I1, _I2, _N1, _N2, _B1 = (
    types.int64, types.int64[::1], types.int64[:, ::1], types.int32[::1], types.int32[:, ::1], types.boolean[::1],
)  # fmt: skip
_NAMES = several(_I1, _I1, _N1)
"""Types of three arguments: ids of the nodes, ``key`` of a Split, and the slots that replace the nodes of the keys."""


class Family(NamedTuple):
    """Separated nodes, and the copies of each separated node."""

    first: Indices
    """(surface_nodes,) row in ``member`` of the first copy of each node; -1 for a node without copies."""
    member: Indices
    """(c, 2) slot of each copy, and flag: 1 if the copy is the last one of its parent."""
    most: int
    """Largest number of copies of one node."""
    pairs: Indices
    """(c, 2) slots of parent and copy."""


@njit(several(_N1, _N2, _I, _N2)(_N2, _I), cache=True)
def families(places, n):  # type: ignore[no-untyped-def]
    """Returns the ``Family`` of parents and copies. ``places`` (c, 2): slots of each parent and copy, ordered by
    parent, -1 for a node without slot; ``n``: number of surface nodes.
    """
    first, k = np.full(n, np.int32(-1), np.int32), 0
    member, pairs = np.empty_like(places), np.empty_like(places)
    most, count = 0, 0
    for c in range(len(places)):
        parent, copy = places[c, 0], places[c, 1]
        if parent < 0 or copy < 0:
            continue
        if first[parent] < 0:
            first[parent], count = k, 0
        else:
            member[k - 1, 1] = 0
        count += 1
        most = max(most, count)
        member[k, 0], member[k, 1] = copy, 1
        pairs[k, 0], pairs[k, 1] = parent, copy
        k += 1
    return first, member[:k].copy(), most, pairs[:k].copy()


@njit(types.int32(_I1, _I1, _N1, types.int32, _I), cache=True)
def _become(ids, key, became, node, tet):  # type: ignore[no-untyped-def]
    """Returns the node that replaces ``node`` in a tet, which is given by its global id. ``ids``: ids of the nodes;
    ``key`` and ``became``: see SplitOfGhosts.
    """
    wanted = ids[node] * KEY + tet
    at = np.searchsorted(key, wanted)
    return became[at] if at < len(key) and key[at] == wanted else node


@njit(_I1(_N2, _N1, _I1), cache=True)
def _torn(corners, first, near):  # type: ignore[no-untyped-def]
    """Returns the rows of ``corners`` (n, 4 or 6) that contain a node with copies. Only the rows ``near`` are tested.
    ``first``: see Family.
    """
    rows, n = np.empty(len(near), np.int64), 0
    for row in near:
        for k in range(corners.shape[1]):
            if first[corners[row, k]] >= 0:
                rows[n] = row
                n += 1
                break
    return rows[:n].copy()


@njit(several(_I1, _N2)(_I1, _N2, _B1, _I1, _N1, _I1, _I1, _N1), cache=True)
def follow_faces(near, corners, fresh, faces, first, ids, key, became):  # type: ignore[no-untyped-def]
    """Replaces ``corners`` (f, 4) of faces by copies of separated nodes. Returns the rows of the changed faces, and the
    corners of these faces before the change.

    ``near``: rows of all faces whose corners may have copies; ``faces`` (f,): ids of the faces; ``first``: see Family;
    ``ids``: ids of the nodes; ``key``: keys of a Split; ``became``: slots of the copies.
    """
    rows = _torn(corners, first, near)
    old = np.empty((len(rows), 4), np.int32)
    for r in range(len(rows)):
        f = rows[r]
        fresh[f] = True
        for k in range(4):
            old[r, k] = corners[f, k]
            if first[corners[f, k]] >= 0:
                corners[f, k] = _become(ids, key, became, corners[f, k], faces[f] // 4)
    return rows, old


@njit(several(_I1, _N2, _B1)(_I1, _N2, _B1, _I2, _N1, _I1, _I1, _N1), cache=True)
def follow_edges(near, corners, fresh, sides, first, ids, key, became):  # type: ignore[no-untyped-def]
    """Replaces nodes of edges by copies of separated nodes, in the same way as ``follow_faces``. Also returns flags of
    the edges that are removed because their two faces have separated at a common node. ``sides`` (e, 2): ids of the two
    faces of each edge.
    """
    rows = _torn(corners, first, near)
    old, gone = np.empty((len(rows), 6), np.int32), np.zeros(len(rows), np.bool_)
    for r in range(len(rows)):
        e = rows[r]
        fresh[e] = True
        one, two = sides[e, 0] // 4, sides[e, 1] // 4
        gone[r] = corners[e, 0] == corners[e, 1]
        for k in range(6):
            old[r, k] = corners[e, k]
        for k in range(6):
            if first[old[r, k]] < 0:
                continue
            corners[e, k] = _become(ids, key, became, old[r, k], one if k < 2 or k % 2 == 0 else two)
            if k < 2:
                gone[r] |= corners[e, k] != _become(ids, key, became, old[r, k], two)
        if gone[r]:
            corners[e, 1:] = corners[e, 0]
    return rows, old, gone


@njit("int32[:, ::1](int32[:, ::1], int32[::1], int32[::1], int32[:, ::1])", cache=True)
def inherited(family, first, following, pairs):  # type: ignore[no-untyped-def]
    """(p, 2) candidate pairs of a node and a face that the copies get from their parents. ``family`` (c, 2): slots of
    parents and copies; ``first`` (nodes,), ``following`` and ``pairs``: see node_face.chain.
    """
    n = 0
    for write in range(2):
        if write:
            found = np.empty((n, 2), np.int32)
        n = 0
        for c in range(len(family)):
            p = first[family[c, 0]]
            while p >= 0:
                if write:
                    found[n, 0], found[n, 1] = family[c, 1], pairs[p, 1]
                n += 1
                p = following[p]
    return found


@njit(
    "int64(int32[:, ::1], int64[::1], int32[:, ::1], int32[:, ::1], int32[::1], int32[:, ::1], boolean[::1], "
    "boolean[::1])",
    cache=True,
)
def apart_from_faces(pairs, rows, old, now, first, member, owned, meets):  # type: ignore[no-untyped-def]
    """Writes new pairs of a node and a face: the face had the node as a corner before the separation and does not have
    it now. Returns the number of pairs.

    ``rows``: rows of the faces; ``old`` and ``now`` (r, 4): corners of these faces before and after the separation;
    ``first`` and ``member``: see Family.
    """
    n = 0
    for r in range(len(rows)):
        for k in range(3):
            node = old[r, k]
            if first[node] < 0 or not owned[node] or not meets[r]:
                continue
            at, end = first[node], False
            while True:
                if node != now[r, 0] and node != now[r, 1] and node != now[r, 2]:
                    pairs[n, 0], pairs[n, 1] = node, rows[r]
                    n += 1
                if end:
                    break
                node, end = member[at, 0], member[at, 1] != 0
                at += 1
    return n


@njit(_I2(_N2, _N2, _N1, _B1), cache=True)
def apart_from_edges(old, now, first, own):  # type: ignore[no-untyped-def]
    """(p, 2) pairs of edges that had a common end before the separation and have none now. In a pair, the edge with the
    smaller faces is first. Only pairs whose first edge belongs to this rank are returned.

    ``old`` and ``now`` (e, 6): nodes of the edges before and after the separation; ``first``: see Family.
    """
    ends, m = np.empty(2 * len(old), np.int32), 0
    at = np.empty(2 * len(old), np.int64)
    for e in range(len(old)):
        for k in range(2):
            if first[old[e, k]] >= 0:
                ends[m], at[m] = old[e, k], e
                m += 1
    order, many = np.argsort(ends[:m], kind="mergesort"), 0
    for write in range(2):
        if write:
            pairs = np.empty((many, 2), np.int64)
        many, i = 0, 0
        while i < m:
            j, node = i, ends[order[i]]
            while j < m and ends[order[j]] == node:
                j += 1
            for a in range(i, j):
                for b in range(a + 1, j):
                    one, two = at[order[a]], at[order[b]]
                    if not own[one]:
                        continue
                    common = False
                    for k in range(2):
                        common |= now[one, k] == now[two, 0] or now[one, k] == now[two, 1]
                    both = True
                    for k in range(2):
                        both &= old[one, k] == old[two, 0] or old[one, k] == old[two, 1]
                    if common or (both and node != old[one, 0]):
                        continue
                    if write:
                        pairs[many, 0], pairs[many, 1] = one, two
                    many += 1
            i = j
    return pairs


@njit(
    _N2(_I1, _N2, _B1, _B1, _I1, _N1, _B1, _N1, _N2, _I, _B1, _NAMES),
    cache=True,
)
def tear_faces(near, corners, fresh, live, faces, part, in_contact, first, member, most, owned, names):  # type: ignore[no-untyped-def]
    """Replaces the corners of faces by their copies (``follow_faces``). Returns the new pairs (``apart_from_faces``) of
    the ``live`` faces (f,) of bodies that may be in contact with themselves. ``part``: part of each node;
    ``in_contact`` (parts,): parts with contact with themselves.
    """
    rows, old = follow_faces(near, corners, fresh, faces, first, names[0], names[1], names[2])
    now, searched = np.empty((len(rows), 4), np.int32), np.empty(len(rows), np.bool_)
    for r in range(len(rows)):
        searched[r] = live[rows[r]] and in_contact[part[old[r, 0]]]
        for k in range(4):
            now[r, k] = corners[rows[r], k]
    pairs = np.empty((3 * len(rows) * (1 + most), 2), np.int32)
    n = apart_from_faces(pairs, rows, old, now, first, member, owned, searched)
    return pairs[:n].copy()


@njit(_N2(_I1, _N2, _B1, _B1, _B1, _I2, _N1, _B1, _N1, _NAMES), cache=True)
def tear_edges(near, corners, fresh, live, mine, sides, part, in_contact, first, names):  # type: ignore[no-untyped-def]
    """Replaces the nodes of edges by their copies (``follow_edges``). Returns the new pairs (``apart_from_edges``) of
    the ``live`` edges (e,). ``mine``: SceneEdges.own; ``part``, ``in_contact``: see ``tear_faces``.
    """
    rows, old, gone = follow_edges(near, corners, fresh, sides, first, names[0], names[1], names[2])
    some, pair, n = np.empty(len(rows), np.int64), np.empty(len(rows), np.int64), 0
    for r in range(len(rows)):
        if live[rows[r]] and not gone[r] and in_contact[part[old[r, 0]]]:
            some[n], pair[n], n = r, (sides[rows[r], 0] << 32) + sides[rows[r], 1], n + 1
    order = np.argsort(pair[:n])
    before, now = np.empty((n, 6), np.int32), np.empty((n, 6), np.int32)
    own = np.empty(n, np.bool_)
    for i in range(n):
        r = some[order[i]]
        own[i] = mine[rows[r]]
        for k in range(6):
            before[i, k], now[i, k] = old[r, k], corners[rows[r], k]
    found = apart_from_edges(before, now, first, own)
    pairs = np.empty((len(found), 2), np.int32)
    for i in range(len(found)):
        for k in range(2):
            pairs[i, k] = rows[some[order[found[i, k]]]]
    return pairs
