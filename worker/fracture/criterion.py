"""Fracture criterion: compares the traction on a facet, the mean of the tractions of its two tets, with the strength of
the facet.

Under tension a facet with the normal traction t_n and the shear traction t_s breaks where sqrt(<t_n>^2 + w t_s^2)
reaches the strength; w is the weight of shear. The Macaulay bracket <> is missing in eq. (1) of the paper. Under
pressure a facet breaks where sqrt(w) <t_s - mu |t_n|> reaches the strength (Camacho and Ortiz 1996); mu is the
coefficient of internal friction. ::

                  n                              t = (stress_1 + stress_2) / 2 n
          tet 2   ^    t                         t_n = t . n, positive in tension
        +---------|--/------+  facet             t_s = |t - t_n n|
          tet 1   | /                            n: outward normal of the tet of smaller id, tet 1

The formula for tension is convex and is an upper bound of the formula for pressure. Therefore the mean of two tractions
can reach the strength only if at least one of the two tractions reaches it. The pass over the elements marks the
overstressed faces of each tet (elements/hot.py), and the mean traction is computed only for facets with a marked face.
A facet whose mean traction reaches the strength is a candidate.
"""

import numpy as np

from ..kernels.jit import njit, types
from ..mesh.faces import FACES
from ..model.rows import PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ
from ..model.state import CHUNK, INTACT
from .records import CANDIDATES, INTERFACE, LAW, MESH, POINTS, TABLE
from .strength import required

_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_P = PRESSURE * CHUNK
_TOGETHER = 64
"""Number of facets whose stresses are read together in one loop."""
_I1, _F1 = types.int64[::1], types.float64[::1]


