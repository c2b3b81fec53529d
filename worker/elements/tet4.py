r"""The four-node tetrahedron: gradients, velocity gradient, internal force and stable time step, a chunk at a time.

::

              3                  node 0: origin of the edges      6 V   = e1 . (e2 x e3)
             /|\                 e1 = x1 - x0                     V grad N_1 = (e2 x e3) / 6 = b1
            / | \                e2 = x2 - x0                     V grad N_2 = (e3 x e1) / 6 = b2
           0--|--2               e3 = x3 - x0                     V grad N_3 = (e1 x e2) / 6 = b3
            \ | /                                                 V grad N_0 = -(b1 + b2 + b3)
             \|/
              1     1, 2, 3 run counter-clockwise seen from outside the face opposite to 0 when V > 0

Every function works on one chunk: ``w`` is scratch (rows of CHUNK numbers at the places below), ``s`` the state of
the chunk. Loops over a chunk use no function that could round differently in a vector lane and in a scalar.
"""

import numpy as np

from ..kernels.jit import njit, prefetch
from ..materials.elementary import NEAREST
from ..model.rows import MASS, PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ, TET_VOLUME, VISCOUS
from ..model.state import CHUNK

# Rows of the scratch, in numbers of float64. EDGE holds e1, e2, e3 and later b1, b2, b3 at the end of the step;
# RATE holds the velocity differences, then the rate of deformation and the spin; MOVED the differences of displacement.
# From NODAL to MOVED each pass and law has rows of its own; the four from CORNER_CHANGE on are the second pass's.
EDGE = 0
RATE = 9 * CHUNK
D_XX, D_YY, D_ZZ, D_YZ, D_ZX, D_XY = (RATE + k * CHUNK for k in range(6))
SPIN = RATE + 6 * CHUNK
VOLUME_MID = 18 * CHUNK
DILATATION = 19 * CHUNK
VOLUME = 20 * CHUNK
AREAS = 21 * CHUNK
MODULUS = 22 * CHUNK
LIMIT = 23 * CHUNK
TRIAL = 24 * CHUNK
SEEN = 25 * CHUNK
CHANGE = 26 * CHUNK
NODAL = 27 * CHUNK
CORNER_CHANGE = 36 * CHUNK
MOVED = 40 * CHUNK
SPEED = 49 * CHUNK
VOLUME_SEEN = 50 * CHUNK
CHANGE_SEEN = 51 * CHUNK
BEFORE = 52 * CHUNK
SCRATCH = 53 * CHUNK

_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_P, _Q, _MASS, _VOLUME = PRESSURE * CHUNK, VISCOUS * CHUNK, MASS * CHUNK, TET_VOLUME * CHUNK
_SIXTH = 1.0 / 6.0
CLOSING = 4.0
"""Steps at least in which a tet would lose, or gain, all of its volume at the rate of the step before. Chosen: about
what the default viscosity asks for, 4.3; at the end of such a step p = -K ln J is wrong by 0.5 %
(docs/theory/time_integration.md)."""
LENGTH_FACTOR = 1.2009369551760027
"""V^(1/3) times sqrt(sum |grad N|^2) of a regular tet, sqrt(6) / (6 sqrt(2))^(1/3): with l = LENGTH_FACTOR over that
root, l is V^(1/3) for a regular tet and shrinks with the altitude of a flat one."""
_LINE = 8
"""Numbers in a line of the cache, of 64 bytes where processors have vectors; where lines are longer some are brought
twice."""
_NEAREST_BITS = 0x4338000000000000
"""Bits of NEAREST."""
MAGNITUDE = 0x7FFFFFFFFFFFFFFF
"""Mask of a float64's bits without the sign: as integers these order like absolute values, with NaN above all."""


@njit("void(float64[::1], int64, int64)", cache=True, forceinline=True)
def _bring(ahead, i, rows):  # type: ignore[no-untyped-def]
    """Has a tet's part of what is needed next, ``rows`` numbers, brought near while others are gathered."""
    for j in range(0, rows, _LINE):
        prefetch(ahead, i * rows + j)


