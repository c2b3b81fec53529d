r"""Common area of a tied face and a mortar face, and integrals over this area. The mortar face is projected onto the
plane of the tied face.

::

               m2                  Tied face 0, 1, 2 and mortar face m0, m1, m2, in the plane of the tied face. The
              /  \                 common polygon a, b, e, d (#) is the tied triangle cut by the three lines of the
        2    /    \                mortar one (Sutherland and Hodgman 1974), and divided into triangles from its
        | \ /      \               first corner.
        |  e        \
        | /##\       \                 own_ij  = int N_i N_j dA      i, j: corners of the tied face
        |/#####\      \                both_ij = int N_i M_j dA      j: corner of the mortar face
        d########\     \
       /|##########\    \          The shape functions N and M are linear, their products quadratic: three points, in
     m0-a-----------b----m1        the middles of the sides of each triangle, integrate them exactly.
        |             \
        0---------------1          The normals of the two faces are opposed: seen from outside the tied face, the mortar
                                   triangle runs clockwise.
"""

import numpy as np

from ..kernels.jit import njit, types

_MOST = 9
"""Length of the arrays of polygon corners. A triangle that is cut by three lines has at most six corners."""
OPPOSED = -0.5
"""Largest cosine between the normals of two faces that may be bonded. Chosen value: the normals of the two faces may
differ by at most 60 degrees from exactly opposed normals."""
_F1, _F2, _F3, _N2, _I = (
    types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1], types.int32[:, ::1], types.int64,
)  # fmt: skip


@njit(types.boolean(_F2, _F2, types.int32[::1]), cache=True, error_model="numpy")
def _frame(frame, x, face):  # type: ignore[no-untyped-def]
    """Sets the rows of ``frame`` to two unit vectors in the plane of a face, and its normal. Returns False if the face
    has no area.
    """
    for i in range(3):
        frame[0, i] = x[face[1], i] - x[face[0], i]
        frame[1, i] = x[face[2], i] - x[face[0], i]
    across, along = 0.0, 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[2, i] = frame[0, j] * frame[1, k] - frame[0, k] * frame[1, j]
        across += frame[2, i] * frame[2, i]
        along += frame[0, i] * frame[0, i]
    if not across > 0.0:
        return False
    for i in range(3):
        frame[2, i] /= np.sqrt(across)
        frame[0, i] /= np.sqrt(along)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[1, i] = frame[2, j] * frame[0, k] - frame[2, k] * frame[0, j]
    return True


@njit(types.void(_F2, _F2, _F2, types.int32[::1], _I), cache=True)
def _project(flat, frame, x, face, origin):  # type: ignore[no-untyped-def]
    """Sets ``flat`` to the corners of a face in the ``frame`` of another face, whose first corner is ``origin``. A
    corner has three coordinates: two in the plane of the other face, and the height above this plane.
    """
    for k in range(3):
        for a in range(3):
            flat[k, a] = 0.0
            for i in range(3):
                flat[k, a] += frame[a, i] * (x[face[k], i] - x[origin, i])


@njit(types.void(_F1, _F2, types.float64, types.float64), cache=True, error_model="numpy")
def _shares(shares, flat, p, q):  # type: ignore[no-untyped-def]
    """Sets ``shares`` to the area coordinates of a point of the plane in a triangle."""
    e, f = flat[1, 0] - flat[0, 0], flat[1, 1] - flat[0, 1]
    g, h = flat[2, 0] - flat[0, 0], flat[2, 1] - flat[0, 1]
    area, r, s = e * h - f * g, p - flat[0, 0], q - flat[0, 1]
    shares[1], shares[2] = (r * h - s * g) / area, (e * s - f * r) / area
    shares[0] = 1.0 - shares[1] - shares[2]


