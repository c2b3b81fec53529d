r"""Geometry and kinematics of the four-node tetrahedron. Each function computes a chunk of tets.

::

                  3
                 /|\             node 0: origin of the edges      6 V   = e1 . (e2 x e3)
                / | \            e1 = x1 - x0                     V grad N_1 = (e2 x e3) / 6 = b1
               /  |  \           e2 = x2 - x0                     V grad N_2 = (e3 x e1) / 6 = b2
              /   |   \          e3 = x3 - x0                     V grad N_3 = (e1 x e2) / 6 = b3
             0 - -|- - 2                                          V grad N_0 = -(b1 + b2 + b3)
              \   |   /
               \  |  /           1, 2, 3 run counter-clockwise seen from outside the face opposite to 0 if V > 0.
                \ | /            b_a is a third of the area vector of the face opposite to node a, towards a.
                 \|/
                  1              Edges and gradients at n+1/2 or n+1; u_a: velocity of node a less that of node 0:

                                 velocity gradient  L = sum_a u_a (x) b_a / V,   D = (L + L^T) / 2,   W = (L - L^T) / 2

``w`` is the scratch memory of a thread (rows of CHUNK numbers, scratch.py), ``s`` the state of the chunk, ``n`` the
number of its tets. Loops over a chunk use no function whose vector version may round differently from its scalar
version.
"""

from ..kernels.jit import njit, prefetch
from ..model.rows import TET_VOLUME
from ..model.state import CHUNK
from . import corners
from .corners import FOUR
from .scratch import (
    AREAS,
    D_XX,
    D_XY,
    D_YY,
    D_YZ,
    D_ZX,
    D_ZZ,
    DILATATION,
    EDGE,
    MOVED,
    RATE,
    SPEED,
    SPIN,
    VOLUME,
    VOLUME_MID,
)

_VOLUME = TET_VOLUME * CHUNK
_SIXTH = 1.0 / 6.0
_LINE = 8
"""Number of float64 in a cache line of 64 bytes. On a processor with cache lines of 128 bytes some cache lines are
fetched twice."""


@njit("void(float64[::1], int64, int64)", cache=True, forceinline=True)
def _prefetch_tet(ahead, i, rows):  # type: ignore[no-untyped-def]
    """Prefetches ``rows`` numbers of tet ``i`` from the array ``ahead``, which the next kernel reads. The prefetch runs
    at the same time as the reading of other arrays."""
    for j in range(0, rows, _LINE):
        prefetch(ahead, i * rows + j)


@njit("void(float64[::1], float64[:, ::1], uint32[:, ::1], float64[::1], int64)", cache=True, error_model="numpy")
def gather(rows, values, tets, ahead, n):  # type: ignore[no-untyped-def]
    """Sets nine ``rows`` to the values of nodes 1, 2, 3 minus the value of node 0; ``values`` (nodes, 3): nodal values.

    If the values are positions, the result is the edges, in the rows from EDGE on. If the values are velocities, the
    result is the velocity differences, in the rows from RATE on. ``ahead``: state rows to be prefetched into the cache,
    or an empty array.
    """
    near, whole = len(ahead) // CHUNK, n // FOUR * FOUR
    for i in range(0, whole, FOUR):
        for k in range(FOUR):
            _prefetch_tet(ahead, i + k, near)
        corners.gather(rows, values, tets, i)
    for i in range(whole, n):
        a, b, c, d = tets[i, 0], tets[i, 1], tets[i, 2], tets[i, 3]
        for k in range(3):
            origin = values[a, k]
            rows[k * CHUNK + i] = values[b, k] - origin
            rows[(3 + k) * CHUNK + i] = values[c, k] - origin
            rows[(6 + k) * CHUNK + i] = values[d, k] - origin


@njit(
    "void(float64[::1], float64[:, ::1], float64[:, ::1], uint32[:, ::1], float64[::1], int64)",
    cache=True,
    error_model="numpy",
)
def gather_moved(w, x0, x, tets, ahead, n):  # type: ignore[no-untyped-def]
    """Sets the rows EDGE to the edges, and the rows MOVED to the displacements of nodes 1, 2, 3 minus the displacement
    of node 0. ``ahead``: see ``gather``.
    """
    near, whole = len(ahead) // CHUNK, n // FOUR * FOUR
    for i in range(0, whole, FOUR):
        for k in range(FOUR):
            _prefetch_tet(ahead, i + k, near)
        corners.gather_moved(w, x0, x, tets, i)
    for i in range(whole, n):
        for j in range(3):
            a, b = tets[i, 0], tets[i, j + 1]
            for k in range(3):
                row = (3 * j + k) * CHUNK + i
                w[EDGE + row] = x[b, k] - x[a, k]
                w[MOVED + row] = w[EDGE + row] - (x0[b, k] - x0[a, k])