@njit("void(float64[::1], float64[:, ::1], uint32[:, ::1], float64[::1], int64)", cache=True, error_model="numpy")
def gather(rows, values, tets, ahead, n):  # type: ignore[no-untyped-def]
    """Nine rows: the differences of nodes 1, 2, 3 to node 0 in nodal ``values`` (nodes, 3).

    With x and the rows from EDGE on the edges, with v and those from RATE on the velocity differences. ``ahead``, whole
    rows of the state or none, is in the cache afterwards.
    """
    first, second, third = rows, rows[3 * CHUNK :], rows[6 * CHUNK :]
    near = len(ahead) // CHUNK
    for i in range(n):
        _bring(ahead, i, near)
        a, b, c, d = tets[i, 0], tets[i, 1], tets[i, 2], tets[i, 3]
        for k in range(3):
            origin = values[a, k]
            first[k * CHUNK + i] = values[b, k] - origin
            second[k * CHUNK + i] = values[c, k] - origin
            third[k * CHUNK + i] = values[d, k] - origin


@njit(
    "void(float64[::1], float64[:, ::1], float64[:, ::1], uint32[:, ::1], float64[::1], int64)",
    cache=True,
    error_model="numpy",
)
def gather_moved(w, x0, x, tets, ahead, n):  # type: ignore[no-untyped-def]
    """EDGE: the edges; MOVED: the differences of the displacements of nodes 1, 2, 3 to node 0; ``ahead`` as above.

    The edges of both times are gathered in turn: 18 rows at once are more than a processor keeps apart while it stores.
    """
    gather(w[EDGE:], x, tets, ahead, n)
    gather(w[MOVED:], x0, tets, ahead[:0], n)
    for k in range(9):
        edge, moved = w[EDGE + k * CHUNK :], w[MOVED + k * CHUNK :]
        for i in range(n):
            moved[i] = edge[i] - moved[i]


@njit("UniTuple(float64, 9)(float64[::1], int64)", cache=True, error_model="numpy", forceinline=True)
def _rates(w, i):  # type: ignore[no-untyped-def]
    """The velocity differences of tet ``i``."""
    return (
        w[RATE + i], w[RATE + CHUNK + i], w[RATE + 2 * CHUNK + i],
        w[RATE + 3 * CHUNK + i], w[RATE + 4 * CHUNK + i], w[RATE + 5 * CHUNK + i],
        w[RATE + 6 * CHUNK + i], w[RATE + 7 * CHUNK + i], w[RATE + 8 * CHUNK + i],
    )  # fmt: skip


@njit("UniTuple(float64, 10)(float64[::1], int64, float64)", cache=True, error_model="numpy", forceinline=True)
def _middle(w, i, h):  # type: ignore[no-untyped-def]
    """6 V, and 6 V grad N of the nodes 1, 2 and 3, of tet ``i`` at mid-step, a time ``h`` before the step's end."""
    ax, ay, az, bx, by, bz, cx, cy, cz = _rates(w, i)
    e1x, e1y, e1z = w[EDGE + i] - h * ax, w[EDGE + CHUNK + i] - h * ay, w[EDGE + 2 * CHUNK + i] - h * az
    e2x, e2y = w[EDGE + 3 * CHUNK + i] - h * bx, w[EDGE + 4 * CHUNK + i] - h * by
    e2z, e3x = w[EDGE + 5 * CHUNK + i] - h * bz, w[EDGE + 6 * CHUNK + i] - h * cx
    e3y, e3z = w[EDGE + 7 * CHUNK + i] - h * cy, w[EDGE + 8 * CHUNK + i] - h * cz
    g1x, g1y, g1z = e2y * e3z - e2z * e3y, e2z * e3x - e2x * e3z, e2x * e3y - e2y * e3x
    g2x, g2y, g2z = e3y * e1z - e3z * e1y, e3z * e1x - e3x * e1z, e3x * e1y - e3y * e1x
    g3x, g3y, g3z = e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x
    return e1x * g1x + e1y * g1y + e1z * g1z, g1x, g1y, g1z, g2x, g2y, g2z, g3x, g3y, g3z