@njit(types.void(_F1, MESH, types.int64), cache=True)
def _stress(s, mesh, e):  # type: ignore[no-untyped-def]
    """Sets ``s`` (6,) to the stress xx, yy, zz, yz, zx, xy of tet ``e``, Pa, without the viscous part."""
    state, at = mesh.state, (e // CHUNK) * mesh.columns * CHUNK + e % CHUNK
    p = state[at + _P]
    s[0], s[1], s[2] = state[at + _SXX] - p, state[at + _SYY] - p, state[at + _SZZ] - p
    s[3], s[4], s[5] = state[at + _SYZ], state[at + _SZX], state[at + _SXY]


@njit("void(float64[::1], float64[::1], float64[::1])", cache=True)
def _traction(t, s, normal):  # type: ignore[no-untyped-def]
    """Sets ``t`` (3,) to the product of the stress ``s`` (6,) and the ``normal``, Pa."""
    nx, ny, nz = normal[0], normal[1], normal[2]
    t[0] = s[0] * nx + s[5] * ny + s[4] * nz
    t[1] = s[5] * nx + s[1] * ny + s[3] * nz
    t[2] = s[4] * nx + s[3] * ny + s[2] * nz


@njit("float64(float64[::1], float64[:, ::1], uint32[::1], int64)", cache=True, error_model="numpy")
def outward(normal, x, tet, face):  # type: ignore[no-untyped-def]
    """Sets the unit outward ``normal`` of a face of a tet at the positions ``x``; returns the area, m^2.

    The nodes are used in the order of their ids, so the normals of the two sides of a facet are bit-identical except
    for the sign.
    """
    a, b, c = tet[FACES[face, 0]], tet[FACES[face, 1]], tet[FACES[face, 2]]
    sign = 1.0
    if a > b:
        a, b, sign = b, a, -sign
    if b > c:
        b, c, sign = c, b, -sign
    if a > b:
        a, b, sign = b, a, -sign
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        normal[i] = (x[b, j] - x[a, j]) * (x[c, k] - x[a, k]) - (x[b, k] - x[a, k]) * (x[c, j] - x[a, j])
    length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    for i in range(3):
        normal[i] *= sign / length
    return 0.5 * length


@njit(types.float64[::1](types.uint32[:, ::1], _I1, _I1, POINTS), cache=True, error_model="numpy")
def areas(tets, places, faces, x):  # type: ignore[no-untyped-def]
    """(m,) areas of faces, m^2. The area of a facet is bit-identical for its two sides."""
    out, normal = np.empty(len(places)), np.empty(3)
    for m in range(len(places)):
        out[m] = outward(normal, x, tets[places[m]], faces[m])
    return out


@njit("float64(float64[::1], float64[::1], float64, float64)", cache=True)
def effective(t, normal, weight, friction):  # type: ignore[no-untyped-def]
    """Returns the effective traction, Pa, that belongs to the traction ``t`` on a facet."""
    along = t[0] * normal[0] + t[1] * normal[1] + t[2] * normal[2]
    across = max(t[0] * t[0] + t[1] * t[1] + t[2] * t[2] - along * along, 0.0)
    if along >= 0.0:
        return np.sqrt(along * along + weight * across)
    return np.sqrt(weight) * max(np.sqrt(across) + friction * along, 0.0)


@njit(types.int64(CANDIDATES, types.int64, types.int64, types.int64, types.uint8[::1], MESH), cache=True)
def _of_tet(out, n, end, e, hot, mesh):  # type: ignore[no-untyped-def]
    """Writes the overstressed facets of tet ``e`` to the rows of ``out`` from ``n`` on, but not to ``end`` or beyond. A
    facet with two overstressed sides is written once, from its first side. Returns the number of the next row; the
    number may be larger than ``end``.
    """
    for k in range(4):
        if not (hot[e] & mesh.intact[e]) >> k & 1:
            continue
        other, far = mesh.beside[e, k], mesh.across[e, k] % 4
        first = mesh.id[e] < mesh.id[other]
        if not first and (hot[other] >> far) & 1:
            continue
        if n < end:
            out.place[n], out.face[n], out.shared[n] = (e, k, -1) if first else (other, far, -1)
        n += 1
    return n


@njit(types.int64(CANDIDATES, types.int64, types.int64, types.uint8[::1], MESH, types.int64, types.int64), cache=True)
def overstressed(out, begin, end, hot, mesh, first, stop):  # type: ignore[no-untyped-def]
    """Writes the overstressed facets between tets of this rank, for the tets from ``first`` to ``stop``, to the rows of
    ``out`` from ``begin`` to ``end``; returns the number of these facets, even if it is larger than the number of rows.

    ``hot`` (tets,): bit k is set if face k is overstressed. The loop reads the values of eight tets at once.
    """
    n, words = begin, (stop - first) // 8
    one, two = hot[first : first + 8 * words].view(np.uint64), mesh.intact[first : first + 8 * words].view(np.uint64)
    for w in range(words + 1):
        if w == words or one[w] & two[w]:
            for e in range(first + 8 * w, min(first + 8 * w + 8, stop)):
                if hot[e] & mesh.intact[e]:
                    n = _of_tet(out, n, end, e, hot, mesh)
    return n - begin


@njit(types.int64(CANDIDATES, MESH, TABLE, POINTS, LAW, types.int64, types.int64), cache=True)
def within(out, mesh, table, x, law, first, stop):  # type: ignore[no-untyped-def]
    """Tests the facets in the rows ``first`` to ``stop`` of ``out``, and moves the candidates to the front of this
    range; returns the number of candidates. One loop reads the stresses of several facets, so that the waiting times
    for memory overlap.
    """
    normal, one, two, m = np.empty(3), np.empty(3), np.empty(3), first
    near, far = np.empty((_TOGETHER, 6)), np.empty((_TOGETHER, 6))
    for begin in range(first, stop, _TOGETHER):
        some = min(_TOGETHER, stop - begin)
        for i in range(some):
            a, face = out.place[begin + i], out.face[begin + i]
            _stress(near[i], mesh, a)
            _stress(far[i], mesh, mesh.beside[a, face])
        for i in range(some):
            a, face = out.place[begin + i], out.face[begin + i]
            outward(normal, x, mesh.tets[a], face)
            _traction(one, near[i], normal)
            _traction(two, far[i], normal)
            for k in range(3):
                one[k] = 0.5 * (one[k] + two[k])
            size = effective(one, normal, law.weight, law.friction)
            if size >= table.strength[a, face]:
                out.place[m], out.face[m], out.shared[m] = a, face, -1
                for k in range(3):
                    out.traction[m, k] = one[k]
                out.traction[m, 3] = size
                m += 1
    return m - first


@njit("void(int64[::1], int64[::1], int64[::1], float64[:, ::1], int64, int64)", cache=True)
def _copy(place, face, shared, traction, m, i):  # type: ignore[no-untyped-def]
    """Copies row ``i`` of the candidates to row ``m``."""
    place[m], face[m], shared[m] = place[i], face[i], shared[i]
    for k in range(4):
        traction[m, k] = traction[i, k]


@njit(types.int64(CANDIDATES, _I1, _I1), cache=True)
def _joined(out, begins, counts):  # type: ignore[no-untyped-def]
    """Moves the rows of several ranges of ``out`` to the front of ``out``: ``counts[k]`` rows from row ``begins[k]``
    on. Returns the total number of rows that were moved.
    """
    m = 0
    for k in range(len(counts)):
        for i in range(begins[k], begins[k] + counts[k]):
            _copy(out.place, out.face, out.shared, out.traction, m, i)
            m += 1
    return m


@njit(types.void(INTERFACE, _I1, MESH, types.uint8[::1]), cache=True)
def mark_shared(shared, chosen, mesh, hot):  # type: ignore[no-untyped-def]
    """Marks each neighbour rank with which this rank shares a facet that is in a ``chosen`` row, is intact, and is
    overstressed on this side. The chosen facets belong to one body. ``hot`` (tets,): marks of overstressed faces, as in
    ``search``.
    """
    for m in chosen:
        e, face = shared.sides[m, 0], shared.sides[m, 1]
        if hot[e] >> face & 1 and mesh.bond[e, face] == INTACT:
            shared.hot[shared.of[m]] = 1


@njit(types.void(INTERFACE, _I1, MESH, POINTS), cache=True)
def own_tractions(shared, chosen, mesh, x):  # type: ignore[no-untyped-def]
    """Computes the tractions of this rank's tets on the intact ``chosen`` shared facets of one body. Facets shared with
    a neighbour rank are skipped if no facet shared with this rank is overstressed.
    """
    normal, stress = np.empty(3), np.empty(6)
    for m in chosen:
        e, face = shared.sides[m, 0], shared.sides[m, 1]
        if mesh.bond[e, face] == INTACT and shared.hot[shared.of[m]]:
            outward(normal, x, mesh.tets[e], face)
            if not shared.first[m]:
                normal *= -1.0
            _stress(stress, mesh, e)
            _traction(shared.own[m], stress, normal)


@njit(types.int64(CANDIDATES, types.int64, INTERFACE, _I1, MESH, TABLE, POINTS, LAW), cache=True)
def _across(out, n, shared, chosen, mesh, table, x, law):  # type: ignore[no-untyped-def]
    """Appends the candidates among the ``chosen`` shared facets of one body to the ``n`` candidates in ``out``. The
    traction of a facet is the mean of the tractions from its two ranks. Returns the new number of candidates.
    """
    normal, mean, bound = np.empty(3), np.empty(3), max(1.0, law.weight) * (1.0 + 1e-9)
    for m in chosen:
        if not shared.hot[shared.of[m]]:
            continue
        e, face = shared.sides[m, 0], shared.sides[m, 1]
        square, strength = 0.0, table.strength[e, face]
        for i in range(3):
            mean[i] = 0.5 * (shared.own[m, i] + shared.theirs[m, i])
            square += mean[i] * mean[i]
        if mesh.bond[e, face] != INTACT or bound * square < strength * strength:
            continue
        outward(normal, x, mesh.tets[e], face)
        if not shared.first[m]:
            normal *= -1.0
        size = effective(mean, normal, law.weight, law.friction)
        if size >= strength:
            out.place[n], out.face[n], out.shared[n] = e, face, m
            out.traction[n, 0], out.traction[n, 1], out.traction[n, 2] = mean[0], mean[1], mean[2]
            out.traction[n, 3] = size
            n += 1
    return n


@njit(types.int64(CANDIDATES, types.int64, TABLE, LAW, types.int64, types.float64), cache=True, error_model="numpy")
def clock(found, n, table, law, step, t):  # type: ignore[no-untyped-def]
    """Updates the clocks of the ``n`` candidates. Moves the facets that break by the delayed criterion to the front;
    returns the number of these facets.

    If the clock of an overstressed facet ran in the last step, number ``step`` - 1, the clock continues; else it starts
    at the time ``t``. If the part uses nodal tractions, a candidate need not be overstressed; such a candidate has no
    clock.
    """
    m = 0
    for i in range(n):
        place, face = found.place[i], found.face[i]
        strength = table.strength[place, face]
        if found.traction[i, 3] >= strength:
            if table.seen[place, face] != step - 1:
                table.since[place, face] = t
            table.seen[place, face] = step
            if found.traction[i, 3] >= required(strength, t - table.since[place, face], law.delay):
                _copy(found.place, found.face, found.shared, found.traction, m, i)
                m += 1
    return m


@njit(
    types.int64(
        CANDIDATES, _I1, _I1, INTERFACE, _I1, MESH, TABLE, POINTS, LAW, types.int64, types.float64
    ),
    cache=True,
)  # fmt: skip
def breaking(out, begins, counts, shared, chosen, mesh, table, x, law, step, t):  # type: ignore[no-untyped-def]
    """Moves the facets that break in step number ``step`` by their clocks to the front of ``out``; if ``step`` is 0,
    all candidates. Returns the number of these facets.

    ``out``: candidates within the rank, ``counts[k]`` rows from row ``begins[k]`` on; ``chosen``: rows of the
    ``shared`` facets of the body.
    """
    n = _across(out, _joined(out, begins, counts), shared, chosen, mesh, table, x, law)
    return clock(out, n, table, law, step, t) if step > 0 else n