@njit(_I(_F2, _F2, _I, _F2), cache=True, error_model="numpy")
def _cut(polygon, room, n, flat):  # type: ignore[no-untyped-def]
    """Cuts the ``polygon`` of ``n`` corners by the three lines of a triangle whose corners run clockwise. Returns the
    new number of corners.
    """
    for k in range(3):
        a, b = (k + 1) % 3, k
        e, f = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
        m = 0
        for j in range(n):
            i = (j + 1) % n
            inner = e * (polygon[j, 1] - flat[a, 1]) - f * (polygon[j, 0] - flat[a, 0])
            other = e * (polygon[i, 1] - flat[a, 1]) - f * (polygon[i, 0] - flat[a, 0])
            if inner >= 0.0:
                room[m, 0], room[m, 1] = polygon[j, 0], polygon[j, 1]
                m += 1
            if (inner >= 0.0) != (other >= 0.0):
                share = inner / (inner - other)
                for c in range(2):
                    room[m, c] = polygon[j, c] + share * (polygon[i, c] - polygon[j, c])
                m += 1
        n = m
        for j in range(n):
            polygon[j, 0], polygon[j, 1] = room[j, 0], room[j, 1]
    return n


@njit(types.void(_F1, _F2, _F3, _F3, _F3, _F2, _N2, _N2, _N2), cache=True, error_model="numpy")
def common(area, far, own, both, corner, x, slaves, masters, pairs):  # type: ignore[no-untyped-def]
    """Computes the common area of each of the ``pairs`` (p, 2) of a tied face (index in ``slaves``) and a mortar face
    (index in ``masters``), and the integrals over it.

    ``area`` (p,): common area, m^2; ``far`` (p, 2): smallest and largest height of the mortar face above the tied face
    in the common area, m; ``own``, ``both`` (p, 3, 3): the integrals own_ij and both_ij that the top of the file
    defines, m^2; ``corner`` (p, 3, 3): area coordinates of the corners of the tied face in the mortar face.

    1. Frames of both faces; they must have an area and face each other.
    2. Both faces in the frame of the tied one.
    3. The common polygon.
    4. Integrals over its triangles.
    """
    frame, other, slave, flat = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    polygon, room = np.empty((_MOST, 2)), np.empty((_MOST, 2))
    mine, theirs = np.empty(3), np.empty(3)
    for p in range(len(pairs)):
        s, m = slaves[pairs[p, 0]], masters[pairs[p, 1]]
        area[p], far[p, 0], far[p, 1] = 0.0, np.inf, -np.inf
        for i in range(3):
            for j in range(3):
                own[p, i, j], both[p, i, j], corner[p, i, j] = 0.0, 0.0, -1.0
        # 1. Compute the frames of both faces.
        if not (_frame(frame, x, s) and _frame(other, x, m)):
            continue
        facing = 0.0
        for i in range(3):
            facing += frame[2, i] * other[2, i]
        if not facing <= OPPOSED:
            continue
        # 2. Transform both faces to the frame of the tied face.
        _project(slave, frame, x, s, s[0])
        _project(flat, frame, x, m, s[0])
        # 3. Compute the common polygon.
        for k in range(3):
            polygon[k, 0], polygon[k, 1] = slave[k, 0], slave[k, 1]
            _shares(theirs, flat, slave[k, 0], slave[k, 1])
            for j in range(3):
                corner[p, k, j] = theirs[j]
        n = _cut(polygon, room, 3, flat)
        # 4. Integrate over the triangles of the polygon.
        for k in range(1, n - 1):
            e, f = polygon[k, 0] - polygon[0, 0], polygon[k, 1] - polygon[0, 1]
            g, h = polygon[k + 1, 0] - polygon[0, 0], polygon[k + 1, 1] - polygon[0, 1]
            part = 0.5 * (e * h - f * g)
            if not part > 0.0:
                continue
            area[p] += part
            for q in range(3):
                a, b = (0, k, k + 1)[q], (k, k + 1, 0)[q]
                u, w = 0.5 * (polygon[a, 0] + polygon[b, 0]), 0.5 * (polygon[a, 1] + polygon[b, 1])
                _shares(mine, slave, u, w)
                _shares(theirs, flat, u, w)
                height = 0.0
                for i in range(3):
                    height += theirs[i] * flat[i, 2]
                    for j in range(3):
                        own[p, i, j] += part / 3.0 * mine[i] * mine[j]
                        both[p, i, j] += part / 3.0 * mine[i] * theirs[j]
                far[p, 0], far[p, 1] = min(far[p, 0], height), max(far[p, 1], height)
