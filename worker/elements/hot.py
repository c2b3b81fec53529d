"""Faces of a tet that are overstressed by the stress of the tet alone. The inexpensive test of faces is made before the
fracture criterion (fracture/criterion.py).
"""

from ..kernels.jit import njit
from ..model.rows import PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ
from ..model.state import CHUNK
from .scratch import EDGE

_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_P = PRESSURE * CHUNK


@njit("boolean(float64, float64, float64, float64, float64, float64, float64, float64, float64, float64, float64)",
      cache=True, error_model="numpy")  # fmt: skip
def _passes(bx, by, bz, xx, yy, zz, yz, zx, xy, weight, square):  # type: ignore[no-untyped-def]
    """Returns True if the square of the first form of the criterion is at least ``square``, Pa^2. The traction is that
    on the area vector b.
    """
    tx, ty, tz = xx * bx + xy * by + zx * bz, xy * bx + yy * by + yz * bz, zx * bx + yz * by + zz * bz
    area = bx * bx + by * by + bz * bz
    normal = tx * bx + ty * by + tz * bz
    tension = max(normal, 0.0)
    return tension * tension + weight * ((tx * tx + ty * ty + tz * tz) * area - normal * normal) >= square * area * area


@njit("boolean(uint8[::1], float64[::1], float64[::1], float64[::1], float64, int64)", cache=True, error_model="numpy")
def mark_hot(hot, w, s, weakest, weight, n):  # type: ignore[no-untyped-def]
    """Sets bit k of ``hot`` if face k of a tet is overstressed by the stress of the tet without the viscous part.
    Returns True if any face is overstressed.

    ``w`` has the area vectors b1, b2, b3 of a chunk (elements/tet4.py).
    """
    some = 0
    for i in range(n):
        p = s[_P + i]
        xx, yy, zz = s[_SXX + i] - p, s[_SYY + i] - p, s[_SZZ + i] - p
        yz, zx, xy = s[_SYZ + i], s[_SZX + i], s[_SXY + i]
        ax, ay, az = w[EDGE + i], w[EDGE + CHUNK + i], w[EDGE + 2 * CHUNK + i]
        bx, by, bz = w[EDGE + 3 * CHUNK + i], w[EDGE + 4 * CHUNK + i], w[EDGE + 5 * CHUNK + i]
        cx, cy, cz = w[EDGE + 6 * CHUNK + i], w[EDGE + 7 * CHUNK + i], w[EDGE + 8 * CHUNK + i]
        square = weakest[i] * weakest[i]
        found = 1 * _passes(ax + bx + cx, ay + by + cy, az + bz + cz, xx, yy, zz, yz, zx, xy, weight, square)
        found |= 2 * _passes(ax, ay, az, xx, yy, zz, yz, zx, xy, weight, square)
        found |= 4 * _passes(bx, by, bz, xx, yy, zz, yz, zx, xy, weight, square)
        found |= 8 * _passes(cx, cy, cz, xx, yy, zz, yz, zx, xy, weight, square)
        hot[i] = found
        some |= found
    return some != 0