@njit("void(float64[::1], int64, float64)", cache=True, error_model="numpy")
def kinematics(w, n, dt):  # type: ignore[no-untyped-def]
    """Rate of deformation and spin at mid-step from the edges at the end of the step and the velocities at mid-step.

    The gradient is taken at x(n+1/2) = x(n+1) - dt/2 v: a rigid rotation then has exactly no rate of deformation
    (the paper's modified central difference). SPIN holds the axial vector of dt/2 times the spin, VOLUME_MID the
    volume and DILATATION the trace of the rate of deformation.
    """
    h = 0.5 * dt
    for i in range(n):
        ax, ay, az, bx, by, bz, cx, cy, cz = _rates(w, i)
        six_volumes, g1x, g1y, g1z, g2x, g2y, g2z, g3x, g3y, g3z = _middle(w, i, h)
        r = 1.0 / six_volumes
        lxx = (ax * g1x + bx * g2x + cx * g3x) * r
        lxy = (ax * g1y + bx * g2y + cx * g3y) * r
        lxz = (ax * g1z + bx * g2z + cx * g3z) * r
        lyx = (ay * g1x + by * g2x + cy * g3x) * r
        lyy = (ay * g1y + by * g2y + cy * g3y) * r
        lyz = (ay * g1z + by * g2z + cy * g3z) * r
        lzx = (az * g1x + bz * g2x + cz * g3x) * r
        lzy = (az * g1y + bz * g2y + cz * g3y) * r
        lzz = (az * g1z + bz * g2z + cz * g3z) * r
        w[VOLUME_MID + i] = six_volumes * _SIXTH
        w[DILATATION + i] = lxx + lyy + lzz
        w[D_XX + i], w[D_YY + i], w[D_ZZ + i] = lxx, lyy, lzz
        w[D_YZ + i], w[D_ZX + i], w[D_XY + i] = 0.5 * (lyz + lzy), 0.5 * (lzx + lxz), 0.5 * (lxy + lyx)
        w[SPIN + i] = 0.5 * h * (lzy - lyz)
        w[SPIN + CHUNK + i] = 0.5 * h * (lxz - lzx)
        w[SPIN + 2 * CHUNK + i] = 0.5 * h * (lyx - lxy)


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def at_rest(w, n):  # type: ignore[no-untyped-def]
    """Of ``kinematics`` only VOLUME_MID and DILATATION, of tets that do not move."""
    for i in range(n):
        e1x, e1y, e1z = w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i]
        e2x, e2y, e2z = w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i]
        e3x, e3y, e3z = w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i]
        gx, gy, gz = e2y * e3z - e2z * e3y, e2z * e3x - e2x * e3z, e2x * e3y - e2y * e3x
        w[VOLUME_MID + i] = (e1x * gx + e1y * gy + e1z * gz) * _SIXTH
        w[DILATATION + i] = 0.0


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def volumes(w, n):  # type: ignore[no-untyped-def]
    """VOLUME from the edges, as ``end_gradients`` has it to the bit."""
    for i in range(n):
        e1x, e1y, e1z = w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i]
        e2x, e2y, e2z = w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i]
        e3x, e3y, e3z = w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i]
        bx, by = (e2y * e3z - e2z * e3y) * _SIXTH, (e2z * e3x - e2x * e3z) * _SIXTH
        bz = (e2x * e3y - e2y * e3x) * _SIXTH
        w[VOLUME + i] = e1x * bx + e1y * by + e1z * bz