@njit("UniTuple(float64, 9)(float64[::1], int64)", cache=True, error_model="numpy", forceinline=True)
def _rates(w, i):  # type: ignore[no-untyped-def]
    """Returns the velocities of nodes 1, 2, 3 less the velocity of node 0, of tet ``i``."""
    return (
        w[RATE + i], w[RATE + CHUNK + i], w[RATE + 2 * CHUNK + i],
        w[RATE + 3 * CHUNK + i], w[RATE + 4 * CHUNK + i], w[RATE + 5 * CHUNK + i],
        w[RATE + 6 * CHUNK + i], w[RATE + 7 * CHUNK + i], w[RATE + 8 * CHUNK + i],
    )  # fmt: skip


@njit("UniTuple(float64, 10)(float64[::1], int64, float64)", cache=True, error_model="numpy", forceinline=True)
def _middle(w, i, h):  # type: ignore[no-untyped-def]
    """Returns 6 V, and 6 V grad N of nodes 1, 2 and 3, of tet ``i`` at mid-step. Mid-step is the time ``h`` before the
    end of the step."""
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
    """Sets rate of deformation and spin at mid-step, from the edges at the end of the step and the velocities at
    mid-step.

    The gradient is taken at x(n+1/2) = x(n+1) - dt/2 v, so that a rigid rotation has exactly zero rate of deformation
    (the paper's modified central difference). Results: SPIN: axial vector of dt/2 times the spin; VOLUME_MID: volume;
    DILATATION: trace of the rate of deformation.
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
    """Sets the rows VOLUME_MID and DILATATION of tets at rest to the values that ``kinematics`` would give."""
    for i in range(n):
        e1x, e1y, e1z = w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i]
        e2x, e2y, e2z = w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i]
        e3x, e3y, e3z = w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i]
        gx, gy, gz = e2y * e3z - e2z * e3y, e2z * e3x - e2x * e3z, e2x * e3y - e2y * e3x
        w[VOLUME_MID + i] = (e1x * gx + e1y * gy + e1z * gz) * _SIXTH
        w[DILATATION + i] = 0.0


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def volumes(w, n):  # type: ignore[no-untyped-def]
    """Sets the row VOLUME from the edges. The result is bit-identical to that of ``end_gradients``."""
    for i in range(n):
        e1x, e1y, e1z = w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i]
        e2x, e2y, e2z = w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i]
        e3x, e3y, e3z = w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i]
        bx, by = (e2y * e3z - e2z * e3y) * _SIXTH, (e2z * e3x - e2x * e3z) * _SIXTH
        bz = (e2x * e3y - e2y * e3x) * _SIXTH
        w[VOLUME + i] = e1x * bx + e1y * by + e1z * bz


@njit("void(float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def growth(w, s, n, dt):  # type: ignore[no-untyped-def]
    """Sets the row VOLUME_MID to the mean of VOLUME and the volume before the step. Sets the row DILATATION to the
    difference of the two volumes, divided by VOLUME_MID and dt.

    The two rows are equal to those of ``kinematics`` up to terms of third order in the step. If dt is 0, the change is
    zero.
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
    """Sets the rows VOLUME_MID and DILATATION of tets at rest that store their volume."""
    for i in range(n):
        w[VOLUME_MID + i], w[DILATATION + i] = s[_VOLUME + i], 0.0


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def end_gradients(w, n):  # type: ignore[no-untyped-def]
    """Replaces the edges by b1, b2, b3 (m^2). Sets the row VOLUME (m^3), and the row AREAS to the sum of |b|^2 over the
    four nodes.
    """
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
    """Sets the row SPEED to the rate of change of the volume divided by the volume, 1/s. The rate is computed from V
    grad N and the velocity differences.
    """
    for i in range(n):
        ax, ay, az, bx, by, bz, cx, cy, cz = _rates(w, i)
        first = ax * w[EDGE + i] + ay * w[EDGE + CHUNK + i] + az * w[EDGE + 2 * CHUNK + i]
        second = bx * w[EDGE + 3 * CHUNK + i] + by * w[EDGE + 4 * CHUNK + i] + bz * w[EDGE + 5 * CHUNK + i]
        third = cx * w[EDGE + 6 * CHUNK + i] + cy * w[EDGE + 7 * CHUNK + i] + cz * w[EDGE + 8 * CHUNK + i]
        w[SPEED + i] = (first + second + third) / w[VOLUME + i]