@njit("void(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def growth(w, s, n, dt):  # type: ignore[no-untyped-def]
    """VOLUME_MID, the mean of VOLUME and the volume before the step, and DILATATION, their difference over it and dt.

    As those of ``kinematics`` but for terms of the third order in the step. Without a step there is no change.
    """
    frequency = 1.0 / dt if dt > 0.0 else 0.0
    for i in range(n):
        volume = w[VOLUME + i]
        old = s[_VOLUME + i] if dt > 0.0 else volume
        middle = 0.5 * (old + volume)
        w[VOLUME_MID + i] = middle
        w[DILATATION + i] = (volume - old) * frequency / middle


@njit("void(float64[::1], float64[::1], int64)", cache=True)
def unchanged(w, s, n):  # type: ignore[no-untyped-def]
    """VOLUME_MID and DILATATION of tets whose volume before the step is known, and that do not move."""
    for i in range(n):
        w[VOLUME_MID + i], w[DILATATION + i] = s[_VOLUME + i], 0.0


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def end_gradients(w, n):  # type: ignore[no-untyped-def]
    """Replaces the edges by b1, b2, b3 (m^2), and sets VOLUME (m^3) and AREAS, the sum of |b|^2 over four nodes."""
    for i in range(n):
        e1x, e1y, e1z = w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i]
        e2x, e2y, e2z = w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i]
        e3x, e3y, e3z = w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i]
        b1x, b1y = (e2y * e3z - e2z * e3y) * _SIXTH, (e2z * e3x - e2x * e3z) * _SIXTH
        b1z, b2x = (e2x * e3y - e2y * e3x) * _SIXTH, (e3y * e1z - e3z * e1y) * _SIXTH
        b2y, b2z = (e3z * e1x - e3x * e1z) * _SIXTH, (e3x * e1y - e3y * e1x) * _SIXTH
        b3x, b3y = (e1y * e2z - e1z * e2y) * _SIXTH, (e1z * e2x - e1x * e2z) * _SIXTH
        b3z = (e1x * e2y - e1y * e2x) * _SIXTH
        b0x, b0y, b0z = b1x + b2x + b3x, b1y + b2y + b3y, b1z + b2z + b3z
        w[VOLUME + i] = e1x * b1x + e1y * b1y + e1z * b1z
        w[AREAS + i] = (
            (b0x * b0x + b0y * b0y + b0z * b0z)
            + (b1x * b1x + b1y * b1y + b1z * b1z)
            + (b2x * b2x + b2y * b2y + b2z * b2z)
            + (b3x * b3x + b3y * b3y + b3z * b3z)
        )
        w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i] = b1x, b1y, b1z
        w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i] = b2x, b2y, b2z
        w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i] = b3x, b3y, b3z


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def speeds(w, n):  # type: ignore[no-untyped-def]
    """SPEED, the rate of change of the volume over it, 1/s, from V grad N and the velocity differences."""
    for i in range(n):
        ax, ay, az, bx, by, bz, cx, cy, cz = _rates(w, i)
        first = ax * w[EDGE + i] + ay * w[EDGE + CHUNK + i] + az * w[EDGE + 2 * CHUNK + i]
        second = bx * w[EDGE + 3 * CHUNK + i] + by * w[EDGE + 4 * CHUNK + i] + bz * w[EDGE + 5 * CHUNK + i]
        third = cx * w[EDGE + 6 * CHUNK + i] + cy * w[EDGE + 7 * CHUNK + i] + cz * w[EDGE + 8 * CHUNK + i]
        w[SPEED + i] = (first + second + third) / w[VOLUME + i]


@njit("int64(float64)", cache=True, error_model="numpy", forceinline=True)
def _whole(x):  # type: ignore[no-untyped-def]
    """x, of a magnitude below 2^51, rounded to the nearest integer, the even one of two: the last bits of a sum. Many
    processors have no instruction that makes integers of a vector of float64.
    """
    return np.float64(x + NEAREST).view(np.int64) - _NEAREST_BITS


@njit("UniTuple(int64, 3)(float64, float64, float64, float64)", cache=True, error_model="numpy")
def quanta(a, b, c, scale):  # type: ignore[no-untyped-def]
    """In quanta of 1/scale, rounded to the nearest integer; any if that is beyond fixed_point.CONTRIBUTION_BITS."""
    return _whole(a * scale), _whole(b * scale), _whole(c * scale)


@njit("int64(float64, float64, float64)", cache=True, error_model="numpy")
def largest_of(a, b, c):  # type: ignore[no-untyped-def]
    """The largest magnitude, as the bits of a float64; NaN is above all."""
    return max(
        max(np.float64(a).view(np.int64) & MAGNITUDE, np.float64(b).view(np.int64) & MAGNITUDE),
        np.float64(c).view(np.int64) & MAGNITUDE,
    )


@njit("int64(int64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def internal_forces(wi, w, s, n, scale):  # type: ignore[no-untyped-def]
    """Nine rows of -V stress grad N of nodes 1, 2, 3, N, in quanta of 1/scale; returns the bits of the largest.

    Node 0 gets minus their sum when they are scattered.
    """
    peak = 0
    for i in range(n):
        pressure = s[_P + i] + s[_Q + i]
        sxx, syy, szz = pressure - s[_SXX + i], pressure - s[_SYY + i], pressure - s[_SZZ + i]
        syz, szx, sxy = -s[_SYZ + i], -s[_SZX + i], -s[_SXY + i]
        b1x, b1y, b1z = w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i]
        b2x, b2y, b2z = w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i]
        b3x, b3y, b3z = w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i]
        f1x, f1y, f1z = (
            sxx * b1x + sxy * b1y + szx * b1z,
            sxy * b1x + syy * b1y + syz * b1z,
            szx * b1x + syz * b1y + szz * b1z,
        )
        f2x, f2y, f2z = (
            sxx * b2x + sxy * b2y + szx * b2z,
            sxy * b2x + syy * b2y + syz * b2z,
            szx * b2x + syz * b2y + szz * b2z,
        )
        f3x, f3y, f3z = (
            sxx * b3x + sxy * b3y + szx * b3z,
            sxy * b3x + syy * b3y + syz * b3z,
            szx * b3x + syz * b3y + szz * b3z,
        )
        wi[i], wi[CHUNK + i], wi[2 * CHUNK + i] = quanta(f1x, f1y, f1z, scale)
        wi[3 * CHUNK + i], wi[4 * CHUNK + i], wi[5 * CHUNK + i] = quanta(f2x, f2y, f2z, scale)
        wi[6 * CHUNK + i], wi[7 * CHUNK + i], wi[8 * CHUNK + i] = quanta(f3x, f3y, f3z, scale)
        first, second, third = largest_of(f1x, f1y, f1z), largest_of(f2x, f2y, f2z), largest_of(f3x, f3y, f3z)
        peak = max(peak, max(max(first, second), third))
    return peak


@njit("void(int64[:, ::1], int64[::1], uint32[:, ::1], int64)", cache=True)
def scatter_forces(force, wi, tets, n):  # type: ignore[no-untyped-def]
    """Adds the quantised forces to the nodal sums; node 0 gets minus the sum, so that they add to zero exactly."""
    first, second, third = wi, wi[3 * CHUNK :], wi[6 * CHUNK :]
    for i in range(n):
        a, b, c, d = tets[i, 0], tets[i, 1], tets[i, 2], tets[i, 3]
        for k in range(3):
            f1, f2, f3 = first[k * CHUNK + i], second[k * CHUNK + i], third[k * CHUNK + i]
            force[b, k] += f1
            force[c, k] += f2
            force[d, k] += f3
            force[a, k] -= f1 + f2 + f3


@njit("void(float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def step_limit(w, s, n):  # type: ignore[no-untyped-def]
    """LIMIT: c sqrt(sum |grad N|^2), one over the largest stable step, 1/s; NaN where the volume is not positive.

    Twice this is never below the highest frequency of a tet with lumped mass (derived in
    docs/theory/time_integration.md).
    """
    for i in range(n):
        volume = w[VOLUME + i]
        w[LIMIT + i] = np.sqrt(w[AREAS + i] * w[MODULUS + i] / (volume * s[_MASS + i]))


@njit("void(float64[::1], int64)", cache=True)
def motion_limit(w, n):  # type: ignore[no-untyped-def]
    """Raises LIMIT to CLOSING times the rate of change of the volume, SPEED, 1/s; NaN stays."""
    for i in range(n):
        rate = CLOSING * abs(w[SPEED + i])
        limit = w[LIMIT + i]
        w[LIMIT + i] = rate if limit < rate else limit
